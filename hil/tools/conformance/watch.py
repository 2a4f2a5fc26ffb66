"""Hears whether code reads a clock, or a random number that no seed decides, however it got at them.

The interpreter itself tells of every call (sys.setprofile), so that `from time import monotonic` in the
code watched is heard like `time.monotonic()`; the state of numpy's global generator is looked at before
and after.
"""

from __future__ import annotations

import datetime
import random
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import FrameType
from typing import Any

import numpy as np

from hil.tools.conformance.report import Violation

_CLOCKS = frozenset(
    f"{name}{suffix}"
    for name in ("time", "monotonic", "perf_counter", "process_time", "thread_time", "clock_gettime")
    for suffix in ("", "_ns")
) | {"localtime", "gmtime", "ctime", "sleep"}  # fmt: skip
_TODAY = frozenset({"now", "utcnow", "today"})
_ENTROPY = frozenset({"urandom", "getrandom"})
_GLOBAL: Any = random.random.__self__  # type: ignore[attr-defined]
_SEEDERS = (random.Random.__init__.__code__, random.Random.seed.__code__)


@dataclass(slots=True)
class Heard:
    """Names of the calls heard, each once, in their order."""

    clocks: list[str] = field(default_factory=list)
    random: list[str] = field(default_factory=list)

    def _note(self, names: list[str], name: str) -> None:
        if name not in names:
            names.append(name)

    def call(self, frame: FrameType, event: str, function: Any) -> None:
        """Take one event of the interpreter."""
        if event == "c_call":
            self._native(function)
        elif event == "call" and frame.f_code in _SEEDERS:
            seed = frame.f_locals.get("a", frame.f_locals.get("x"))
            if seed is None:
                self._note(self.random, "random.Random() without a seed")

    def _native(self, function: Any) -> None:
        name = getattr(function, "__name__", "")
        module = getattr(function, "__module__", None) or ""
        owner = getattr(function, "__self__", None)
        if module == "time" and name in _CLOCKS:
            self._note(self.clocks, f"time.{name}()")
        elif name in _TODAY and isinstance(owner, type) and issubclass(owner, datetime.date):
            self._note(self.clocks, f"{owner.__name__}.{name}()")
        elif module == "posix" and name == "times":
            self._note(self.clocks, "os.times()")
        elif module in {"posix", "nt"} and name in _ENTROPY:
            self._note(self.random, f"os.{name}()")
        elif owner is _GLOBAL:
            self._note(self.random, f"random.{name}()")


@contextmanager
def watch(heard: Heard) -> Iterator[None]:
    """Note in `heard` what the code in the body calls."""
    before = sys.getprofile()
    state = _numpy_state()
    sys.setprofile(heard.call)
    try:
        yield
    finally:
        sys.setprofile(before)
        if _numpy_state() != state:
            heard._note(heard.random, "numpy.random (the global generator)")


def require_no_clock(heard: Heard, instead: str) -> str:
    """Return that no clock was heard; raises Violation, which says what there is `instead`."""
    if heard.clocks:
        raise Violation(f"calls {', '.join(heard.clocks)}; {instead}")
    return "no call of a clock"


def require_no_random(heard: Heard) -> str:
    """Return that no unseeded random number was heard; raises Violation."""
    if heard.random:
        raise Violation(f"calls {', '.join(heard.random)}; draw from a generator with a fixed seed")
    return "no call of a generator without a seed"


def _numpy_state() -> tuple[bytes, int]:
    state: Any = np.random.get_state(legacy=True)
    return state[1].tobytes(), state[2]
