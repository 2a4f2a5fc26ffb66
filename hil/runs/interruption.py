"""Ctrl-C during a run: obeyed at the rig's next wait, so that it falls on a known instant.

Python raises KeyboardInterrupt wherever the program happens to be; a replay could not stop there
again. A session waits at least once a tick, so the stop of the robot begins within one (1/30 s, or
what a late host needs for it). Ctrl-C once more, before that, is KeyboardInterrupt at once.
"""

from __future__ import annotations

import signal
import threading
from types import FrameType
from typing import Any, Self


class CtrlC:
    """Takes Ctrl-C while it is entered; in a thread that is not the main one it does nothing."""

    def __init__(self) -> None:
        self._asked = False
        self._before: Any = None

    def __enter__(self) -> Self:
        """Begin to take Ctrl-C."""
        if threading.current_thread() is threading.main_thread():
            self._before = signal.signal(signal.SIGINT, self._ask)
        return self

    def __exit__(self, *_exc: object) -> None:
        """Leave Ctrl-C as it was."""
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)

    def _ask(self, _number: int, _frame: FrameType | None) -> None:
        if self._asked:
            raise KeyboardInterrupt
        self._asked = True

    def obey(self) -> None:
        """Raise KeyboardInterrupt if Ctrl-C was pressed; once for each time."""
        if self._asked:
            self._asked = False
            raise KeyboardInterrupt
