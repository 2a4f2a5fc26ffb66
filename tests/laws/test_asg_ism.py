"""The ASG-ISM law: sliding from the first instant, the layer, the cost, and what breaks them."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.config.control import CircleReference, ControlConfig, OuterLimits
from hil.control.laws.asg_ism import AsgIsm
from hil.control.laws.making import make_outer_law
from hil.control.laws.stages import power
from hil.study import ideal_circle
from hil.study.ideal_circle import (
    CIRCLE_GAINS,
    CIRCLE_LIMITS,
    CIRCLE_START,
    Disturbances,
    run_ideal,
)
from tests.laws.support import D0_M, drive_to, estimate, point

CIRCLE = CircleReference()


def circle_run(gains=CIRCLE_GAINS.asg_ism, xi=ideal_circle.NO_DISTURBANCE, start=CIRCLE_START, **k):
    law = AsgIsm(gains, CIRCLE_LIMITS, D0_M)
    return law, run_ideal(law, CIRCLE, start, disturbances=xi, **k)


@given(
    x=st.floats(-1, 1),
    y=st.floats(-1, 1),
    theta=st.floats(-7, 7),
    eta1=st.floats(-0.5, 0.5),
    w=st.floats(-2.5, 2.5),
    p=st.sampled_from([1.0, 1.5, 2.0]),
)
def test_s_starts_at_zero_from_any_state(x, y, theta, eta1, *, w, p):
    """The reset's gamma = -mu0 delta3(0) puts the state on s = 0 at the first instant."""
    gains = ControlConfig().active_gains.asg_ism.model_copy(update={"p": p})
    law = AsgIsm(gains, OuterLimits(), D0_M)
    here = estimate(x, y, theta, eta1, w=w)
    law.reset(point(0.1, 0.2), here)
    trace = law.step(point(0.1, 0.2), here, 1 / 30).trace
    assert math.hypot(trace["s_x"], trace["s_y"]) < 1e-9
    assert trace["in_layer"] == 1.0
    assert trace["psi_x"] == trace["psi_y"] == 0.0


@settings(max_examples=8, deadline=None)
@given(dx=st.floats(-0.1, 0.1), dy=st.floats(-0.1, 0.1), phase=st.sampled_from([1.0, 2.0, 3.0]))
def test_s_stays_in_the_layer_when_alpha_exceeds_twice_the_disturbance(dx, dy, phase):
    """|d| of z_dddot is about 0.3 + 0.8 * 0.05/0.03 = 1.6 m/s^3, alpha = 4: ||s|| <= eps."""
    xi = Disturbances(0.1, 3.0, 0.05, phase)
    start = (dx, 8.0 + dy, *CIRCLE_START[2:])
    _, run = circle_run(xi=xi, start=start, duration_s=12.0)
    assert run.s_norm_max_m_s2 <= CIRCLE_GAINS.asg_ism.eps_min_m_s2


def test_without_alpha_the_disturbance_leaves_the_layer():
    """Negative control: alpha = 0 under the same disturbance leaves s = 0 by far."""
    gains = CIRCLE_GAINS.asg_ism.model_copy(update={"alpha_m_s3": 0.0})
    _, run = circle_run(gains, Disturbances(), duration_s=20.0)
    assert run.s_norm_max_m_s2 > 10 * gains.eps_min_m_s2


def test_without_gamma_s_does_not_start_at_zero(monkeypatch):
    """Negative control: the reset is what puts the state on the surface."""
    monkeypatch.setattr(AsgIsm, "reset", lambda *_: None)
    _, run = circle_run(duration_s=0.1)
    assert math.hypot(*run.s[0]) > 0.1


