"""A limit on the time that a call into code from outside may take."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

# The system's own function: what is around it in `signal` takes ten times as long for each handler.
_set_handler = getattr(signal.signal, "__wrapped__", signal.signal)


class TooLongError(BaseException):
    """The time of a call is up; no Exception, or code that passes over those would go on for ever."""


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise TooLongError in the body after `seconds`, where the system can (main thread, not Windows)."""
    if (
        not hasattr(signal, "setitimer")
        or threading.current_thread() is not threading.main_thread()
    ):
        yield
        return

    def ring(_number: int, _frame: FrameType | None) -> None:
        raise TooLongError

    before = _set_handler(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        _set_handler(signal.SIGALRM, before)
