"""Speed figures: medians of several runs of one thing, never a test."""

from __future__ import annotations

import resource
import statistics
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

# Name, unit, goal, and what gives one value.
Plan = tuple[str, str, str, Callable[[], float]]


@dataclass(frozen=True, slots=True)
class Figure:
    """One speed figure: median, least and largest of `runs` runs; `goal` is what it should reach.

    `values` are all that was measured, in ascending order.
    """

    name: str
    unit: str
    median: float
    least: float
    largest: float
    runs: int
    goal: str
    values: tuple[float, ...]

    @classmethod
    def of(cls, name: str, unit: str, values: Sequence[float], goal: str) -> Figure:
        """Return the figure of measured values."""
        found = tuple(sorted(values))
        middle = statistics.median(found)
        return cls(name, unit, middle, found[0], found[-1], len(found), goal, found)


def measure(name: str, unit: str, goal: str, runs: int, once: Callable[[], float]) -> Figure:
    """Return the figure of `once`, called `runs` times after one call that is not counted."""
    once()
    return Figure.of(name, unit, [once() for _ in range(runs)], goal)


def peak_memory_mb() -> float:
    """Return the largest memory that this process had so far, MB.

    The system's own figure for a child begins with what its parent had, so the process's is asked for first.
    """
    return _told_mb("VmHWM:") or resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def memory_mb() -> float:
    """Return the memory that this process has now, MB; the largest it had where the system does not say."""
    return _told_mb("VmRSS:") or peak_memory_mb()


def _told_mb(what: str) -> float:
    """Return what Linux says of this process, MB; 0 where it does not."""
    with suppress(OSError):
        for line in Path("/proc/self/status").read_text(encoding="utf-8").splitlines():
            if line.startswith(what):
                return float(line.split()[1]) / 1024.0
    return 0.0
