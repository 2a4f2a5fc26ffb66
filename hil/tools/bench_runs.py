"""How many runs a core makes: built-in laws, an own law in Python, a campaign, a campaign's report.

`batch` and `law` count the processor time of one core, so that others on the machine disturb them
least; `campaign` and `report` count the time on the wall, workers and their start included.
"""

from __future__ import annotations

import math
import os
import tempfile
import time
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING

from hil.config.link import UART_BAUD
from hil.config.load import load_scenario
from hil.core.registries import OUTER_LAWS
from hil.rigs.opening import open_rig
from hil.runs.execute import RunSpec, execute_in_memory
from hil.study.campaign.findings import outcomes_of
from hil.study.campaign.maps import write_page
from hil.study.campaign.plan import Campaign, load_campaign
from hil.study.campaign.results import row_of, schema_of
from hil.study.campaign.work import run_campaign
from hil.tools.bench import Figure, Plan, measure
from sim_twin.setup import STEP_US, make_kernel

if TYPE_CHECKING:
    from hil.config.scenario import Scenario

_X = "x real time"
_STEPS = 20_000
# Of the built-in campaign `limits`: so many runs, evenly over its conditions, are what is timed.
_CAMPAIGN_RUNS = 40
_REPORT_ROWS = 10_000
_DRIVING = (0.5, 0.3)  # duties of the plant alone


def batch_figures(runs: int) -> list[Figure]:
    """Return what one core does along each path that a run can take, and the plant alone."""
    standing = load_scenario("scenario-1", ["duration_s=10"])
    driving = load_scenario("circle", ["duration_s=10"])
    plans: list[Plan] = []
    for what, scenario, camera in (
        ("pose camera, 10 s to a point", standing, "pose"),
        ("pose camera, 10 s on a circle", driving, "pose"),
        ("rendered camera, 10 s to a point", standing, "rendered"),
    ):
        plans += [
            (what, _X, "", _times_real_time(scenario, camera, "asg-ism")),
            (what, "runs/s", "", _runs_a_second(scenario, camera, "asg-ism")),
        ]
    plans += [
        ("plant, board and encoders alone, standing", _X, "", lambda: 1e6 / kernel_us_a_s(False)),
        ("plant, board and encoders alone, driven by a load", _X, "",
         lambda: 1e6 / kernel_us_a_s(True)),
        ("plant alone, driving", _X, "", lambda: 100.0 / plant_step_us()),
    ]  # fmt: skip
    return [measure(name, unit, goal, runs, once) for name, unit, goal, once in plans]


def law_figures(runs: int) -> list[Figure]:
    """Return what an own law in Python reaches (the file that `hil new law` writes), and built-in ones."""
    scenario = load_scenario("circle", ["duration_s=10"])
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bench_law.py"
        text = (files("hil") / "data" / "templates" / "law.py").read_text(encoding="utf-8")
        file.write_text(text.replace("my-thing", "bench-law"), encoding="utf-8")
        own = OUTER_LAWS.get(str(file)).name
        plans: list[Plan] = [
            (f"whole loop with {what}", _X, "", _times_real_time(scenario, "pose", law))
            for what, law in (("an own law in Python", own), ("asg-ism", "asg-ism"), ("pid", "pid"))
        ]
        return [measure(name, unit, goal, runs, once) for name, unit, goal, once in plans]


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
    import pyarrow as pa  # noqa: PLC0415 - for this figure only

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


def _simulated(scenario: Scenario, camera: str, outer: str) -> float:
    """Make one run in memory, as a campaign does, and return the time that passed on its rig, s."""
    spec = RunSpec(scenario, "twin", camera, outer, "asg-ism", 1, Path(), rerun=False)
    rig = open_rig("twin", scenario, camera, spec.seed)
    begin_s = rig.now_s()
    record = execute_in_memory(spec, rig)
    record.verdicts()
    return rig.now_s() - begin_s


def _times_real_time(scenario: Scenario, camera: str, outer: str) -> Callable[[], float]:
    def once() -> float:
        start_s = time.process_time()
        simulated_s = _simulated(scenario, camera, outer)
        return simulated_s / (time.process_time() - start_s)

    return once


def _runs_a_second(scenario: Scenario, camera: str, outer: str) -> Callable[[], float]:
    def once() -> float:
        start_s = time.process_time()
        _simulated(scenario, camera, outer)
        return 1.0 / (time.process_time() - start_s)

    return once


def kernel_us_a_s(moved: bool) -> float:
    """Return microseconds of processor time per simulated second of plant, firmware core and encoders.

    `moved`: a load turns the wheels all the time; else the robot stands.
    """
    from hil.config.events import Disturbance  # noqa: PLC0415 - for this figure only

    pushes = [Disturbance(target="force_forward_n", shape="step", amplitude=8.0)] if moved else []
    kernel = make_kernel(load_scenario("scenario-1").robot, UART_BAUD, Random(1), pushes)
    kernel.begin(0)
    end_us = _STEPS * STEP_US
    start_s = time.process_time()
    while kernel.advance(end_us) < end_us:
        kernel.take_sent()
    return (time.process_time() - start_s) / (end_us * 1e-6) * 1e6


def plant_step_us() -> float:
    """Return microseconds of processor time of one 1e-4 s step of the robot alone, driving."""
    from sim_twin import _native  # noqa: PLC0415 - for this figure only
    from sim_twin.setup import plant_params  # noqa: PLC0415

    plant = _native.Plant(plant_params(load_scenario("scenario-1").robot))
    start_s = time.process_time()
    plant.run(_STEPS, 1e-6 * STEP_US, *_DRIVING, None)
    return (time.process_time() - start_s) / _STEPS * 1e6
