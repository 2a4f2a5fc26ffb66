"""Ctrl-C during a run: obeyed at the rig's next wait, so that it falls on a known instant.

Python raises KeyboardInterrupt wherever the program happens to be; a replay could not stop there
again. A session waits at least once a tick, so the stop of the robot begins within one (1/30 s, or
what a late host needs for it). Ctrl-C once more, before that, is KeyboardInterrupt at once.

A plain `kill` (SIGTERM) and a terminal that is closed (SIGHUP) are taken as Ctrl-C is.
"""

from __future__ import annotations

import signal
import threading
from types import FrameType
from typing import Any, Self

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")  # Windows has no SIGHUP
SIGNALS = tuple(getattr(signal, name) for name in _NAMES if hasattr(signal, name))


def end_as_by_ctrl_c() -> None:
    """Let SIGTERM and SIGHUP raise KeyboardInterrupt; one that is ignored (nohup) stays so."""
    for number in SIGNALS:
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _interrupt)


def _interrupt(_number: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


class CtrlC:
    """Takes Ctrl-C while it is entered; in a thread that is not the main one it does nothing."""

    def __init__(self) -> None:
        self._asked: set[int] = set()
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Self:
        """Begin to take Ctrl-C, SIGTERM and SIGHUP, as far as they are not ignored."""
        if threading.current_thread() is threading.main_thread():
            for number in SIGNALS:
                if signal.getsignal(number) is not signal.SIG_IGN:
                    self._before[number] = signal.signal(number, self._ask)
        return self

    def __exit__(self, *_exc: object) -> None:
        """Leave the signals as they were."""
        for number, before in self._before.items():
            signal.signal(number, before)
        self._before.clear()

    def _ask(self, number: int, _frame: FrameType | None) -> None:
        if number in self._asked:  # SIGTERM and SIGHUP may well come together
            raise KeyboardInterrupt
        self._asked.add(number)

    def obey(self) -> None:
        """Raise KeyboardInterrupt if Ctrl-C was pressed; once for each time."""
        if self._asked:
            self._asked.clear()
            raise KeyboardInterrupt
