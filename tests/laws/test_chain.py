"""The linearised chain: A and B proved symbolically, the damped inverse, the restrictions."""

import math

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.config.control import OuterLimits
from hil.control.laws.chain import Chain, damped_inverse, restrict
from tests.laws.support import D0_M, estimate

# cos and sin of theta are symbols with their own rates, so that everything is a polynomial.
c, s = sp.symbols("c s")
eta1, eta2, zeta, v1, u2 = sp.symbols("eta1 eta2 zeta v1 u2")
d0, m, inertia = sp.symbols("d0 m I", positive=True)
xi, xi_dot = sp.symbols("xi1:4"), sp.symbols("xi_dot1:4")


def third_derivative(d1=0, d2=0):
    """Return d3z/dt3 of z = [X + d0 c, Y + d0 s] along (2.30), (2.34) with d1, d2 in eta_dot."""
    w = -eta2 / d0
    rates = {c: -s * w, s: c * w, eta1: zeta + d1, eta2: u2 + d2, zeta: v1}
    rates |= dict(zip(xi, xi_dot, strict=True))
    z_dot = sp.Matrix([c * eta1 - s * eta2, s * eta1 + c * eta2]) + d0 * sp.Matrix([-s, c]) * w
    z = z_dot
    for _ in range(2):
        z = z.jacobian(list(rates)) * sp.Matrix(list(rates.values()))
    return z


def is_zero(expression):
    """Whether an expression vanishes under c^2 + s^2 = 1."""
    numerator = sp.expand(sp.numer(sp.together(expression)))
    return sp.expand(sp.rem(numerator, s**2 + c**2 - 1, s)) == 0


def closed_form(second_row_sign):
    """Return A + B v and B; -1 is docs/control.md section 1, +1 is as printed after (2.35)."""
    A = -sp.Matrix([c, s]) * eta1 * eta2**2 / d0**2
    A += sp.Matrix([s, second_row_sign * c]) * 2 * zeta * eta2 / d0
    B = sp.Matrix([[c, eta1 * s / d0], [s, second_row_sign * eta1 * c / d0]])
    return A + B * sp.Matrix([v1, u2]), B


def test_closed_form_of_a_and_b_is_the_third_derivative_of_the_flat_output():
    """A + B v of control.md equals d3z/dt3 symbolically, and det B = -eta1/d0."""
    ours, B = closed_form(-1)
    assert all(is_zero(entry) for entry in third_derivative() - ours)
    assert is_zero(B.det() + eta1 / d0)


def test_printed_a_and_b_are_not_the_third_derivative():
    """The printed signs differ, and the printed B is singular at 45 degrees at any speed."""
    printed, B = closed_form(+1)
    assert not all(is_zero(entry) for entry in third_derivative() - printed)
    assert sp.simplify(B.det().subs({c: sp.sqrt(2) / 2, s: sp.sqrt(2) / 2})) == 0


def test_disturbance_matrices_of_the_third_derivative():
    """P xi + G xi_dot of (8.14), that is C xi + D xi_dot of (2.36), as corrected in docs/control.md.

    Against the print: the terms in 1/m of C all carry eta2/d0, C13 has a +, D a -.
    """
    d1 = -(c * xi[0] + s * xi[1]) / m
    d2 = -(-s * xi[0] + c * xi[1] - xi[2] / d0) / (m + inertia / d0**2)
    rest = third_derivative(d1, d2) - third_derivative()
    k, q = eta1 / (m * d0**2 + inertia), eta2 / (d0 * m)
    C = sp.Matrix(
        [
            [k * d0 * s**2 - 3 * q * c * s, -k * d0 * c * s + q * (c**2 - 2 * s**2), k * s],
            [-k * d0 * s * c + q * (2 * c**2 - s**2), k * d0 * c**2 + 3 * q * s * c, -k * c],
        ]
    )
    D = -sp.Matrix([[c**2, s * c, 0], [s * c, s**2, 0]]) / m
    ours = C * sp.Matrix(xi) + D * sp.Matrix(xi_dot)
    assert all(is_zero(entry) for entry in rest - ours)
    printed_c11 = (k * d0 * s - 2 * q * c - c / m) * s
    assert not is_zero(rest[0].diff(xi[0]) - printed_c11)


CLOSED_FORM = closed_form(-1)[0]


@settings(max_examples=50, deadline=None)
@given(
    theta=st.floats(-4, 4),
    speed=st.floats(0.2, 1.0),
    w=st.floats(-2, 2),
    accel=st.floats(-1, 1),
    jx=st.floats(-5, 5),
    jy=st.floats(-5, 5),
    backwards=st.booleans(),
)
def test_heading_split_inverts_the_closed_form(*, theta, speed, w, accel, jx, jy, backwards):
    """At speed the damped inverse returns the v that makes A + B v the wanted jerk."""
    cos, sin = math.cos(theta), math.sin(theta)
    speed = -speed if backwards else speed
    got_v1, w_dot = damped_inverse(
        cos * jx + sin * jy,
        cos * jy - sin * jx,
        eta1=speed,
        w=w,
        zeta=accel,
        w_dot_rest=0.0,
        lambda_m_s=1e-4,
    )
    values = dict(zip((c, s, eta1, eta2), (cos, sin, speed, -D0_M * w), strict=True))
    values |= dict(zip((zeta, d0, v1, u2), (accel, D0_M, got_v1, -D0_M * w_dot), strict=True))
    third = CLOSED_FORM.subs(values)
    assert float(third[0]) == pytest.approx(jx, abs=2e-4)
    assert float(third[1]) == pytest.approx(jy, abs=2e-4)


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
