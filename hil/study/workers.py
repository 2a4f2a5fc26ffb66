"""What a worker process owes its parent: it ends when the parent is gone, whatever killed that."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from multiprocessing.process import BaseProcess


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
