"""How fast a campaign goes on all cores, and how long its page takes: time on the wall.

The start of the workers is counted.
"""

from __future__ import annotations

import math
import os
import tempfile
from pathlib import Path

from hil.analysis.speed import Figure, measure
from hil.study.campaign import many_rows
from hil.study.campaign.plan import Campaign, load_campaign
from hil.study.campaign.work import run_campaign

# About so many runs of the built-in campaign `limits`, at the ends of its axes, are what is timed.
_CAMPAIGN_RUNS = 40


def campaign_figures(runs: int) -> list[Figure]:
    """Return runs a second of a campaign on all cores, and how much of the workers' time runs take."""
    campaign = thinned(load_campaign("limits"))
    shares: list[float] = []

    def once() -> float:
        with tempfile.TemporaryDirectory() as folder:
            _, totals = run_campaign(campaign, Path(folder) / "sweep", os.cpu_count())
        shares.append(totals.efficiency or math.nan)
        return totals.runs_now / totals.wall_s

    rate = measure(f"campaign of {len(campaign.jobs())} runs", "runs/s", "", runs, once)
    values = tuple(shares[1:])  # the first call is not counted
    return [rate, Figure.of("workers' time spent on runs", "ratio", values, "")]


def report_figures(runs: int) -> list[Figure]:
    """Return how long a campaign's results and page take from few rows and from many, and their memory."""
    figures = []
    for rows in many_rows.ROWS:
        found = [many_rows.measured_apart(rows) for _ in range(runs)]
        for what, unit, goal, key in (
            ("rows put together", "s", "", "merge_s"),
            ("answers and page", "s", "", "report_s"),
            ("largest memory", "MB", "<= 1000", "peak_mb"),
        ):
            values = [one[key] for one in found]
            figures.append(Figure.of(f"campaign of {rows} rows: {what}", unit, values, goal))
    return figures


def thinned(campaign: Campaign, runs: int = _CAMPAIGN_RUNS) -> Campaign:
    """Return the campaign at the ends of its axes with its first seeds: about so many runs are left."""
    file = campaign.file
    first = {axis: [values[0], values[-1]] for axis, values in _lists(campaign).items()}
    combinations = 2 ** len(first) * len(file.outer) * len(file.inner)
    seeds = max(1, round(runs / combinations))
    return Campaign(file.model_copy(update={"grid": first, "seeds": seeds}), campaign.base)


def _lists(campaign: Campaign) -> dict[str, list[float]]:
    return {
        axis: sorted({float(point[axis]) for point in campaign.grid_points()})
        for axis in campaign.file.grid
    }
