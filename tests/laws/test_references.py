"""References: derivatives, continuity, bounds."""

import math

import pytest

from hil.config.control import CircleReference, PointReference, WaypointReference
from hil.control.references import make_reference
from hil.core.errors import BadInput

CORNERS = WaypointReference(
    points_m=((0.0, 0.0), (0.5, 0.0), (0.5, 0.4), (-0.2, 0.4)),
    speed_max_m_s=0.25,
    turn_rate_max_rad_s=1.2,
)
CASES = {
    "circle": CircleReference(radius_m=0.4, rate_rad_s=0.6, center_x_m=0.1),
    "corners": CORNERS,
    "two points": WaypointReference(points_m=((0.0, 0.0), (0.6, 0.3))),
}


@pytest.mark.parametrize("name", CASES)
def test_each_derivative_is_the_slope_of_the_one_before(name):
    """Central differences over the whole run agree with the analytic derivatives, at joints too."""
    reference = make_reference(CASES[name])
    h = 1e-4
    for tick in range(1, 400):
        t = tick * 0.0251
        before, here, after = reference.at(t - h), reference.at(t), reference.at(t + h)
        for low, high in (
            ("z1_m", "z1_dot_m_s"),
            ("z1_dot_m_s", "z1_ddot_m_s2"),
            ("z1_ddot_m_s2", "z1_dddot_m_s3"),
        ):
            for axis in (0, 1):
                slope = (getattr(after, low)[axis] - getattr(before, low)[axis]) / (2 * h)
                assert getattr(here, high)[axis] == pytest.approx(slope, abs=2e-3)


def test_circle_is_that_of_8_23():
    """At t = 0: X* = 0, Y* = 8, theta* = 0, so z1* = (d0, 8), moving along +X at 0.8 m/s."""
    state = make_reference(CircleReference()).at(0.0)
    assert state.z1_m == pytest.approx((0.03, 8.0))
    assert state.z1_dot_m_s == pytest.approx((0.8, -0.003))
    quarter = make_reference(CircleReference()).at(10 * math.pi / 2)
    assert quarter.z1_m == pytest.approx((8.0, -0.03))


def test_waypoints_are_passed_from_rest_to_rest_within_the_bounds():
    """Every waypoint lies on the path, both ends are at rest, speed and turn rate stay bounded."""
    reference = make_reference(CORNERS)
    states = [reference.at(reference.duration_s * k / 2000) for k in range(2001)]
    for x, y in CORNERS.points_m:
        nearest = min(math.hypot(s.z1_m[0] - x, s.z1_m[1] - y) for s in states)
        assert nearest < 1e-3
    for end in (states[0], states[-1], reference.at(-1.0), reference.at(1e3)):
        assert end.z1_dot_m_s == end.z1_ddot_m_s2 == pytest.approx((0.0, 0.0))
    speeds = [math.hypot(*s.z1_dot_m_s) for s in states]
    turns = [
        abs(s.z1_dot_m_s[0] * s.z1_ddot_m_s2[1] - s.z1_dot_m_s[1] * s.z1_ddot_m_s2[0]) / v**2
        for s, v in zip(states, speeds, strict=True)
        if v > 1e-3
    ]
    assert max(speeds) <= 0.25 * 1.001
    assert max(turns) <= 1.2 * 1.001
    assert max(speeds) > 0.24 or max(turns) > 1.19


def test_point_does_not_move():
    """A point has no derivatives."""
    state = make_reference(PointReference(x_m=0.2, y_m=-0.1)).at(5.0)
    assert state.z1_m == (0.2, -0.1)
    assert state.z1_dot_m_s == state.z1_ddot_m_s2 == state.z1_dddot_m_s3 == (0.0, 0.0)


def test_repeated_waypoint_is_refused():
    """Two equal neighbours have no direction between them."""
    with pytest.raises(BadInput, match=r"0\.0000 m apart"):
        make_reference(WaypointReference(points_m=((0, 0), (0.5, 0), (0.5, 0))))
