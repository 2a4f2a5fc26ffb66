"""The linearised chain: A and B proved symbolically, the damped inverse, the restrictions."""

import math

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from hil.config.control import OuterLimits
from hil.laws.chain import Chain, damped_inverse, restrict
from tests.laws.support import D0_M, estimate


def symbols_and_third_derivative():
    """Return the symbols and d3z/dt3 of z = [X + d0 cos, Y + d0 sin] along (2.30), (2.34)."""
    d0, v1, u2 = sp.symbols("d0 v1 u2", positive=True)
    X, Y, theta, eta1, eta2, zeta = sp.symbols("X Y theta eta1 eta2 zeta")
    c, s = sp.cos(theta), sp.sin(theta)
    rates = {
        X: c * eta1 - s * eta2,
        Y: s * eta1 + c * eta2,
        theta: -eta2 / d0,
        eta1: zeta,
        eta2: u2,
        zeta: v1,
    }
    z = sp.Matrix([X + d0 * c, Y + d0 * s])
    for _ in range(3):
        z = z.jacobian(list(rates)) * sp.Matrix(list(rates.values()))
    return (theta, eta1, eta2, zeta, d0, v1, u2), sp.simplify(z)


def closed_form(symbols, second_row_sign):
    """Return A + B v; second_row_sign -1 is control.md section 1, +1 is as printed in (2.35) ff."""
    theta, eta1, eta2, zeta, d0, v1, u2 = symbols
    c, s = sp.cos(theta), sp.sin(theta)
    A = -sp.Matrix([c, s]) * eta1 * eta2**2 / d0**2
    A += sp.Matrix([s, second_row_sign * c]) * 2 * zeta * eta2 / d0
    B = sp.Matrix([[c, eta1 * s / d0], [s, second_row_sign * eta1 * c / d0]])
    return A + B * sp.Matrix([v1, u2]), B


def test_closed_form_of_a_and_b_is_the_third_derivative_of_the_flat_output():
    """A + B v of control.md equals d3z/dt3 symbolically, and det B = -eta1/d0."""
    symbols, third = symbols_and_third_derivative()
    ours, B = closed_form(symbols, -1)
    assert sp.simplify(third - ours) == sp.zeros(2, 1)
    assert sp.simplify(B.det() + symbols[1] / symbols[4]) == 0


def test_printed_a_and_b_are_not_the_third_derivative():
    """The printed signs differ, and the printed B is singular at 45 degrees at any speed."""
    symbols, third = symbols_and_third_derivative()
    printed, B = closed_form(symbols, +1)
    assert sp.simplify(third - printed) != sp.zeros(2, 1)
    assert sp.simplify(B.det().subs(symbols[0], sp.pi / 4)) == 0


@given(
    theta=st.floats(-4, 4),
    eta1=st.floats(0.2, 1.0),
    w=st.floats(-2, 2),
    zeta=st.floats(-1, 1),
    jx=st.floats(-5, 5),
    jy=st.floats(-5, 5),
    backwards=st.booleans(),
)
def test_heading_split_inverts_the_closed_form(*, theta, eta1, w, zeta, jx, jy, backwards):
    """At speed the damped inverse returns the v that makes A + B v the wanted jerk."""
    eta1 = -eta1 if backwards else eta1
    c, s = math.cos(theta), math.sin(theta)
    v1, w_dot = damped_inverse(
        c * jx + s * jy,
        c * jy - s * jx,
        eta1=eta1,
        w=w,
        zeta=zeta,
        w_dot_rest=0.0,
        lambda_m_s=1e-4,
    )
    eta2, u2 = -D0_M * w, -D0_M * w_dot
    third_x = (
        -c * eta1 * eta2**2 / D0_M**2 + s * 2 * zeta * eta2 / D0_M + c * v1 + eta1 * s / D0_M * u2
    )
    third_y = (
        -s * eta1 * eta2**2 / D0_M**2 - c * 2 * zeta * eta2 / D0_M + s * v1 - eta1 * c / D0_M * u2
    )
    assert third_x == pytest.approx(jx, abs=2e-4)
    assert third_y == pytest.approx(jy, abs=2e-4)


