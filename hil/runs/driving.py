"""The controlled part of a run in native code, where every part of it has a native form.

The ticks are native/drive.hpp; it comes back for what only Python knows: procedures, texts of the board,
what ends a run, and the step of a law that is not translated. Where something is looked at or changed on the
way (a caller that steps, a watcher, an operator, a reference of somebody's own), the session goes tick by
tick instead: the same run. Of several runs the native parts may advance side by side (hil/runs/together.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from hil.control.estimators.geometry import BelievedGeometry
from hil.control.translated import native_forms, trace_places
from hil.record.memory import MemoryRecorder
from hil.record.schema import TRACE_KEYS
from hil.runs import _native
from hil.runs.parts import NoOrders

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

    from hil.control.laws.guard import GuardedLaw
    from hil.runs.intake import Intake
    from hil.runs.parts import Parts


class Asked(NamedTuple):
    """A law that is answered for several runs at once: what native code asks, the run's own law."""

    native: _native.AnsweredLaw
    law: GuardedLaw
    own_terms: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Turn:
    """A run whose ticks others advance: what they do it by, with what `Drive.run` is given.

    `asked` is its law, where that is answered for several runs at once.
    """

    drive: _native.Drive
    busy: bool
    refused: bool
    board: tuple[int, float, float]
    asked: Asked | None


def make_drive(
    parts: Parts,
    pump: _native.Pump,
    watch: _native.Watch,
    t0_s: float,
    period_s: float,
    ticks: int,
    asked: list[Asked] | None = None,
) -> _native.Drive | None:
    """Return what runs the ticks natively; None where a part has no native form.

    A law that can answer for several runs at once is left to others and added to `asked`, if given.
    """
    geometry = parts.vehicle.geometry
    if type(parts.orders) is not NoOrders:
        return None
    if type(geometry) is not BelievedGeometry:
        return None
    stand_in = None if asked is None else _left_to(asked, parts.own_terms)
    forms = native_forms(parts.law, parts.reference, parts.own_terms, stand_in)
    if forms is None:
        return None
    law, reference = forms
    places = trace_places(parts.own_terms)
    return _native.Drive(
        pump=pump,
        watch=watch,
        law=law,
        reference=reference,
        geometry=geometry,
        t0_s=t0_s,
        period_s=period_s,
        ticks=ticks,
        common=[places.get(str(key), -1) for key in TRACE_KEYS],
        own=[places.get(key, -1) for key in parts.own_terms],
    )


def _left_to(
    asked: list[Asked], own_terms: tuple[str, ...]
) -> Callable[[GuardedLaw], _native.AnsweredLaw]:
    """Return what stands for a law in native code while others answer, and notes it in `asked`."""

    def stand_in(law: GuardedLaw) -> _native.AnsweredLaw:
        asked.append(Asked(_native.AnsweredLaw(), law, own_terms))
        return asked[-1].native

    return stand_in


def drive_to_end(
    drive: _native.Drive,
    parts: Parts,
    pump: _native.Pump,
    intake: Intake,
    board: Callable[[], tuple[int, float, float]],
    check_safety: Callable[[float], None],
    asked: list[Asked] | None = None,
) -> Generator[Turn, int]:
    """Run all ticks; raises as `check_safety` (asked at the host's time) and everybody on the way do.

    Where `asked` is given others advance the drive: it is yielded, and why it stopped is sent in return.
    """
    link, recorder = parts.link, parts.recorder
    assert isinstance(recorder, MemoryRecorder)  # else there is no pump
    stop = -1
    try:
        while stop != _native.DONE:
            busy, refused = link.busy, bool(intake.refusal)
            if asked is None:
                stop = drive.run(busy, refused, board())
            else:
                stop = yield Turn(drive, busy, refused, board(), asked[0] if asked else None)
            if stop == _native.DRIVE_HEARD:
                intake.hear(pump)
            elif stop == _native.DRIVE_TAKEN:
                intake.note_texts()
            elif stop == _native.ASKED:
                check_safety(parts.rig.now_s())
            recorder.rows.take(drive.take_rows())
    finally:
        recorder.rows.take(drive.take_rows())
        link.t_s = max(link.t_s, drive.reached_s)
