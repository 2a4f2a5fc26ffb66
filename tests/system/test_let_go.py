"""A robot that stands is not pressed against its floor until the board calls it a stall."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hil.config.load import load_scenario
from hil.control.laws.let_go import LetGo
from hil.control.vehicles.vehicle import make_vehicle
from hil.core.types import OuterCommand
from hil.runs._native import driven_hard
from hil.runs.execute import RunSpec, execute_in_memory
from tests.laws.support import estimate, point
from tests.system.test_turn_first import Same

TICK_S = 1.0 / 30.0
NEVER = "control.limits.let_go_rad_s=0.0001"
# What `hil falsify ahead --outer asg-ism` had found: a run that ended in a stall, 8 mm off its point.
FOUND = (
    "start.theta_rad=0.33", "mismatch.mass_kg=1.18", "mismatch.inertia_kg_m2=1.3",
    "mismatch.wheel_radius_m=1.19", "camera.latency_s=0.075",
)  # fmt: skip
VEHICLE = make_vehicle(load_scenario("scenario-1").robot)
SLOW = (0.01, 0.1)  # 0.2 +- 0.26 rad/s of the wheels


def commands(command, here, ticks, least_rad_s=0.5):
    """Return what is left of the same command in so many ticks."""
    law = LetGo(Same(*command), VEHICLE, least_rad_s)
    law.reset(point(1, 0), here)
    found = [law.step(point(1, 0), here, TICK_S) for _ in range(ticks)]
    return [(out.eta1_m_s, out.theta_dot_rad_s) for out in found]


def test_slow_commands_give_way_while_a_side_is_driven_hard():
    """From the third tick on: a wheel that breaks loose is driven hard for less than a tenth of a second."""
    pressed = replace(estimate(), driven_hard=True)
    assert commands(SLOW, pressed, 5) == [SLOW, SLOW, (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)]


@pytest.mark.parametrize(
    ("command", "hard", "least"), [(SLOW, False, 0.5), ((0.1, 0.5), True, 0.5), (SLOW, True, None)]
)
def test_other_commands_pass(command, hard, least):
    """Negative control: no side driven hard, or more asked than a crawl, or switched off."""
    here = replace(estimate(), driven_hard=hard)
    assert commands(command, here, 5, least) == [command] * 5


def test_pressing_is_counted_anew_when_it_ends():
    """Two ticks, one without, two ticks: the command stays."""
    law = LetGo(Same(*SLOW), VEHICLE, 0.5)
    law.reset(point(1, 0), estimate())
    for hard in (True, True, False, True, True):
        out = law.step(point(1, 0), replace(estimate(), driven_hard=hard), TICK_S)
        assert out == OuterCommand(*SLOW, {"saturated": 0.0})


def test_driven_hard_is_what_the_board_calls_a_stall_of_a_wheel_that_stands():
    """STALL_DUTY 0.5 of 400 counts, either way, either side; never where no duty is one."""
    assert driven_hard(0.0, -200.0, 200.0)
    assert driven_hard(230.0, 0.0, 200.0)
    assert not driven_hard(199.0, -199.0, 200.0)
    assert not driven_hard(400.0, 400.0, 0.0)


def run(scenario, outer, seed, *overrides):
    """Return the record of a run on the twin."""
    spec = RunSpec(
        load_scenario(scenario, overrides), "twin", "pose", outer, "asg-ism", seed, Path()
    )
    return execute_in_memory(replace(spec, rerun=False))


def pressed_s(record):
    """Return for how long a side was driven with half its duty while no wheel was asked for 0.5 rad/s."""
    rows = record.samples
    asked = [np.abs(rows[f"omega_cmd_{side}_rad_s"]) for side in ("left", "right")]
    pwm = [np.abs(rows[f"pwm_{side}_counts"]) for side in ("left", "right")]
    return TICK_S * int(np.sum((np.maximum(*pwm) >= 200.0) & (np.maximum(*asked) <= 0.5)))


def test_what_was_found_to_break_it_holds():
    """The counterexample in `ahead` ends within 10 mm, and presses for a fraction of the time without it."""
    with_it, without = (run("ahead", "asg-ism", 2, *FOUND, *more) for more in ((), (NEVER,)))
    assert with_it.manifest.outcome == "complete"
    assert with_it.figures().values["delta1_worst_last_second_m"] < 0.01
    assert pressed_s(without) > 0.3
    assert pressed_s(with_it) < 0.5 * pressed_s(without)


@pytest.mark.parametrize("outer", ["asg-ism", "pid"])
def test_an_encoder_that_dies_on_the_way_still_stops_the_robot(outer):
    """STALL by name: wheels are asked for more than a crawl there."""
    dead = 'faults=[{kind="dead_encoder",side="left",start_s=2.0}]'
    assert "STALL_LEFT" in run("scenario-1", outer, 3, dead).manifest.outcome_detail
