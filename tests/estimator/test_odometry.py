"""Geometry, counters, command history and the wheel-loop model."""

import math

import pytest

from hil.control.estimators._fused import CommandHistory, Geometry, WheelSpeeds, counts_between
from hil.control.estimators.geometry import BelievedGeometry

ROBOT = BelievedGeometry(0.05, 0.2, 0.03, 1920)


def make_speeds():
    return WheelSpeeds(0.06, 6.0, 0.5, ROBOT.rad_per_count)


def test_signs_and_units_of_the_wheel_map():
    """v_right - v_left = W theta_dot: 0.1 m/s and 1 rad/s are 0 and 0.2 m/s of rim, 0 and 4 rad/s."""
    assert ROBOT.wheels(0.1, 1.0) == pytest.approx((0.0, 4.0))
    assert ROBOT.body(0.0, 4.0) == pytest.approx((0.1, 1.0))
    assert ROBOT.rad_per_count == pytest.approx(2 * math.pi / 1920)


@pytest.mark.parametrize("wheels", [(0.0, 4.0), (-1.3, 0.7), (1e-9, -3e5)])
def test_host_and_estimator_believe_the_same_geometry(wheels):
    """The map to the body is written in Python and in C++: both give the same bits."""
    native = Geometry(
        ROBOT.wheel_radius_m, ROBOT.track_width_m, ROBOT.d0_m, rad_per_count=ROBOT.rad_per_count
    )
    assert native.body(*wheels) == ROBOT.body(*wheels)


@pytest.mark.parametrize(
    ("old", "new", "difference"),
    [(5, 3, -2), (0x7FFFFFFF, -0x80000000, 1), (-0x80000000, 0x7FFFFFFF, -1), (-3, 4, 7)],
)
def test_counter_differences_pass_the_wrap(old, new, difference):
    """A signed 32-bit counter wraps from its greatest to its least value."""
    assert counts_between(old, new) == difference


def test_command_history_gives_constant_pieces():
    """Between 0.05 and 0.30 s: rest, then the first command, then the one that replaced another."""
    history = CommandHistory()
    history.add(0.10, 1.0, 2.0)
    history.add(0.20, 9.0, 9.0)
    history.add(0.15, 3.0, 4.0)  # takes effect earlier: the one at 0.20 never will
    pieces = history.segments(0.05, 0.30)
    assert [p[1:] for p in pieces] == [(0.0, 0.0), (1.0, 2.0), (3.0, 4.0)]
    assert [p[0] for p in pieces] == pytest.approx([0.05, 0.05, 0.15])
    history.forget_before(0.25)
    assert history.segments(0.25, 0.30) == [pytest.approx((0.05, 3.0, 4.0))]


def test_lag_model_after_a_step_command():
    """From rest, after one time constant: speed (1 - 1/e) goal, angle goal tau / e."""
    turned, _, speed, _ = make_speeds().ahead([(0.06, 10.0, 0.0)])
    assert speed == pytest.approx(10 * (1 - math.exp(-1)))
    assert turned == pytest.approx(10 * 0.06 * math.exp(-1))


def test_speed_from_counts_settles_below_the_quantisation():
    """At 3.21 rad/s a difference over 20 ms is quantised to 0.16 rad/s; the filter to half."""
    speeds = make_speeds()
    counts, errors = 0, []
    for k in range(1, 200):
        new = math.floor(3.21 * 0.02 * k / ROBOT.rad_per_count)
        turned = (new - counts) * ROBOT.rad_per_count
        counts = new
        speeds.step(0.02, (turned, turned), [(0.02, 3.21, 3.21)])
        errors.append(speeds.omega_rad_s[0] - 3.21)
    late = errors[50:]
    assert math.sqrt(sum(e * e for e in late) / len(late)) < 0.1


def test_speed_follows_a_wheel_that_does_not_obey():
    """Commanded 5 rad/s but blocked: within a second speed and prediction say at rest, not 5."""
    speeds = make_speeds()
    for _ in range(50):
        speeds.step(0.02, (0.0, 0.0), [(0.02, 5.0, 5.0)])
    assert abs(speeds.omega_rad_s[0]) < 0.01
    assert abs(speeds.ahead([(0.06, 5.0, 5.0)])[2]) < 0.01
