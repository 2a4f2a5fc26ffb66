"""State feedback, sliding mode and Utkin's integral sliding mode on a double integrator."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hil.control import SlidingMode, StateFeedback, UtkinIsm


def run(law, p, q, disturbance, *, duration=6.0, h=2e-3):
    p, q = np.array(p, float), np.array(q, float)
    law.reset(p, q)
    ps, ss = [], []
    for k in range(int(duration / h)):
        w = np.array(law.output(k * h, p, q, h))
        law.advance(h)
        ps.append(p.copy())
        ss.append(law.s_norm)
        a = w + disturbance(k * h)
        p, q = p + h * q + 0.5 * h * h * a, q + h * a
    return np.array(ps), np.array(ss)


def test_pd_has_the_poles_of_its_gains():
    """Kp = kd^2/4: p(t) = (p0 + (q0 + p0 c) t) exp(-c t), by hand."""
    ps, _ = run(
        StateFeedback(kp=[4.0], kd=[4.0]), [1.0], [0.0], lambda _t: 0.0, h=5e-4, duration=3.0
    )
    t = 5e-4 * np.arange(len(ps))
    assert ps[:, 0] == pytest.approx((1.0 + 2.0 * t) * np.exp(-2.0 * t), abs=2e-3)


def test_pid_removes_a_constant_disturbance_that_pd_leaves():
    """PD rests at d/kp, PID at zero."""
    pd, _ = run(StateFeedback(kp=[4.0], kd=[4.0]), [0.0], [0.0], lambda _t: 1.0, duration=14.0)
    pid, _ = run(
        StateFeedback(kp=[4.0], kd=[4.0], ki=[2.0]), [0.0], [0.0], lambda _t: 1.0, duration=14.0
    )
    assert pd[-1, 0] == pytest.approx(0.25, abs=1e-3)
    assert abs(pid[-1, 0]) < 1e-3


def test_sliding_mode_has_a_reaching_phase_and_utkin_s_none():
    """Classical sliding mode starts at s = q + c p, Utkin's form at s = 0, and both end within the layer."""
    classical = SlidingMode(c=[1.0, 1.0], k=[2.0], eps=[0.05])
    utkin = UtkinIsm(kp=[1.0, 1.0], kd=[2.0], k=[2.0], eps=[0.05])

    def push(t):
        return 0.5 * np.array([math.sin(t), math.cos(t)])

    _, reach = run(classical, (1.0, 0.5), (0.3, 0.0), push)
    _, kept = run(utkin, (1.0, 0.5), (0.3, 0.0), push)
    assert reach[0] == pytest.approx(math.hypot(1.3, 0.5))
    assert reach[-1] < 0.05
    assert kept[0] == 0.0
    assert kept.max() < 0.05


def test_utkin_s_form_keeps_the_nominal_motion_under_a_disturbance():
    """With the sliding term the disturbed run stays near the undisturbed PD, without it it does not."""
    nominal, _ = run(StateFeedback(kp=[1.0], kd=[2.0]), [1.0], [0.0], lambda _t: 0.0)
    robust, _ = run(
        UtkinIsm(kp=[1.0], kd=[2.0], k=[2.0], eps=[0.01]), [1.0], [0.0], lambda t: 0.8 * math.sin(t)
    )
    plain, _ = run(StateFeedback(kp=[1.0], kd=[2.0]), [1.0], [0.0], lambda t: 0.8 * math.sin(t))
    assert np.abs(robust - nominal).max() < 0.01
    assert np.abs(plain - nominal).max() > 0.2


@pytest.mark.parametrize(
    ("kind", "gains"),
    [
        (StateFeedback, {"kp": [1.0, 2.0], "kd": [0.5], "ki": [0.3]}),
        (SlidingMode, {"c": [1.0, 2.0], "k": [0.8], "eps": [0.2]}),
        (SlidingMode, {"c": [1.0, 2.0], "k": [0.8], "eps": [0.2], "componentwise": True}),
        (UtkinIsm, {"kp": [1.0, 2.0], "kd": [0.5], "k": [0.8], "eps": [0.2]}),
    ],
)
def test_rate_is_the_derivative_of_the_output(kind, gains):
    """dw/dt of every baseline against a difference quotient."""
    law = kind(**gains)
    p, q, a, h = np.array([1.0, -2.0]), np.array([0.3, 0.4]), np.array([0.5, -0.2]), 1e-6
    law.reset(p + 0.1, q - 0.2)
    w = np.array(law.output(0.0, p, q, h))
    rate = np.array(law.rate(a))
    law.advance(h)
    later = np.array(law.output(h, p + h * q, q + h * a, h))
    assert rate == pytest.approx((later - w) / h, abs=1e-4)
