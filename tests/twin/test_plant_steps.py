"""The robot model's integration, and its variant whose wheels slip."""

from __future__ import annotations

import math

import pytest

from tests.twin.rigs import plant, robot, settle

G = 9.81
RADIUS = 0.0482


def smooth_end(step_s):
    """State after 0.4 s of a case without corners: soft signs, no gear loss, slow current."""
    model = plant(
        robot(
            motor_gear_efficiency_ratio=1.0, motor_inductance_h=0.1, motor_stribeck_rad_s=20.0,
            bridge_smoothing_a=5.0, floor_smoothing_m_s=0.05,
        )
    )  # fmt: skip
    return settle(model, 0.4, 0.9, seconds=0.4, step_s=step_s)


def test_integration_is_of_fourth_order():
    """Halving the step divides the error by 16, within 15 %, where the motion is smooth."""
    exact = smooth_end(1e-4)
    for name in ("x_m", "theta_rad", "current_right_a"):
        coarse = abs(smooth_end(4e-3)[name] - exact[name])
        fine = abs(smooth_end(2e-3)[name] - exact[name])
        assert coarse > 1e-11
        assert coarse / fine == pytest.approx(16.0, rel=0.15)


@pytest.mark.parametrize("variant", ["constrained", "slip"])
def test_default_step_is_small_enough_for_the_friction(variant):
    """The stiff robot at 1e-4 s ends within 0.05 mm and 0.5 mrad of the same at 1e-5 s."""
    ends = []
    for step_s in (1e-4, 1e-5):
        model = plant(robot(variant=variant))
        for left, right in ((0.6, 0.3), (-0.5, 0.5), (0.0, 0.0)):
            end = settle(model, left, right, seconds=0.5, step_s=step_s)
        ends.append(end)
    assert math.dist((ends[0]["x_m"], ends[0]["y_m"]), (ends[1]["x_m"], ends[1]["y_m"])) < 5e-5
    assert abs(ends[0]["theta_rad"] - ends[1]["theta_rad"]) < 5e-4


def test_slip_variant_spins_its_wheels_where_there_is_no_grip():
    """On ice (mu 0.02) full duty accelerates with mu g at most while the wheels run away."""
    end = settle(plant(robot(variant="slip", floor_friction_ratio=0.02)), 1.0, 1.0, seconds=0.5)
    assert end["eta1_m_s"] < 0.02 * G * 0.5 * 1.01
    assert RADIUS * end["omega_left_rad_s"] > 5 * end["eta1_m_s"]


def test_slip_variant_agrees_with_the_constrained_one_straight_on():
    """Rolling without sliding, both variants drive alike within 2 %."""
    free = settle(plant(robot(variant="slip")), 0.5, 0.5)
    bound = settle(plant(robot()), 0.5, 0.5)
    assert free["x_m"] == pytest.approx(bound["x_m"], rel=0.02)
