"""Settings shared by the tests of ends."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest

from hil.runs.interruption import SIGNALS


@pytest.fixture(autouse=True)
def _signals_as_a_terminal_gives_them() -> Iterator[None]:
    """Under nohup, or in a shell's background job, the tests and what they start would ignore some."""
    before = {number: signal.getsignal(number) for number in SIGNALS}
    for number in SIGNALS:
        own = signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
        signal.signal(number, own)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)
