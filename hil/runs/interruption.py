"""Every end that is asked for from outside: Ctrl-C, SIGTERM (a time-out, `kill`), SIGHUP (a lost terminal).

A run obeys at the rig's next wait, so that the end falls on a known instant: Python raises
KeyboardInterrupt wherever the program happens to be, and a replay could not stop there again. A
session waits at least once a tick, so the stop of the robot begins within one (1/30 s, or what a
late host needs for it). A second signal before that is obeyed at once. While the record is being
closed signals are noted and nothing more: closing is finished first.

Outside of runs a signal is `hil.core.errors.Stopped`, raised at once. Ignored signals (nohup, a job
in the background) stay ignored.
"""

from __future__ import annotations

import atexit
import os
import signal
import threading
from contextlib import suppress
from types import FrameType
from typing import Any, NoReturn, Self

from hil.core.errors import Stopped

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")  # Windows has no SIGHUP
SIGNALS = tuple(getattr(signal, name) for name in _NAMES if hasattr(signal, name))


class _Last:
    """The signal that came last in this process, for those who see only what it turned into."""

    stopped: Stopped | None = None


def last_stop() -> Stopped | None:
    """Return the signal that came last, None when none came."""
    return _Last.stopped


def take_signals() -> None:
    """Let the signals raise Stopped in the main thread; one that is ignored stays so."""
    _handle(_stop)


def ignore_signals() -> None:
    """Ignore the signals to the end: the work is done, and its status known.

    Until the interpreter ends, by a handler that does nothing: what runs in this process after the
    command, and every process begun there, would else take the signals as ignored from outside.
    """
    _handle(_pass)
    atexit.unregister(_handle)
    atexit.register(_handle, signal.SIG_IGN)  # Python takes its handlers away at the end


def _pass(_number: int, _frame: FrameType | None) -> None:
    """Do nothing."""


def _handle(handler: Any) -> None:
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handler)


def _noted(number: int) -> Stopped:
    _Last.stopped = Stopped(number)
    return _Last.stopped


def _stop(number: int, frame: FrameType | None) -> NoReturn:
    stopped = _noted(number)
    if _imports(frame):  # nothing is begun, and compiled modules do not survive an exception there
        with suppress(OSError):  # a lost terminal takes no word
            os.write(2, f"hil: stopped by {stopped}\n".encode())
        os._exit(128 + number)
    raise stopped


def _imports(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False


class CtrlC:
    """Keeps the signals for `obey` while entered; in a thread that is not the main one it does nothing."""

    def __init__(self) -> None:
        self._asked: Stopped | None = None
        self._closing = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Self:
        """Begin to take the signals, as far as they are not ignored."""
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
        again = self._asked is not None and self._asked.number == number
        if again and not self._closing:  # SIGTERM and SIGHUP may well come together
            raise _noted(number)
        self._asked = self._asked or _noted(number)

    def close(self) -> None:
        """From now on only note the signals: the record is being closed."""
        self._closing = True

    def obey(self) -> None:
        """Raise Stopped if a signal came; once for each time."""
        if self._asked is not None:
            stopped, self._asked = self._asked, None
            raise stopped
