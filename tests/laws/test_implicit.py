"""The implicit sliding term: its closed form, its fixed point, and what a disturbance leaves of s."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.config.control import CircleReference
from hil.config.gains import make_gains
from hil.control.laws.making import make_outer_law
from hil.control.laws.stages import projected
from hil.control.laws.super_twisting import twisted
from hil.study.ideal_circle import (
    CIRCLE_GAINS,
    CIRCLE_LIMITS,
    CIRCLE_START,
    NO_DISTURBANCE,
    Disturbances,
    run_ideal,
)

ALPHA, H_S = 4.0, 1.0 / 30.0
PLANE = st.tuples(st.floats(-5, 5), st.floats(-5, 5))
CIRCLE = CircleReference()


def implicit_step(s, d=(0.0, 0.0)):
    """Return s at the end of a tick under the disturbance d, and the sliding term of the tick."""
    inside = projected(s, ALPHA * H_S)
    u = (-inside[0] / H_S, -inside[1] / H_S)
    return (s[0] + H_S * (u[0] + d[0]), s[1] + H_S * (u[1] + d[1])), u


@settings(max_examples=60, deadline=None)
@given(s=PLANE)
def test_the_term_solves_the_inclusion(s):
    """The term -P(s)/h is in -alpha Sgn(s + h u): a unit vector, or at 0 the ball."""
    after, u = implicit_step(s)
    length = math.hypot(*after)
    assert math.hypot(*u) <= ALPHA * (1 + 1e-12)
    if length > 1e-9:
        for i in range(2):
            assert u[i] == pytest.approx(-ALPHA * after[i] / length, abs=1e-6 * ALPHA / length)


def test_zero_is_the_fixed_point_and_is_reached_in_so_many_ticks():
    """From ||s|| = 1 with alpha h = 4/30 the surface is reached in 8 = ceil(7.5) ticks and kept."""
    s, ticks = (0.6, -0.8), 0
    while math.hypot(*s) > 1e-12:
        s, ticks = implicit_step(s)[0], ticks + 1
    assert ticks == 8
    assert implicit_step((0.0, 0.0)) == ((0.0, 0.0), (-0.0, -0.0))


@settings(max_examples=40, deadline=None)
@given(phase=st.floats(0, 6), size=st.floats(0.1, 3.9))
def test_on_the_surface_the_term_is_minus_the_disturbance_of_the_tick_before(phase, size):
    """||s|| <= h |d| for |d| < alpha, with no layer and no chatter: u follows -d one tick late."""
    s, before = (0.0, 0.0), (0.0, 0.0)
    for tick in range(60):
        d = (size * math.cos(phase + 0.2 * tick), size * math.sin(phase + 0.2 * tick))
        s, u = implicit_step(s, d)
        assert math.hypot(*s) <= H_S * size * (1 + 1e-9)
        assert math.dist(u, (-before[0], -before[1])) < 1e-9
        before = d


def test_explicit_signs_chatter_where_the_implicit_term_is_at_rest():
    """Negative control: s - h alpha s/||s|| swings by h alpha about 0 for ever, with nothing disturbing."""
    s = (0.05, 0.0)
    turns = 0
    for _ in range(40):
        length = math.hypot(*s)
        after = tuple(x - H_S * ALPHA * x / length for x in s)
        turns, s = turns + (after[0] * s[0] < 0.0), after
    assert turns > 30
    s = (0.05, 0.0)
    for _ in range(40):
        s = implicit_step(s)[0]
    assert s == (0.0, 0.0)


def circle(alpha, xi=NO_DISTURBANCE, step_s=1 / 30, duration_s=20.0):
    """Return the run of the law on the circle of section 8.9, stepped at the robot's own rate."""
    explicit = CIRCLE_GAINS.asg_ism
    gains = make_gains(
        CIRCLE_GAINS.model_dump()
        | {
            "asg_ism_implicit": {
                "k1_s": explicit.k1_s, "k2_s": explicit.k2_s, "alpha_m_s3": alpha,
                "mu0_s": explicit.mu0_s, "sigma_m_s2": explicit.sigma_m_s2, "cost": "norm",
            }
        }
    )  # fmt: skip
    law = make_outer_law("asg-ism-implicit", gains, CIRCLE_LIMITS, CIRCLE.d0_m)
    return run_ideal(
        law, CIRCLE, CIRCLE_START, disturbances=xi, step_s=step_s, duration_s=duration_s
    )


def test_the_law_stays_on_the_surface_and_under_disturbance_within_its_bound():
    """On the circle at 30 Hz: s of the order of the hold's own error alone, and within h D disturbed.

    |d| is 0.3 + 0.8 * 0.05/0.03 = 1.6 m/s^3 at most, so h D is 0.055 m/s^2.
    """
    calm = circle(4.0)
    assert calm.s_norm_max_m_s2 < 0.02
    pushed = circle(4.0, Disturbances())
    assert pushed.s_norm_max_m_s2 < 1.6 / 30 + 0.02
    assert pushed.worst_m(10.0) < 0.02


def test_without_alpha_the_implicit_law_leaves_the_surface():
    """Negative control: alpha = 0 under the same disturbance."""
    assert circle(0.0, Disturbances()).s_norm_max_m_s2 > 5 * (1.6 / 30 + 0.02)


@settings(max_examples=60, deadline=None)
@given(s=PLANE, w=PLANE)
def test_implicit_super_twisting_solves_its_step(s, w):
    """Both lines of the step hold at its end: s+ = s + h u with the signs and roots of s+."""
    bound, l1, l0 = 5.0, 1.5, 1.1
    u, w_next = twisted(s, w, H_S, bound=bound, l1=l1, l0=l0)
    after = tuple(s[i] + H_S * u[i] for i in range(2))
    length = math.hypot(*after)
    if length < 1e-9:
        assert math.dist(w_next, w) <= H_S * l0 * bound * (1 + 1e-9) + 1e-9
        return
    for i in range(2):
        assert w_next[i] == pytest.approx(w[i] - H_S * l0 * bound * after[i] / length, abs=1e-4)
        root = l1 * math.sqrt(bound / length) * after[i]
        assert u[i] == pytest.approx(w_next[i] - root, abs=1e-4)


def test_super_twisting_rests_where_nothing_disturbs_and_follows_a_ramp():
    """From off the surface s and w go to 0; a disturbance d that grows at L/2 is met: w = -d, s = h d."""
    s, w = (0.4, -0.2), (0.0, 0.0)
    for _ in range(200):
        u, w = twisted(s, w, H_S, bound=5.0, l1=1.5, l0=1.1)
        s = (s[0] + H_S * u[0], s[1] + H_S * u[1])
    assert math.hypot(*s) < 1e-9
    assert math.hypot(*w) < 1e-9
    for tick in range(200):
        d = 2.5 * tick * H_S
        u, w = twisted(s, w, H_S, bound=5.0, l1=1.5, l0=1.1)
        s = (s[0] + H_S * (u[0] + d), s[1] + H_S * u[1])
    assert s[0] == pytest.approx(H_S * d, abs=1e-3)
    assert w[0] == pytest.approx(-d, abs=0.1)
