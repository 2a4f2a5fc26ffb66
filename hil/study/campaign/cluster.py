"""Does the jobs of a campaign on a Dask cluster, by the address of its scheduler.

The cluster may grow and shrink meanwhile: what is handed out follows the threads it has. Whatever
ends the cluster for good is one line, and what has come until then is kept by the caller.

What goes to and fro are Python objects: who reaches the scheduler runs code on its workers and here. So
an address of another machine that is not checked by certificates (tls://) is told, once.
"""

from __future__ import annotations

import importlib
import logging
import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any, TypeVar

from hil.core.errors import BadInput, RigFault
from hil.study.campaign.workers import AHEAD, MOST_LOST, Waiting
from hil.study.workers import OfGroups, groups_of

Job = TypeVar("Job")
Result = TypeVar("Result")

_CONNECT_S = 10
# How often the cluster's size is looked at, and how long one without any thread is waited for.
_LOOK_S = 1.0
_SAY_S = 3.0
_GIVE_UP_S = 30.0
_LOOPBACK = {"127.0.0.1", "localhost", "::1"}
# What a worker has to be able to import.
PROGRAM = ("hil.runs.execute", "hil.study.campaign.work", "sim_twin._native")
_KEPT = "rows so far are kept, the same command goes on"


def on_dask(
    function: Callable[[Job], Result],
    jobs: Iterable[Job],
    address: str,
    lost: Callable[[Job, str], Result] | None = None,
    say: Callable[[str], None] = lambda _text: None,
    needed: Sequence[str] = PROGRAM,
    side_by_side: int = 1,
) -> Iterator[Result]:
    """Yield the results of all jobs from the cluster whose scheduler is at `address`.

    They go to its workers in groups of `side_by_side`; those of a group that was lost go one by one.

    `lost` makes a job's result of it and the reason when each worker that took it died; `say` is
    told what is waited for; `needed` are the modules that a worker must be able to import. Raises
    BadInput when no scheduler answers, RigFault when the cluster goes away, has no worker for a
    while, or cannot run this program.
    """
    try:
        dask: Any = importlib.import_module("distributed")  # an optional package
    except ImportError:
        raise BadInput(
            "--dask: the package distributed is missing; pip install 'skid-steer-hil[cluster]'"
        ) from None
    doubt = open_to_others(address)
    if doubt:
        say(f"--dask {address}: {doubt}")
    with _quiet():
        try:
            client = dask.Client(address, timeout=_CONNECT_S)
        except (OSError, ValueError, TimeoutError) as error:
            raise BadInput(f"--dask {address}: no scheduler answers there ({error})") from None
        crew = _Crew(dask, client, address, say, f"import {', '.join(needed)}")
        try:
            yield from crew.do(OfGroups(function), Waiting(groups_of(jobs, side_by_side)), lost)
        finally:
            with suppress(Exception):  # the scheduler may be gone: nothing is left to be told
                client.close(timeout=2)


def open_to_others(address: str) -> str:
    """Return what is trusted by using a scheduler at `address`, "" for this machine's or a checked one."""
    kind, _, place = address.rpartition("://")
    host = place.rpartition(":")[0] or place
    if kind in {"tls", "wss", "inproc"} or host.strip("[]") in _LOOPBACK:
        return ""
    return (
        "whoever reaches that scheduler can run code on its workers and here, and nothing checks who "
        "does; use tls://, or a tunnel to a scheduler on 127.0.0.1"
    )


