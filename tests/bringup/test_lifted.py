"""The twin on blocks."""

from __future__ import annotations

import pytest

from tests.bringup.test_procedure import TOP_SPEED_RAD_S
from tests.twin.rigs import plant, robot, settle


def test_wheels_turn_and_the_body_stands():
    """Full duty left only: that side at its free speed, nothing else moves."""
    end = settle(plant(robot(variant="lifted")), 1.0, 0.0, seconds=2.0)
    # One side alone draws half the current: 0.12 ohm x 0.288 A more at the terminals.
    assert end["omega_left_rad_s"] == pytest.approx(TOP_SPEED_RAD_S + 0.0346 / 0.36, abs=0.02)
    assert end["omega_right_rad_s"] == 0.0
    still = ("x_m", "y_m", "theta_rad", "eta1_m_s", "eta2_m_s", "theta_dot_rad_s")
    assert all(end[name] == 0.0 for name in still)
