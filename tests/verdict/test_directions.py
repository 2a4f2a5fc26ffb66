"""Laws run in axes of their own: what depends on the direction of a task, and what studies do about it."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hil.config.load import load_scenario
from hil.control.laws.axes import TurnedAxes, drawn_axes_rad, in_axes
from hil.core.registries import OUTER_LAWS
from hil.core.registry import BUILT_IN
from hil.core.types import OuterCommand
from hil.runs.execute import RunSpec, execute_in_memory
from hil.study import tune
from hil.study.suite import Job, OnSuite
from hil.study.tune import CASES, OnTarget, Trial
from tests.laws.support import estimate, point

LAWS = [entry.name for entry in OUTER_LAWS.entries() if entry.origin == BUILT_IN]
NORM = ("control.gains.tuned.asg_ism.cost=norm",)
ANGLES = (0.3, 1.2, -2.5)


def way(outer, angle_rad, *overrides, seconds=3):
    """Return the true way of scenario-3 on the twin, and s, with the law's axes turned."""
    asked = [
        f"control.axes_rad={angle_rad}",
        f"duration_s={seconds}",
        "requirements=[]",
        *overrides,
    ]
    spec = RunSpec(load_scenario("scenario-3", asked), "twin", "pose", outer, "asg-ism", 3, Path())
    samples = execute_in_memory(replace(spec, rerun=False)).samples
    return np.array([samples[name] for name in ("true_x_m", "true_y_m", "s_x_m_s2", "s_y_m_s2")])


@pytest.mark.parametrize("outer", LAWS)
def test_no_law_but_the_printed_cost_knows_a_direction(outer):
    """A whole run, noise and delays included, is the same to rounding in axes turned by any angle.

    With the cost of the norm in place of the printed one that holds for all eight; s is turned back.
    """
    norm = NORM if outer == "asg-ism" else ()
    straight = way(outer, 0.0, *norm)
    for angle in ANGLES:
        turned = way(outer, angle, *norm)
        assert np.nanmax(np.abs(turned[:2] - straight[:2])) < 1e-9
        s = turned[2:] - straight[2:]
        assert np.all(np.isnan(s) | (np.abs(s) < 1e-9))


def test_the_printed_cost_knows_one():
    """Negative control: with sign(delta4) by component the robot goes millimetres beside, at every angle."""
    straight = way("asg-ism", 0.0, seconds=5)
    for angle in ANGLES:
        turned = way("asg-ism", angle, seconds=5)
        assert np.max(np.abs(turned[:2] - straight[:2])) > 2e-3


class Sees:
    """A law that keeps what it was given."""

    def reset(self, reference, here):
        """Nothing is kept."""

    def step(self, reference, here, _dt_s):
        """Return a command whose trace has vectors and a scalar."""
        self.seen = (reference, here)
        trace = {"s_x": 1.0, "s_y": 0.0, "z2_x_m_s": 0.0, "z2_y_m_s": 2.0, "eps": 3.0, "max_x": 4.0}
        return OuterCommand(0.1, 0.2, trace)


def test_what_a_law_sees_and_says_by_hand():
    """Axes turned by a right angle to the left: X is seen along -Y, and what it says along X is world Y."""
    law = Sees()
    turned = TurnedAxes(law, 0.5 * math.pi)
    here = replace(estimate(), z3_m_s2=(0.0, 5.0))
    out = turned.step(point(1.0, 0.0), here, 1 / 30)
    reference, seen = law.seen
    assert reference.z1_m == pytest.approx((0.0, -1.0))
    assert seen.pose.theta_rad == pytest.approx(here.pose.theta_rad - 0.5 * math.pi)
    assert seen.z3_m_s2 == pytest.approx((5.0, 0.0))
    assert (out.eta1_m_s, out.theta_dot_rad_s) == (0.1, 0.2)
    told = [out.trace[name] for name in ("s_x", "s_y", "z2_x_m_s", "z2_y_m_s", "eps", "max_x")]
    assert told == pytest.approx([0.0, 1.0, -2.0, 0.0, 3.0, 4.0])
    assert in_axes(law, 0.0) is law


def test_verdicts_and_searches_draw_a_direction_for_each_run():
    """Every cell and every case and seed has its own, the same for all laws and in every process."""
    drawn = [drawn_axes_rad(f"task in {k}") for k in range(200)]
    assert len(set(drawn)) == 200
    assert all(abs(sum(1 for a in drawn if low <= a < low + math.pi / 2) - 50) < 25
               for low in (-math.pi, -math.pi / 2, 0.0, math.pi / 2))  # fmt: skip
    assert drawn_axes_rad("beside in late-camera") == pytest.approx(0.0, abs=math.pi)
    assert drawn_axes_rad("a") == drawn_axes_rad("a")


def test_a_verdict_runs_its_cells_in_the_axes_drawn_for_them():
    """A cell's figures are those of the run with `control.axes_rad` at its draw, and of no other."""
    cell = "ahead in calm"
    scenario = load_scenario("ahead", ["duration_s=3", "requirements=[]"])
    figures = OnSuite({cell: scenario})(Job("asg-ism", None, cell, 3))

    def iae(angle_rad):
        asked = ["duration_s=3", "requirements=[]", f"control.axes_rad={angle_rad!r}"]
        spec = RunSpec(
            load_scenario("ahead", asked), "twin", "pose", "asg-ism", "asg-ism", 3, Path()
        )
        return execute_in_memory(replace(spec, rerun=False)).figures().values["iae_m_s"]

    assert figures["iae_m_s"] == iae(drawn_axes_rad(cell))
    assert figures["iae_m_s"] != iae(0.0)


def test_a_search_runs_its_cases_in_the_axes_drawn_for_them(monkeypatch):
    """By case and seed: what the search hands to the run has that angle."""
    seen = []

    def kept(_scenario, name):
        seen.append(name)
        raise InterruptedError

    monkeypatch.setattr(tune, "in_drawn_axes", kept)
    gains = load_scenario("scenario-1").control.active_gains
    with pytest.raises(InterruptedError):
        OnTarget("twin", "pose")(Trial("pid", gains, CASES[0], 2))
    assert seen == ["scenario-1 calm over asg-ism, seed 2"]
