"""References: derivatives, continuity, bounds."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hil.config.control import CircleReference, PointReference, WaypointReference
from hil.control.references import make_reference, unfinished
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


@pytest.mark.parametrize("length_m", [0.01, 0.1, 0.25, 0.3, 0.5, 0.7, 1.0, 1.3, 20.0])
def test_two_waypoints_are_the_line_between_them(length_m):
    """Straight, at its half after half the time, in 35/16 of length/speed (septic smooth step)."""
    for angle in (0.0, 0.7, 2.0, -2.5):
        end = (0.2 + length_m * math.cos(angle), -0.1 + length_m * math.sin(angle))
        config = WaypointReference(points_m=((0.2, -0.1), end), speed_max_m_s=0.3)
        reference = make_reference(config)
        assert reference.duration_s == pytest.approx(2.1875 * length_m / 0.3)
        for share in (0.0, 0.2, 0.5, 0.9, 1.0):
            x, y = reference.at(share * reference.duration_s).z1_m
            off = (x - 0.2) * math.sin(angle) - (y + 0.1) * math.cos(angle)
            assert abs(off) < 1e-12 * max(1.0, length_m)
        middle = reference.at(0.5 * reference.duration_s).z1_m
        assert middle == pytest.approx((0.5 * (0.2 + end[0]), 0.5 * (end[1] - 0.1)))


STEP_M = st.tuples(
    st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.sampled_from([0.01, 0.1, 1.0, 1.0, 3.0])
)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(steps=st.lists(STEP_M, min_size=1, max_size=11))
def test_any_waypoints_give_a_bounded_path_through_them(steps):
    """2 to 12 points, chords from 1 mm to 4 m: ends at rest, bounds kept, no wide loops."""
    points = np.cumsum([(0.3, -0.2), *((size * dx, size * dy) for dx, dy, size in steps)], axis=0)
    chords = np.hypot(*np.diff(points, axis=0).T)
    assume(chords.min() >= 1.5e-3)
    config = WaypointReference(
        points_m=tuple(map(tuple, points.tolist())), speed_max_m_s=0.3, turn_rate_max_rad_s=1.5
    )
    reference = make_reference(config)
    duration_s = reference.duration_s
    assert math.isfinite(duration_s)
    assert duration_s >= math.dist(points[0], points[-1]) / 0.3
    assert reference.at(0.0).z1_m == pytest.approx(tuple(points[0]), abs=1e-6)
    assert reference.at(duration_s).z1_m == pytest.approx(tuple(points[-1]), abs=1e-6)
    states = [reference.at(duration_s * k / 600) for k in range(601)]
    path = np.array([state.z1_m for state in states])
    velocity = np.array([state.z1_dot_m_s for state in states])
    bend = np.array([state.z1_ddot_m_s2 for state in states])
    speed = np.hypot(*velocity.T)
    assert speed.max() <= 0.3 * (1 + 1e-3)
    moving = speed > 1e-4
    cross = np.abs(velocity[:, 0] * bend[:, 1] - velocity[:, 1] * bend[:, 0])[moving]
    assert (cross / speed[moving] ** 2).max(initial=0.0) <= 1.5 * (1 + 1e-2)
    assert far_from_lines_m(path, points) <= chords.max() * (1 + 1e-3)


def far_from_lines_m(path, points):
    """Return the largest distance of the path from the straight lines through the points."""
    nearest = np.full(len(path), np.inf)
    for a, b in pairwise(points):
        along = b - a
        share = np.clip((path - a) @ along / (along @ along), 0.0, 1.0)
        nearest = np.minimum(nearest, np.hypot(*(path - a - share[:, None] * along).T))
    return nearest.max()


def test_unevenly_spread_waypoints_are_passed_too():
    """Chords of 1 m and 2 mm: through every point to 0.1 mm, and no loop of a metre."""
    points = ((0, 0), (1, 0), (1, 0.002), (1, 0.004), (0, 0.5), (-0.002, 0.5), (-1, 1))
    reference = make_reference(WaypointReference(points_m=points))
    path = np.array([reference.at(reference.duration_s * k / 40_000).z1_m for k in range(40_001)])
    for point in points:
        assert np.hypot(*(path - point).T).min() < 1e-4
    assert far_from_lines_m(path, np.array(points, float)) < 0.5


def test_a_run_that_ends_before_its_path_is_told():
    """A hairpin takes many minutes: the sentence has its time, the run's, and what is done of it."""
    hairpin = WaypointReference(points_m=((-0.6, -0.35), (0.3, -0.35), (-0.5, -0.34)))
    said = unfinished(hairpin, 20.0)
    assert "the run ends after 20 s" in said
    assert make_reference(hairpin).duration_s > 500.0
    line = WaypointReference(points_m=((0.0, 0.0), (0.3, 0.0)))
    assert "with 99.9 % of it done" in str(unfinished(line, 2.18))  # not 1e+02, and not all of it
    assert unfinished(line, 2.19) is None
    assert unfinished(PointReference(), 0.1) is None