def test_cost_of_the_integral_error_obeys_the_lemma():
    """(4.18) on ||s|| <= eps: (t + mu0) H(delta4) <= |gamma|^2/2 + sigma sqrt(2) int (t+mu0)||s||.

    With H = sigma sum |delta4_i| and d zeta/dt = -dH the appendix's derivation 10.1 II gives
    (t + mu0) H = |gamma|^2/2 - |zeta - gamma|^2/2 + the integral term; docs/control.md.
    """
    gains = CIRCLE_GAINS.asg_ism.model_copy(update={"sigma_m_s2": 0.5})
    law = AsgIsm(gains, CIRCLE_LIMITS, D0_M)
    law_step, costs = law.step, []

    def recording_step(reference, here, dt_s):
        out = law_step(reference, here, dt_s)
        costs.append(gains.sigma_m_s2 * sum(abs(d) for d in law.delta4_m_s))
        return out

    law.step = recording_step
    run = run_ideal(law, CIRCLE, CIRCLE_START, disturbances=Disturbances(), duration_s=40.0)
    gamma2 = sum(g * g for g in law.gamma_m_s)
    drift = 0.0
    for t, s, cost in zip(run.t_s, run.s, costs, strict=True):
        drift += gains.sigma_m_s2 * math.sqrt(2) * (t + gains.mu0_s) * math.hypot(*s) * 2e-3
        assert (t + gains.mu0_s) * cost <= 0.5 * gamma2 + drift + 1e-3
    assert max(costs) > 10 * costs[-1]


@pytest.mark.parametrize("p", [1.0, 1.5, 2.0])
def test_power_and_its_rates_match_differences(p):
    """Along d(t) = 0.3 sin t - 0.1 both derivatives of k |d|^p sgn(d) are its slopes."""

    def at(t):
        return power(0.3 * math.sin(t) - 0.1, 0.3 * math.cos(t), -0.3 * math.sin(t), 1.7, p)

    h = 1e-4
    for t in (-1.0, 0.1, 1.2):
        before, here, after = at(t - h)[0], at(t)[0], at(t + h)[0]
        assert at(t)[1] == pytest.approx((after - before) / (2 * h), rel=1e-4)
        assert at(t)[2] == pytest.approx((after - 2 * here + before) / h**2, rel=1e-3, abs=1e-5)


def test_layer_shrinks_to_its_floor():
    """The layer is eps0 / (t + mu0)^(1 + beta), never below eps_min (4.20)."""
    gains = CIRCLE_GAINS.asg_ism.model_copy(
        update={"eps0_m_s2": 0.8, "beta": 0.5, "mu0_s": 2.0, "eps_min_m_s2": 0.05}
    )
    law = AsgIsm(gains, OuterLimits(), D0_M)
    here = estimate(eta1=0.3)
    law.reset(point(1, 0), here)
    seen = [law.step(point(1, 0), here, 0.5).trace["eps"] for _ in range(40)]
    assert seen[0] == pytest.approx(0.8 / 2.0**1.5)
    assert seen[4] == pytest.approx(0.8 / 4.0**1.5)
    assert seen[-1] == 0.05


@pytest.mark.parametrize("outer", ["asg-ism", "pid"])
@pytest.mark.parametrize(
    ("start", "goal"),
    [
        ((-0.6, -0.35, math.pi / 2), (0.05, 0.35)),
        ((0.65, -0.35, math.pi / 2), (0.05, 0.35)),
        ((0.0, 0.0, math.pi / 2), (0.5, 0.0)),
        ((0.0, 0.0, 0.0), (-0.6, 0.0)),
        ((0.0, 0.0, 3.0), (-0.6, 0.2)),
    ],
    ids=["right", "left", "beside", "behind", "ahead of a half turn"],
)
def test_point_is_reached_from_rest_on_either_side_beside_and_behind(outer, start, goal):
    """Both laws come within 10 mm in 20 s, stop there, and never pass a restriction."""
    limits = OuterLimits(lead_s=0)
    law = make_outer_law(outer, ControlConfig().active_gains, limits, D0_M)
    run = drive_to(law, start, goal)
    assert max(run.error(goal, index) for index in range(-30, 0)) < 0.010
    assert run.eta1[-1] == run.w[-1] == 0.0
    assert max(map(abs, run.eta1)) <= limits.eta1_max_m_s
    assert max(map(abs, run.w)) <= limits.theta_dot_max_rad_s


