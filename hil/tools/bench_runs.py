"""How many runs a core makes: along each path, with built-in laws and with an own one in Python.

Processor time of one core is counted, so that others on the machine disturb the figures least.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from functools import partial
from importlib.resources import files
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any, cast

from hil.analysis.speed import Figure, Plan, measure
from hil.config.link import UART_BAUD
from hil.config.load import load_scenario
from hil.control.laws.making import make_law
from hil.core.batch import SIDE_BY_SIDE
from hil.core.registries import OUTER_LAWS
from hil.rigs.opening import open_rig
from hil.runs.execute import InMemory, RunSpec, execute_in_memory
from hil.runs.together import run_together
from hil.tools.bench_plants import plant_figures
from sim_twin.setup import STEP_US, make_kernel

if TYPE_CHECKING:
    from hil.config.scenario import Scenario
    from hil.core.rig import Rig
    from hil.core.types import OuterLaw

_X = "x real time"
_LARGE = ("camera.width_px=1280", "camera.height_px=720")
_STEPS = 20_000
_DRIVING = (0.5, 0.3)  # duties of the plant alone


# Ways in which a run may advance (hil/runs/driving.py, hil/runs/intake.py): all of it in native code, a
# law in Python that native code asks each tick, all ticks and arrivals in Python; or several side by side
# (hil/runs/together.py), all of them in native code.
NATIVE, ASKED, PYTHON, TOGETHER = range(4)


def batch_figures(runs: int) -> list[Figure]:
    """Return what one core does along each path of a run, and the plant alone beside its peers."""
    standing = load_scenario("scenario-1", ["duration_s=10"])
    driving = load_scenario("circle", ["duration_s=10"])
    large = load_scenario("scenario-1", [*_LARGE, "duration_s=20"])
    plans: list[Plan] = []
    for what, scenario, camera, way in (
        (f"{SIDE_BY_SIDE} side by side, 10 s to a point", standing, "pose", TOGETHER),
        ("pose camera, 10 s to a point", standing, "pose", NATIVE),
        ("the same, its law in Python", standing, "pose", ASKED),
        ("the same, taken in by Python", standing, "pose", PYTHON),
        (f"{SIDE_BY_SIDE} side by side, 10 s on a circle", driving, "pose", TOGETHER),
        ("pose camera, 10 s on a circle", driving, "pose", NATIVE),
        ("the circle, its law in Python", driving, "pose", ASKED),
        ("the circle, taken in by Python", driving, "pose", PYTHON),
        ("rendered camera, 10 s to a point", standing, "rendered", NATIVE),
        ("rendered camera 1280 x 720, 20 s to a point", large, "rendered", NATIVE),
        ("the same 1280 x 720, taken in by Python", large, "rendered", PYTHON),
    ):
        plans += [
            (what, _X, "", _times_real_time(scenario, camera, "asg-ism", way)),
            (what, "runs/s", "", _runs_a_second(scenario, camera, "asg-ism", way)),
        ]
    plans += [
        ("plant, board and encoders alone, standing", _X, "", lambda: 1e6 / kernel_us_a_s(False)),
        ("plant, board and encoders alone, driven by a load", _X, "",
         lambda: 1e6 / kernel_us_a_s(True)),
        ("plant alone, driving", _X, "", lambda: 100.0 / plant_step_us()),
    ]  # fmt: skip
    measured = [measure(name, unit, goal, runs, once) for name, unit, goal, once in plans]
    return [*measured, *plant_figures(runs)]


def law_figures(runs: int) -> list[Figure]:
    """Return what an own law in Python reaches (the file that `hil new law` writes), and built-in ones."""
    scenario = load_scenario("circle", ["duration_s=10"])
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bench_law.py"
        text = (files("hil") / "data" / "templates" / "law.py").read_text(encoding="utf-8")
        file.write_text(text.replace("my-thing", "bench-law"), encoding="utf-8")
        own = OUTER_LAWS.get(str(file)).name
        plans: list[Plan] = [
            (f"whole loop with {what}", _X, "", _times_real_time(scenario, "pose", law, way))
            for what, law, way in (
                ("an own law in Python", own, NATIVE),
                (f"an own law that steps {SIDE_BY_SIDE} runs at once", own, TOGETHER),
                ("asg-ism", "asg-ism", NATIVE),
                (f"asg-ism, {SIDE_BY_SIDE} side by side", "asg-ism", TOGETHER),
                ("pid", "pid", NATIVE),
            )
        ]
        return [measure(name, unit, goal, runs, once) for name, unit, goal, once in plans]


class _ByPython:
    """A rig that native code of the host does not drive: what arrives is taken in by Python."""

    native = None

    def __init__(self, rig: Rig) -> None:
        self._rig = rig

    def __getattr__(self, name: str) -> Any:
        """Return what the rig has."""
        return getattr(self._rig, name)


class _OwnLaw:
    """A law that native code does not know."""

    def __init__(self, law: OuterLaw) -> None:
        self.reset = law.reset
        self.step = law.step


def _simulated(scenario: Scenario, camera: str, outer: str, way: int) -> tuple[float, int]:
    """Make runs in memory, as a campaign does: the time that passed on their rigs in s, and how many."""
    count = SIDE_BY_SIDE if way == TOGETHER else 1
    specs = [
        RunSpec(scenario, "twin", camera, outer, "asg-ism", seed + 1, Path(), rerun=False)
        for seed in range(count)
    ]
    rigs = [open_rig("twin", scenario, camera, spec.seed) for spec in specs]
    if way == PYTHON:
        rigs = [cast("Rig", _ByPython(rig)) for rig in rigs]
    begin_s = sum(rig.now_s() for rig in rigs)
    law = _OwnLaw(make_law(outer, scenario)) if way in {ASKED, PYTHON} else None
    makers = [partial(InMemory, spec, rig, law) for spec, rig in zip(specs, rigs, strict=True)]
    records = (
        run_together(makers) if way == TOGETHER else [execute_in_memory(specs[0], rigs[0], law)]
    )
    for record in records:
        if isinstance(record, BaseException):
            raise record
        record.verdicts()
    return sum(rig.now_s() for rig in rigs) - begin_s, count


def _times_real_time(
    scenario: Scenario, camera: str, outer: str, way: int = NATIVE
) -> Callable[[], float]:
    def once() -> float:
        start_s = time.process_time()
        simulated_s, _ = _simulated(scenario, camera, outer, way)
        return simulated_s / (time.process_time() - start_s)

    return once


def _runs_a_second(scenario: Scenario, camera: str, outer: str, way: int) -> Callable[[], float]:
    def once() -> float:
        start_s = time.process_time()
        _, count = _simulated(scenario, camera, outer, way)
        return count / (time.process_time() - start_s)

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
