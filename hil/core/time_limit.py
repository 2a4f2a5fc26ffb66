"""A limit on the time that a call into code from outside may take."""

from __future__ import annotations

import signal
import sys
import threading
from contextlib import AbstractContextManager, nullcontext
from types import FrameType, TracebackType
from typing import Any

# The system's own function: what is around it in `signal` takes ten times as long for each handler.
_set_handler: Any = getattr(sys.modules.get("_signal"), "signal", signal.signal)
_MAIN = threading.main_thread()


class TooLongError(BaseException):
    """The time of a call is up; no Exception, or code that passes over those would go on for ever."""


def _ring(_number: int, _frame: FrameType | None) -> None:
    raise TooLongError


class _Alarm:
    """The alarm while a body runs: no generator, which would take as long as all calls of the system."""

    __slots__ = ("_before", "_seconds")

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds

    def __enter__(self) -> None:
        self._before: Any = _set_handler(_SIGNAL, _ring)
        _set_timer(_TIMER, self._seconds)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        try:
            _set_timer(_TIMER, 0.0)
        finally:
            _set_handler(_SIGNAL, self._before)


if hasattr(signal, "setitimer"):
    _set_timer = signal.setitimer
    _TIMER, _SIGNAL = int(signal.ITIMER_REAL), int(signal.SIGALRM)  # members of an enum take longer


def time_limit(seconds: float) -> AbstractContextManager[None]:
    """Raise TooLongError in the body after `seconds`, where the system can (main thread, not Windows)."""
    if not hasattr(signal, "setitimer") or threading.current_thread() is not _MAIN:
        return nullcontext()
    return _Alarm(seconds)