def test_inverse_is_bounded_at_standstill_and_lets_a_turn_die():
    """At eta1 = 0 no lateral jerk is asked of B; the turn's set-point decays instead."""
    at_rest = {"w": 0.0, "zeta": 0.0, "lambda_m_s": 0.05}
    _, w_dot = damped_inverse(0.0, 100.0, eta1=0.0, w_dot_rest=-5.0, **at_rest)
    assert w_dot == -5.0
    # The largest gain from lateral jerk to w_dot is 1/(2 lambda), at eta1 = lambda.
    _, peak = damped_inverse(0.0, 1.0, eta1=0.05, w_dot_rest=0.0, **at_rest)
    assert peak == pytest.approx(1.0 / (2 * 0.05))


def test_turn_set_point_dies_out_on_a_robot_that_sticks():
    """Stuck at rest after a turn command of 1 rad/s: 0.2 s later it is a third, 1 s later nothing."""
    chain = Chain(OuterLimits(spin_decay_s=0.2, lead_s=0.0))
    chain.reset(estimate(eta1=0.3, w=1.0), (1.0, 0.0))
    stuck = chain.state(estimate())
    out = [chain.command((0.0, 0.0), stuck, 0.01).w for _ in range(100)]
    assert out[19] == pytest.approx(math.exp(-1), abs=0.02)
    assert out[99] < 0.01


@pytest.mark.parametrize(("towards", "expected"), [((1.0, 0.0), 0.1), ((-1.0, 0.2), -0.1)])
def test_zeta_starts_off_zero_at_standstill_along_the_way_to_the_point(towards, expected):
    """A robot at rest gets a start acceleration, forward or backward; a moving one does not."""
    chain = Chain(OuterLimits(zeta_start_m_s2=0.1))
    chain.reset(estimate(theta=0.3), towards)
    assert chain.zeta == pytest.approx(expected)
    chain.reset(estimate(eta1=0.3), towards)
    assert chain.zeta == 0.0


def test_set_points_stop_growing_at_their_bounds_and_leave_them_at_once():
    """However long a bound is held, the first opposite command already moves away from it."""
    limits = OuterLimits()
    chain = Chain(limits)
    chain.reset(estimate(eta1=0.2), (1.0, 0.0))
    dt = 1.0 / 30.0
    for _ in range(300):
        state = chain.state(estimate(eta1=0.5, w=2.5))
        out = chain.command((50.0, 50.0), state, dt)
        assert out.saturated
        assert abs(out.eta1) <= limits.eta1_max_m_s
        assert abs(out.w) <= limits.theta_dot_max_rad_s
        assert abs(out.zeta) <= limits.zeta_max_m_s2
    out = chain.command((-50.0, -50.0), state, dt)
    assert out.eta1 < limits.eta1_max_m_s
    assert out.w < limits.theta_dot_max_rad_s


def test_an_observed_z3_is_used_and_otherwise_zeta_forms_it():
    """z3 = e zeta + n eta1 w unless the estimator gives its own."""
    chain = Chain(OuterLimits(zeta_start_m_s2=0.1))
    chain.reset(estimate(), (1.0, 0.0))
    assert chain.state(estimate(eta1=0.4, w=0.5)).z3 == pytest.approx((0.1, 0.2))
    assert chain.state(estimate(eta1=0.4, w=0.5, z3=(7.0, 8.0))).z3 == (7.0, 8.0)


def test_restrict_keeps_direction_bounds_length_and_differentiates_itself():
    """Length stays below the limit, and the returned rates match differences along a path."""

    def path(t):
        return (
            (math.sin(2 * t) + 1, t * t),
            (2 * math.cos(2 * t), 2 * t),
            (-4 * math.sin(2 * t), 2.0),
        )

    h, t = 1e-4, 0.7
    (gx, gy), (rate_x, _), (_, accel_y) = restrict(*path(t), 0.4)
    before, after = restrict(*path(t - h), 0.4)[0], restrict(*path(t + h), 0.4)[0]
    assert math.hypot(gx, gy) < 0.4
    assert gy / gx == pytest.approx(path(t)[0][1] / path(t)[0][0])
    assert rate_x == pytest.approx((after[0] - before[0]) / (2 * h), rel=1e-5)
    assert accel_y == pytest.approx((after[1] - 2 * gy + before[1]) / h**2, rel=1e-4)


def test_restrict_is_the_identity_when_off():
    """None leaves value and derivatives alone."""
    assert restrict((3.0, 4.0), (1.0, 2.0), (5.0, 6.0), None) == ((3, 4), (1, 2), (5, 6))
