"""How fast a campaign goes on all cores, and how long its page takes: time on the wall.

The start of the workers is counted.
"""

from __future__ import annotations

import math
import os
import tempfile
import time
from pathlib import Path
from random import Random

import pyarrow as pa

from hil.analysis.speed import Figure, measure
from hil.study.campaign.findings import outcomes_of
from hil.study.campaign.maps import write_page
from hil.study.campaign.plan import Campaign, load_campaign
from hil.study.campaign.results import row_of, schema_of
from hil.study.campaign.work import run_campaign

# About so many runs of the built-in campaign `limits`, at the ends of its axes, are what is timed.
_CAMPAIGN_RUNS = 40
_REPORT_ROWS = 10_000


def campaign_figures(runs: int) -> list[Figure]:
    """Return runs a second of a campaign on all cores, and how much of the workers' time runs take."""
    campaign = _thinned(load_campaign("limits"))
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
    """Return the time of a campaign's answers and page from results of many rows."""
    campaign = load_campaign("limits")
    rng = Random(1)
    names = schema_of(campaign).names
    figures = [name for name in names if name in {"iae_m_s", "delta1_worst_last_second_m"}]
    rows = [
        row_of(job, "complete", "", True, 10.0, [(name, rng.random()) for name in figures])
        for job in campaign.jobs()[:_REPORT_ROWS]
    ]
    table = pa.Table.from_pylist(rows, schema_of(campaign))

    def once() -> float:
        start_s = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            write_page(Path(folder) / "page.html", outcomes_of(campaign, table), "hil bench report")
        return time.perf_counter() - start_s

    return [measure(f"campaign's page from {len(rows)} rows", "s", "", runs, once)]


def _thinned(campaign: Campaign) -> Campaign:
    """Return the campaign with its first seeds only, so that about _CAMPAIGN_RUNS runs are left."""
    file = campaign.file
    first = {axis: [values[0], values[-1]] for axis, values in _lists(campaign).items()}
    combinations = 2 ** len(first) * len(file.outer) * len(file.inner)
    seeds = max(1, round(_CAMPAIGN_RUNS / combinations))
    return Campaign(file.model_copy(update={"grid": first, "seeds": seeds}), campaign.base)


def _lists(campaign: Campaign) -> dict[str, list[float]]:
    return {
        axis: sorted({float(point[axis]) for point in campaign.grid_points()})
        for axis in campaign.file.grid
    }
