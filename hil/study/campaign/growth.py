"""How time and memory grow: with the length of a run, the rows of a campaign, its workers.

Runs and rows are measured in processes of their own: their processor time, and the largest memory that
they had. Workers are timed on the wall.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hil.analysis.speed import Figure
from hil.core.errors import RigFault
from hil.study.campaign import many_rows
from hil.study.campaign.long_run import LongRun
from hil.study.campaign.plan import load_campaign
from hil.study.campaign.speed import thinned
from hil.study.campaign.work import run_campaign

LENGTHS_S = (10, 100, 1_000, 3_600, 10_000, 36_000)
_RUNS = (64, 256, 1024)  # of ten seconds: the last is long beside the start of the workers


@dataclass(frozen=True, slots=True)
class Series:
    """One quantity over another: both in their units, and what it grows by where that was fitted."""

    what: str
    over: str
    unit: str
    x: tuple[float, ...]
    y: tuple[float, ...]

    @property
    def line(self) -> tuple[float, float]:
        """Growth of y a unit of x and y at 0, of the straight line through all by least squares.

        NaN of one point.
        """
        if len(self.x) < 2:
            return float("nan"), float("nan")
        slope, begin = np.polyfit(self.x, self.y, 1).tolist()
        return slope, begin

    @property
    def slope(self) -> float:
        """Growth of y a unit of x; NaN of one point."""
        return self.line[0]

    def figures(self) -> list[Figure]:
        """Return the points and the slope as the bench prints them."""
        points = [
            Figure.of(f"{self.what}, {x:g} {self.over}", self.unit, [y], "")
            for x, y in zip(self.x, self.y, strict=True)
        ]
        if len(self.x) < 2:
            return points
        slope, begin = self.line
        return [
            *points,
            Figure.of(f"{self.what}: growth", f"{self.unit} per {self.over}", [slope], ""),
            Figure.of(f"{self.what}: at 0", self.unit, [begin], ""),
        ]


def measured(longest_s: int, most_rows: int, say: Callable[[str], None]) -> list[Series]:
    """Return every series up to runs of `longest_s` and `most_rows` rows; `say` is told what is begun."""
    return [
        *_of_lengths([s for s in LENGTHS_S if s <= longest_s], say),
        *_of_rows([n for n in many_rows.ROWS if n <= most_rows], say),
        *_of_workers(say),
    ]


def _of_lengths(lengths_s: list[int], say: Callable[[str], None]) -> list[Series]:
    found = []
    for length_s in lengths_s:
        say(f"run of {length_s} s")
        found.append(recorded_run(length_s))
    x = tuple(float(length_s) for length_s in lengths_s)
    into_s, memory_mb = zip(*found[-1].course, strict=True)
    what = f"in the course of a run of {lengths_s[-1]} s, memory"
    return [
        Series("recorded run, processor time", "s of run", "s", x, tuple(r.cpu_s for r in found)),
        Series("recorded run, largest memory", "s of run", "MB", x,
               tuple(r.peak_mb for r in found)),
        Series("recorded run, disk", "s of run", "MB", x, tuple(r.disk_mb for r in found)),
        Series(what, "s of run", "MB", into_s, memory_mb),
    ]  # fmt: skip


def recorded_run(length_s: int) -> LongRun:
    """Return what a recorded run on the circle took, in a process of its own; raises RigFault."""
    command = [sys.executable, "-m", "hil.study.campaign.long_run", str(length_s)]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode:
        raise RigFault(
            f"run of {length_s} s: ended with status {done.returncode}: {done.stderr[-300:]}"
        )
    found: dict[str, Any] = json.loads(done.stdout)
    return LongRun(**found)


def _of_rows(rows: list[int], say: Callable[[str], None]) -> list[Series]:
    found = []
    for count in rows:
        say(f"{count} rows")
        found.append(many_rows.measured_apart(count))
    x = tuple(one["rows"] for one in found)
    return [
        Series(what, "rows", unit, x, tuple(one[key] for one in found))
        for what, unit, key in (
            ("campaign's rows put together", "s", "merge_s"),
            ("campaign's answers and page", "s", "report_s"),
            ("campaign's results, largest memory", "MB", "peak_mb"),
        )
    ]


def _of_workers(say: Callable[[str], None]) -> list[Series]:
    cores = os.cpu_count() or 1
    counts = [n for n in (1, 2, 4, 8, 16, 32) if n <= cores]
    found = [_of_runs(say)]
    say("workers")
    rates = [_rate(_RUNS[-1], workers=n) for n in counts]
    found.append(Series("campaign", "workers", "runs/s", tuple(map(float, counts)), tuple(rates)))
    if importlib.util.find_spec("distributed") is None:
        return found
    say("Dask workers")
    rates = []
    for n in counts:
        with _cluster(n) as address:
            rates.append(_rate(_RUNS[-1], dask=address))
    found.append(
        Series("campaign", "Dask workers", "runs/s", tuple(map(float, counts)), tuple(rates))
    )
    return found


def _of_runs(say: Callable[[str], None]) -> Series:
    """Return how long campaigns of more and more runs take one worker."""
    say("campaigns of one worker")
    times_s = tuple(count / _rate(count, workers=1) for count in _RUNS)
    return Series("campaign of one worker", "runs", "s", tuple(map(float, _RUNS)), times_s)


def _rate(runs: int, workers: int | None = None, dask: str | None = None) -> float:
    """Return runs a second of a campaign of about so many runs, start of the workers included."""
    campaign = thinned(load_campaign("limits"), runs)
    with tempfile.TemporaryDirectory() as folder:
        start_s = time.perf_counter()
        _, totals = run_campaign(campaign, Path(folder) / "sweep", workers, dask)
        return totals.runs_now / (time.perf_counter() - start_s)


@contextmanager
def _cluster(workers: int) -> Iterator[str]:
    dask: Any = importlib.import_module("distributed")
    with dask.LocalCluster(
        n_workers=workers, threads_per_worker=1, dashboard_address=None, silence_logs=50
    ) as cluster:
        yield cluster.scheduler_address


_PANELS = {"s of run": 0, "rows": 1, "runs": 2, "workers": 3, "Dask workers": 3}


def write_plot(path: Path, found: list[Series]) -> None:
    """Draw every series over what it grows with, as SVG: points, and the straight line fitted to them."""
    import matplotlib as mpl  # noqa: PLC0415 - only to draw
    from matplotlib.backends.backend_svg import FigureCanvasSVG  # noqa: PLC0415
    from matplotlib.figure import Figure as Sheet  # noqa: PLC0415

    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "growth", "font.size": 8}):
        sheet = Sheet(figsize=(11, 7), layout="constrained")
        FigureCanvasSVG(sheet)
        panels = sheet.subplots(2, 2).ravel()
        for series in found:
            axes = panels[_PANELS[series.over]]
            colour = f"C{len(axes.collections)}"
            axes.scatter(series.x, series.y, s=9, color=colour, label=_label(series))
            if len(series.x) > 1:
                slope, begin = series.line
                ends = np.array([0.0, max(series.x)])
                axes.plot(ends, begin + slope * ends, "-", lw=0.8, color=colour)
        for axes, title in zip(panels, ("s of run", "rows", "runs", "workers"), strict=True):
            axes.set_xlim(left=0.0)
            axes.set_ylim(bottom=0.0)
            axes.set_xlabel(title)
            axes.grid(visible=True, which="major", lw=0.4)
            axes.legend(fontsize=7)
        sheet.savefig(path, format="svg", metadata={"Date": None})


def _label(series: Series) -> str:
    """Return what a legend says: what it is, and its line's constants."""
    name = f"{series.what}, {series.unit}"
    if series.over == "Dask workers":
        name += f" over {series.over}"
    if len(series.x) < 2:
        return name
    slope, begin = series.line
    sign = "+" if slope >= 0.0 else "-"
    return f"{name}: {begin:.3g} {sign} {abs(slope):.3g} {_letter(series.over)}"


def _letter(over: str) -> str:
    """Return the letter that a line's formula has for what it grows with."""
    return {"s of run": "t", "rows": "n", "runs": "n"}.get(over, "w")
