"""Several runs in memory side by side in one process: each is to the bit what it is alone.

Connecting, finding and arming are done one run after the other; so are their stops. The controlled parts
advance together in native code (native/together.hpp): the rigs of all are moved in one go, and a law that can
step several runs at once (hil.core.batch) is asked once for all of them. A run whose ticks are Python's is
made by itself before. Whatever ends a run ends that run.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.control.laws.guarded_batch import GuardedBatch, batches
from hil.control.translated import trace_places
from hil.core.batch import ROWS
from hil.core.errors import RigFault
from hil.record.reader import RunRecord
from hil.runs import _native
from hil.runs.execute import InMemory

if TYPE_CHECKING:
    from hil.runs.driving import Asked, Turn
    from hil.runs.session import Session
    from hil.runs.spec import RunSpec

# What a run held, or what making it raised.
Result = RunRecord | Exception | SystemExit


def execute_together(specs: Sequence[RunSpec]) -> list[Result]:
    """Run the specs side by side; return of each what `execute_in_memory` would return or raise.

    Raises KeyboardInterrupt once all have been stopped.
    """
    return run_together([partial(InMemory, spec) for spec in specs])


def run_together(makers: Sequence[Callable[[], InMemory]]) -> list[Result]:
    """Run what each of the makers opens; the same."""
    found: list[InMemory | Exception | SystemExit] = []
    try:
        for make in makers:
            try:
                found.append(make())
            except (Exception, SystemExit) as error:
                found.append(error)
        for company in _companies([run for run in found if isinstance(run, InMemory)]):
            _to_their_ends([run.session for run in company])
        return [_record(run) if isinstance(run, InMemory) else run for run in found]
    finally:
        for run in found:
            if isinstance(run, InMemory):
                run.close()


def figures_together(
    makers: Sequence[Callable[[], InMemory]],
) -> list[dict[str, float] | None]:
    """Return the figures of such runs, None of one that ends early; raises what making one raised."""
    found: list[dict[str, float] | None] = []
    for record in run_together(makers):
        if isinstance(record, BaseException):
            raise record
        done = record.manifest.outcome == "complete"
        found.append(record.figures().values if done else None)
    return found


def _companies(runs: Sequence[InMemory]) -> list[list[InMemory]]:
    """Return who runs beside whom: never two of one law, which each of them starts anew."""
    found: list[list[InMemory]] = []
    taken: Counter[int] = Counter()
    for run in runs:
        law = id(run.own_law)
        if taken[law] == len(found):
            found.append([])
        found[taken[law]].append(run)
        taken[law] += 1
    return found


def _record(run: InMemory) -> Result:
    try:
        return run.record()
    except (Exception, SystemExit) as error:
        return error


def _to_their_ends(sessions: Sequence[Session]) -> None:
    """Run the sessions; raises KeyboardInterrupt once all have been stopped."""
    company = _Company(sessions)
    try:
        company.begin()
        company.go_on()
    except KeyboardInterrupt as stop:
        company.stop(stop)
        raise
    finally:
        company.close()


class _Company:
    """Sessions that advance together; places are those of the sessions whose ticks are native."""

    def __init__(self, sessions: Sequence[Session]) -> None:
        self._sessions = sessions
        self._phases: list[Generator[Turn, int]] = []
        self._running: dict[int, Generator[Turn, int]] = {}
        self._members: dict[int, Session] = {}
        self._native = _native.Together()
        self._asked: dict[int, _Batch] = {}

    def begin(self) -> None:
        """Bring all sessions to their first tick, or to their ends."""
        turns = []
        for session in self._sessions:
            self._phases.append(session.turns())
            turn = next(self._phases[-1], None)
            if turn is None:
                _obey(session)
                continue
            place = self._native.add(turn.drive)
            self._running[place], self._members[place] = self._phases[-1], session
            turns.append(turn)
            self._take(place, turn)
        self._ask(turns)

    def _ask(self, turns: Sequence[Turn]) -> None:
        """Put the laws that step several runs at once together."""
        asked = [(place, turn.asked) for place, turn in enumerate(turns) if turn.asked is not None]
        for places in batches([one.law for _, one in asked]):
            batch = _Batch([asked[at] for at in places])
            for at in places:
                self._asked[asked[at][0]] = batch

    def go_on(self) -> None:
        """Advance until all sessions have ended."""
        native = self._native
        while self._running:
            for place, stop in native.run():
                phases = self._running[place]
                if stop == _native.FAILED:
                    self._resume(place, phases.throw, self._thrown(place))
                else:
                    self._resume(place, phases.send, stop)
            waiting = native.waiting
            while waiting:
                batch = self._asked[waiting[0]]
                now = [place for place in waiting if self._asked[place] is batch]
                waiting = [place for place in waiting if self._asked[place] is not batch]
                self._answer(batch, now)

    def _thrown(self, place: int) -> BaseException:
        """Return what a run threw in native code; raises KeyboardInterrupt, which is for all."""
        try:
            self._native.rethrow(place)
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            return error

    def _answer(self, batch: _Batch, places: Sequence[int]) -> None:
        faults = batch.answer(places)
        for place in places:
            if place in faults:
                self._resume(place, self._running[place].throw, faults[place])
            else:
                self._native.answered(place)

    def _resume(self, place: int, how: Callable[[Any], Turn], given: object) -> None:
        try:
            turn = how(given)
        except StopIteration:
            del self._running[place]
            self._native.end(place)
            _obey(self._members[place])
        else:
            self._take(place, turn)

    def _take(self, place: int, turn: Turn) -> None:
        self._native.go_on(place, turn.busy, turn.refused, turn.board)

    def stop(self, stop: KeyboardInterrupt) -> None:
        """Stop all that still run."""
        for phases in self._running.values():
            with suppress(StopIteration):
                phases.throw(KeyboardInterrupt(str(stop)))
        self._running.clear()

    def close(self) -> None:
        """Stop what still runs; nothing after an ordinary end."""
        for phases in self._phases:
            phases.close()


def _obey(session: Session) -> None:
    """Stop all where one was interrupted."""
    if session.ending.outcome == "interrupted":
        raise KeyboardInterrupt(session.ending.detail)


class _Batch:
    """The laws of several runs, stepped at once."""

    def __init__(self, asked: Sequence[tuple[int, Asked]]) -> None:
        self._at = {place: at for at, (place, _) in enumerate(asked)}
        self._asked = [one for _, one in asked]
        self._places = trace_places(self._asked[0].own_terms)
        self._batch: GuardedBatch | None = None

    def answer(self, places: Sequence[int]) -> Mapping[int, Exception | SystemExit]:
        """Answer for the runs at `places`, whose laws are asked; return what ends which of them."""
        where = np.array([self._at[place] for place in places], np.intp)
        laws = [self._asked[at].native for at in where.tolist()]
        rows = np.frombuffer(_native.questions(laws)).reshape(ROWS + 1, len(laws))
        reset = rows[ROWS] != 0.0
        try:
            if self._batch is None:
                self._batch = GuardedBatch([one.law for one in self._asked])
            given, names, faults = self._batch.step(where, rows[:ROWS], reset)
        except RigFault as fault:
            return {place: RigFault(str(fault)) for place in places}
        except (Exception, SystemExit) as error:  # of no run beside these
            return dict.fromkeys(places, error)
        kept = [self._places[name] for name in names if name in self._places]
        if len(kept) < len(names):
            given = given[[0, 1, *(2 + i for i, name in enumerate(names) if name in self._places)]]
        _native.answer(laws, given.tobytes(), kept)
        return {places[column]: fault for column, fault in faults.items()}
