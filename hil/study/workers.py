"""What a worker process owes its parent: it ends when the parent is gone, whatever killed that."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing.process import BaseProcess
from typing import TypeVar

from hil.runs.interruption import CtrlC

Job = TypeVar("Job")
Result = TypeVar("Result")


def submit(
    pool: ProcessPoolExecutor, function: Callable[[Job], Result], job: Job
) -> Future[Result]:
    """Hand a job to a pool; a signal that comes meanwhile is obeyed after that.

    A pool starts its workers as jobs come. One whose start is broken off would tell of that by a traceback.
    """
    with CtrlC() as later:
        future = pool.submit(function, job)
    later.obey()
    return future


def leave_ctrl_c_to_parent() -> None:
    """Set a worker up whose jobs are short and leave nothing: it ends at once with its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
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