class _Crew:
    """One campaign's use of a cluster."""

    def __init__(
        self, dask: Any, client: Any, address: str, say: Callable[[str], None], probe: str
    ) -> None:
        self._dask, self._client, self._address, self._say = dask, client, address, say
        self._probe = probe
        self._looked_s = -math.inf
        self._threads = 0
        self._checked: dict[str, str] = {}  # by worker: why it cannot run this program, or ""
        self._idle_since_s: float | None = None
        self._said = False

    def do(
        self,
        function: OfGroups[Job, Result],
        todo: Waiting[tuple[Job, ...]],
        lost: Callable[[Job, str], Result] | None,
    ) -> Iterator[Result]:
        """Yield results as they come, with some groups of jobs ahead for each thread of the cluster.

        Raises RigFault when the cluster goes away.
        """
        pending: dict[Any, tuple[Job, ...]] = {}
        lost_in_a_row = 0
        while todo or pending:
            most = AHEAD * max(1, self._look())
            while todo and len(pending) < most:
                # A job is not kept under a name made of its content: two campaigns may share jobs.
                future = self._asked(self._client.submit, function, todo.first, pure=False)
                pending[future] = todo.popleft()
            for future in self._done(list(pending)):
                group = pending.pop(future)
                results, reason = self._result(future)
                if not reason:
                    lost_in_a_row = 0
                    yield from results
                elif len(group) > 1:
                    for job in group[::-1]:
                        todo.appendleft((job,))
                elif lost is None or lost_in_a_row + 1 >= MOST_LOST:
                    raise RigFault(f"--dask {self._address}: job {group[0]}: {reason}; {_KEPT}")
                else:
                    lost_in_a_row += 1
                    yield lost(group[0], reason)

    def _look(self) -> int:
        """Return the cluster's threads; says so when there are none, and gives up after a while."""
        now_s = time.monotonic()
        if now_s - self._looked_s < _LOOK_S:
            return self._threads
        self._looked_s = now_s
        threads: dict[str, int] = self._asked(self._client.nthreads)
        self._check(threads)
        self._threads = sum(n for who, n in threads.items() if not self._checked.get(who))
        if self._threads:
            self._idle_since_s, self._said = None, False
            return self._threads
        self._idle_since_s = now_s if self._idle_since_s is None else self._idle_since_s
        waited_s = now_s - self._idle_since_s
        if waited_s >= _GIVE_UP_S:
            raise RigFault(
                f"--dask {self._address}: the scheduler has no worker for {waited_s:.0f} s; start "
                f"one (dask worker {self._address}, where this program is installed); {_KEPT}"
            )
        if waited_s >= _SAY_S and not self._said:
            self._said = True
            self._say(f"--dask {self._address}: the scheduler has no worker; waiting for one")
        return 0

    def _check(self, workers: Iterable[str]) -> None:
        """Let workers that are new import this program; raises RigFault when none of all can."""
        new = [who for who in workers if who not in self._checked]
        if new:
            told = self._asked(self._client.run, exec, self._probe, workers=new, on_error="return")
            for who, error in told.items():
                if error is None or isinstance(error, ImportError):  # else it is going away
                    self._checked[who] = str(error or "")
        reasons = [self._checked.get(who, "") for who in workers]
        if reasons and all(reasons):
            raise RigFault(
                f"--dask {self._address}: none of {len(reasons)} workers can run this program "
                f"({reasons[0]}); install skid-steer-hil there; {_KEPT}"
            )

    def _done(self, pending: list[Any]) -> list[Any]:
        """Return what has ended, after a while also nothing."""
        try:
            ended = self._asked(
                self._dask.wait, pending, timeout=_LOOK_S, return_when="FIRST_COMPLETED"
            )
        except TimeoutError:
            return []
        return list(ended.done)

    def _result(self, future: Any) -> tuple[Any, str]:
        """Return a result, or why there is none: each worker that took the job died."""
        try:
            return self._asked(future.result, timeout=_CONNECT_S), ""
        except self._dask.scheduler.KilledWorker as error:
            return None, f"each of {error.allowed_failures + 1} workers that took it died"
        except ImportError as error:
            raise RigFault(
                f"--dask {self._address}: a worker cannot run this program ({error}); install "
                f"skid-steer-hil there; {_KEPT}"
            ) from None

    def _asked(self, call: Callable[..., Any], *args: Any, **named: Any) -> Any:
        """Return what the cluster answers; raises RigFault when it does not any more."""
        try:
            return call(*args, **named)
        except TimeoutError:
            if self._client.status == "running":
                raise
            reason = "no answer in time"
        except self._dask.CancelledError:
            reason = "connection lost"
        except OSError as error:
            reason = str(error).partition("\n")[0] or type(error).__name__
        raise RigFault(f"--dask {self._address}: the scheduler is gone ({reason}); {_KEPT}")


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the log of the cluster's own library off the terminal: what matters is raised."""
    handlers = logging.getLogger("distributed").handlers
    levels = [handler.level for handler in handlers]
    for handler in handlers:
        handler.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for handler, level in zip(handlers, levels, strict=True):
            handler.setLevel(level)
