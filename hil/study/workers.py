"""What a worker process owes its parent: it ends when the parent is gone, whatever killed that.

And what it is given: jobs in groups, for functions that do several of them side by side.
"""

from __future__ import annotations

import gc
import itertools
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.process import BaseProcess
from typing import Any, Generic, TypeVar

from hil.core.batch import SIDE_BY_SIDE
from hil.runs.interruption import CtrlC

Job = TypeVar("Job")
Result = TypeVar("Result")

# A worker gets so many groups at least, or there would be none for one that is done early.
_GROUPS_A_WORKER = 3


class OfGroups(Generic[Job, Result]):
    """Does a group of jobs: side by side by the function's `many(jobs)`, where it has that.

    What a process holds after its first group stays to its end: its code, and what the jobs share. Looking
    through that for cycles again and again would take a twentieth of a worker's time.
    """

    def __init__(self, function: Callable[[Job], Result]) -> None:
        self._function = function

    def __call__(self, jobs: Sequence[Job]) -> list[Result]:
        """Return the results of the jobs, in their order."""
        many: Any = getattr(self._function, "many", None)
        done = [self._function(job) for job in jobs] if many is None else list(many(jobs))
        if not gc.get_freeze_count():
            gc.collect()
            gc.freeze()
        return done


def group_size(function: Callable[..., object], jobs: int, workers: int) -> int:
    """Return how many of so many jobs a worker is given at once."""
    if not hasattr(function, "many"):
        return 1
    return max(1, min(SIDE_BY_SIDE, jobs // (_GROUPS_A_WORKER * max(workers, 1))))


def groups_of(jobs: Iterable[Job], size: int) -> Iterator[tuple[Job, ...]]:
    """Yield the jobs in groups of `size`, the last one of what is left."""
    rest = iter(jobs)
    while group := tuple(itertools.islice(rest, size)):
        yield group


def submit(
    pool: ProcessPoolExecutor, function: Callable[[Job], Result], job: Job
) -> Future[Result]:
    """Hand a job to a pool; a signal that comes meanwhile is obeyed after that.

    A pool starts its workers as jobs come. One whose start is broken off would tell of that by a traceback:
    here, and in the worker itself, which Ctrl-C in a terminal reaches too; it waits there for `take_ctrl_c`.
    """
    resource_tracker.ensure_running()  # begins a process with a mask of its own, and undoes this one
    with CtrlC() as later, _ctrl_c_held():
        future = pool.submit(function, job)
    later.obey()
    return future


@contextmanager
def _ctrl_c_held() -> Iterator[None]:
    """Hold Ctrl-C back from this thread, and from the processes it begins, where the system can."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def take_ctrl_c(handler: Any) -> None:
    """Set in a worker what Ctrl-C does there from now on."""
    signal.signal(signal.SIGINT, handler)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def leave_ctrl_c_to_parent() -> None:
    """Set a worker up whose jobs are short and leave nothing: it ends at once with its parent."""
    take_ctrl_c(signal.SIG_IGN)
    when_parent_is_gone(lambda: None)


def when_parent_is_gone(tidy_up: Callable[[], None]) -> None:
    """Watch the parent from a thread; when it dies, call `tidy_up` and end this process."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_watch, args=(parent, tidy_up), daemon=True).start()


def _watch(parent: BaseProcess, tidy_up: Callable[[], None]) -> None:
    parent.join()
    try:
        tidy_up()
    finally:
        os._exit(1)