@pytest.mark.parametrize("outer", ["asg-ism", "pid"])
def test_wrong_sign_of_b_does_not_reach_the_point(outer, monkeypatch):
    """Negative control: with the lateral sign of B flipped neither law comes within 20 mm in 20 s."""
    from hil.control.laws import chain  # noqa: PLC0415

    right = chain.damped_inverse
    monkeypatch.setattr(
        chain, "damped_inverse", lambda *a, **k: (right(*a, **k)[0], -right(*a, **k)[1])
    )
    law = make_outer_law(outer, CIRCLE_GAINS, OuterLimits(), D0_M)
    run = drive_to(law, (-0.6, -0.35, math.pi / 2), (0.05, 0.35))
    assert min(run.error((0.05, 0.35), index) for index in range(-30, 0)) > 0.020


def arrives_without_spinning(outer):
    """Whether the shipped gains bring the robot within 20 mm in less than half a turn."""
    law = make_outer_law(outer, ControlConfig().active_gains, OuterLimits(), D0_M)
    run = drive_to(law, (-0.6, -0.35, math.pi / 2), (0.05, 0.35))
    worst = max(run.error((0.05, 0.35), index) for index in range(-30, 0))
    return worst < 0.020 and abs(run.theta[-1] - math.pi / 2) < math.pi


@pytest.mark.parametrize("outer", ["asg-ism", "pid"])
def test_wrong_sign_of_b_is_told_by_error_or_turn_with_the_shipped_gains(outer, monkeypatch):
    """Fast gains can drift onto the point while spinning: the error alone would not tell."""
    from hil.control.laws import chain  # noqa: PLC0415

    assert arrives_without_spinning(outer)
    right = chain.damped_inverse
    monkeypatch.setattr(
        chain, "damped_inverse", lambda *a, **k: (right(*a, **k)[0], -right(*a, **k)[1])
    )
    assert not arrives_without_spinning(outer)


@pytest.mark.parametrize("outer", ["asg-ism", "pid"])
def test_same_steps_give_the_same_commands_after_a_reset(outer):
    """A law holds no state across reset: a second run is bit-identical to the first."""
    law = make_outer_law(outer, ControlConfig().active_gains, OuterLimits(), D0_M)
    runs = [drive_to(law, (-0.6, -0.35, 1.5), (0.05, 0.35), seconds=3.0) for _ in range(2)]
    assert runs[0].eta1 == runs[1].eta1
    assert runs[0].w == runs[1].w


@pytest.mark.parametrize("outer", ["asg-ism", "pid"])
def test_traces_have_the_same_columns(outer):
    """Both laws return the same trace names; what PID does not have is NaN."""
    law = make_outer_law(outer, ControlConfig().active_gains, OuterLimits(), D0_M)
    law.reset(point(1, 0), estimate())
    trace = law.step(point(1, 0), estimate(), 1 / 30).trace
    assert list(trace) == [
        "z2_x_m_s", "z2_y_m_s", "z3_x_m_s2", "z3_y_m_s2", "s_x", "s_y", "psi_x", "psi_y",
        "zeta_m_s2", "v1_m_s3", "u2_m_s2", "eps", "in_layer", "saturated",
    ]  # fmt: skip
    assert math.isnan(trace["s_x"]) == (outer == "pid")


def test_gain_may_grow_with_the_bound_of_2_9():
    """Alpha = 0 with gamma0 = 2 is alpha = 4: s stays in the layer; gamma1, gamma2 make it stiffer still."""
    base = CIRCLE_GAINS.asg_ism
    bounded = base.model_copy(update={"alpha_m_s3": 0.0, "gamma0_m_s3": 2.0})
    _, run = circle_run(bounded, Disturbances(), duration_s=8.0)
    _, same = circle_run(base, Disturbances(), duration_s=8.0)  # alpha = 4 = 2 * 2
    assert run.s == same.s
    assert run.s_norm_max_m_s2 <= base.eps_min_m_s2
    for name in ("gamma1_s3", "gamma2_s2"):
        _, other = circle_run(base.model_copy(update={name: 1.0}), Disturbances(), duration_s=2.0)
        assert other.s_norm_max_m_s2 < same.s_norm_max_m_s2
