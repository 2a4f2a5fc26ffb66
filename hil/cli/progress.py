"""Progress bars on stderr, shared by the commands that take long."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hil.core.text import visible

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

Update = Callable[[str, float], None]


def _may_be_a_terminal() -> bool:
    """Say whether stderr may show bars; where it cannot, what draws them need not be loaded."""
    asked_for = {"FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"}
    return sys.stderr.isatty() or not asked_for.isdisjoint(os.environ)


@contextmanager
def run_progress(durations_s: Mapping[str, float]) -> Iterator[Update]:
    """Show one bar per run; `update(name, t_s)` moves it. Nothing is shown off a terminal."""
    if not _may_be_a_terminal():
        yield lambda _name, _t_s: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.completed:5.1f}/{task.total:.0f} s simulated"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, disable=not console.is_terminal) as bars:
        tasks = {
            name: bars.add_task(visible(name), total=total) for name, total in durations_s.items()
        }
        yield lambda name, t_s: bars.update(tasks[name], completed=t_s)


def _job_bars() -> Progress:
    """Return bars for counted jobs. Nothing is shown off a terminal."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    return Progress(*columns, console=console, disable=not console.is_terminal)


@contextmanager
def job_progress(name: str) -> Iterator[Callable[[int, int], None]]:
    """Show one bar for many jobs; `update(done, total)` moves it."""
    with _job_bars() as bars:
        task = bars.add_task(visible(name), total=None)
        yield lambda done, total: bars.update(task, completed=done, total=total)


@dataclass(frozen=True, slots=True)
class Stage:
    """One bar of a command that goes through several stages."""

    bars: Progress
    task: TaskID
    name: str

    def advance(self) -> None:
        """Count one job."""
        self.bars.advance(self.task)

    def best(self, cost: float) -> None:
        """Show the least cost so far beside the name."""
        self.bars.update(self.task, description=f"{self.name}, best cost {cost:.4f}")


@contextmanager
def stage_progress() -> Iterator[Callable[[str, int], Stage]]:
    """Show one bar after the other; `stage(name, jobs)` begins the next."""
    with _job_bars() as bars:

        def stage(name: str, jobs: int) -> Stage:
            return Stage(bars, bars.add_task(name, total=jobs), name)

        yield stage
