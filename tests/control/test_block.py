"""The n-dimensional averaged sub-gradient block by its own properties."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.control import AsgIsm, bounds

NUMBER = st.floats(-5.0, 5.0)


def block(n, *, k=1.0, eps=0.05, mu0=1.0, sigma=1.0, **more):
    return AsgIsm(k=[k] * n, eps_min=[eps], mu0_s=mu0, sigma=sigma, **more)


def closed(law, p, q, disturbance, *, h=1e-3, duration=8.0):
    """Run dp/dt = q, dq/dt = w + d with the law; return t, p and ||s|| (all from the tick)."""
    p, q = np.array(p, float), np.array(q, float)
    law.reset(p, q)
    ts, ps, ss = [], [], []
    for k in range(int(duration / h)):
        t = k * h
        w = np.array(law.output(t, p, q, h))
        law.advance(h)
        ts.append(t)
        ps.append(p.copy())
        ss.append(law.s_norm)
        a = w + disturbance(t)
        p, q = p + h * q + 0.5 * h * h * a, q + h * a
    return np.array(ts), np.array(ps), np.array(ss)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(NUMBER, NUMBER), min_size=1, max_size=6), st.floats(0.1, 10.0))
def test_sliding_from_the_first_instant(pairs, mu0):
    """s(0) = 0 for every start and dimension; with eta of the other sign, as printed, it is not."""
    p, q = zip(*pairs, strict=True)
    law = block(len(p), mu0=mu0)
    law.reset(p, q)
    s, *_ = law.terms(0.0, p, q)
    assert max(map(abs, s)) < 1e-12
    printed = [qi + (pi + (-pi + mu0 * qi)) / mu0 for pi, qi in pairs]
    assert printed == pytest.approx([2.0 * qi for qi in q])


@pytest.mark.parametrize("mu_min", [0.0, 0.4])
def test_kappa_is_what_the_average_adds_to_the_rate_of_s(mu_min):
    """ds/dt = dq/dt + kappa along any smooth motion, also where mu stands at its floor."""
    law = block(2, mu0=0.7, sigma=0.6, mu_min=mu_min)

    def motion(t):
        return (2.0 + np.sin(t), -3.0 + 0.5 * np.cos(t)), (np.cos(t), -0.5 * np.sin(t))

    h, before, checked = 1e-4, None, 0
    law.reset(*motion(0.0))
    for k in range(15_000):
        t = k * h
        p, q = motion(t)
        s, kappa, *_ = law.terms(t, p, q)
        law.advance(h)
        q_dot = np.array([-np.sin(t), -0.5 * np.cos(t)])
        crossing = mu_min and abs(1.0 / (t + 0.7) - mu_min) < 2e-4  # mu has a corner there
        if before is not None and k % 50 == 1 and not crossing:
            rate = (np.array(s) - before) / h
            assert rate == pytest.approx(q_dot + kappa, abs=2e-3)
            checked += 1
        before = np.array(s)
    assert checked > 250


def test_gain_above_the_disturbance_keeps_the_layer():
    """||s|| stays within eps when k = 2 (D + k0); a gain below D does not keep it."""
    big = 0.8

    def disturbance(t):
        return big / math.sqrt(2.0) * np.array([np.sin(3 * t), np.cos(2.3 * t)])

    held = closed(block(2, k=bounds.gain(big, 0.1), eps=0.05), (0.4, -1.0), (0.2, 0.5), disturbance)
    lost = closed(block(2, k=0.5 * big, eps=0.05), (0.4, -1.0), (0.2, 0.5), disturbance)
    assert held[2].max() <= 0.05
    assert lost[2].max() > 0.05


def test_lemma_the_energy_of_the_average_is_constant_on_the_surface():
    """(t + mu0) H + ||Z + eta||^2/2 stays while s = 0, whatever sgn does, and bounds H."""
    mu0, h = 0.8, 5e-4
    p = np.array([1.3, -0.4])
    law = block(2, mu0=mu0)
    q = np.array([0.2, 0.7])
    law.reset(p, q)
    eta = np.array(law.eta)

    def energy(t):
        return (t + mu0) * law.cost(p) + 0.5 * np.sum((np.array(law.averaged) + eta) ** 2)

    start = energy(0.0)
    for k in range(int(10.0 / h)):
        t = k * h
        q = -(p + eta + np.array(law.averaged)) / (t + mu0)  # s = 0
        s, *_ = law.terms(t, p, q)
        assert max(map(abs, s)) < 1e-12
        assert (t + mu0) * law.cost(p) <= start * 1.005
        law.advance(h)
        p = p - h * (p + eta + np.array(law.averaged)) / (t + mu0)  # with the new average: no drift
    assert energy(10.0) == pytest.approx(start, rel=5e-3)


def test_on_the_surface_the_error_swings_with_a_falling_amplitude():
    """|p| <= E/(sigma (t + mu0)) in each axis, and comes near it: the bound is no wider than need be."""
    t, p, _ = closed(
        block(1, k=4.0, eps=0.002, sigma=1.0), [-2.0], [0.3], lambda _t: 0.0, duration=16.0
    )
    limit = np.array([bounds.amplitude(x, -2.0, 0.3, sigma=1.0, mu0_s=1.0) for x in t])
    assert np.all(np.abs(p[:, 0]) <= limit * 1.01)
    late = t > 8.0
    assert np.abs(p[late, 0]).max() > 0.9 * limit[late].min()


def test_bound_of_the_cost_holds_within_a_shrinking_layer():
    """(4.22) with 1/(1 - alpha) holds along a run whose layer is eps0/(t + mu0)^(1 + alpha)."""
    alpha, eps0, mu0 = 0.4, 0.3, 1.0
    law = AsgIsm(k=[4.0, 4.0], eps_min=[1e-9], eps0=eps0, beta=alpha, mu0_s=mu0, sigma=1.0)
    p0, q0 = (0.6, -0.8), (0.1, 0.3)
    t, p, s = closed(law, p0, q0, lambda x: 0.5 * np.array([np.sin(2 * x), np.cos(3 * x)]))
    layer = np.array([bounds.layer(x, eps0, mu0, alpha) for x in t])
    assert np.all(s <= layer)
    cost = np.abs(p).sum(axis=1)
    limit = np.array([bounds.cost_bound(x, p0, q0, eps0=eps0, mu0_s=mu0, alpha=alpha) for x in t])
    assert np.all(cost <= limit)


def test_layer_share_is_the_integral_it_stands_for():
    """(4.21): the bracket with 1/(1 - alpha) is the mean of the layer; printed 1/(1 + alpha) is not."""
    t, t0, mu0, alpha, eps0 = 7.0, 1.5, 0.8, 0.4, 1.3
    tau = np.linspace(t0, t, 200_001)
    mean = np.trapezoid(eps0 * (tau + mu0) ** -alpha, tau) / (t + mu0)
    ours = bounds.layer_share(t, t0, eps0=eps0, mu0_s=mu0, alpha=alpha, axes=1)
    printed = eps0 * (
        1 / ((1 + alpha) * (t + mu0) ** alpha) - (t0 + mu0) / ((1 + alpha) * (t + mu0))
    )
    assert ours == pytest.approx(mean, rel=1e-6)
    assert abs(printed - mean) > 0.3 * mean


def test_gain_and_disturbance_bound_are_the_formulas():
    """The gain is 2 (D + k0) with D = gamma0 + gamma1 ||rho|| + gamma2 ||phi||, by hand."""
    bound = bounds.disturbance_bound((0.1, 2.0, 0.5), (3.0, 4.0), (0.0, 2.0))
    assert bound == pytest.approx(0.1 + 10.0 + 1.0)
    assert bounds.gain(bound, 0.4) == pytest.approx(23.0)


def test_printed_layer_grows_and_loses_the_error():
    """The exponent of (5.13), (7.10) as printed widens the layer: the error is a thousand times larger."""

    def worst(beta_sign):
        law = block(1, k=1.5, eps=0.01, sigma=0.1)
        p, q, late = np.zeros(1), np.array([0.5]), 0.0
        law.reset(p, q)
        h = 4e-3
        for k in range(int(60.0 / h)):
            t = k * h
            (s,), (kappa,), *_ = law.terms(t, p, q)
            eps = max(0.1 * (t + 1.0) ** (beta_sign * 1.5), 0.01)
            law.advance(h)
            p = p + h * q
            q = q + h * (-kappa - 1.5 * s / (abs(s) + eps) + 0.3 * math.sin(0.5 * t) + 0.2)
            late = max(late, abs(q[0])) if t > 30.0 else late
        return late

    assert worst(-1.0) < 0.02
    assert worst(+1.0) > 3.0


def test_rate_is_the_derivative_of_the_output():
    """dw/dt with sgn held, against a difference quotient, for all options that have one."""
    for more in ({}, {"componentwise": True}, {"mu_min": 5.0}, {"kd": [0.7]}):
        law = block(2, k=0.8, eps=0.3, mu0=0.9, sigma=0.4, **more)
        p, q, a = np.array([1.0, -2.0]), np.array([0.3, 0.4]), np.array([0.5, -0.2])
        law.reset(p + 0.3, q - 0.2)
        for k in range(1000):  # so that the integral of sgn is not zero
            law.output(1e-3 * k, p, q, 1e-3)
            law.advance(1e-3)
        t, h = 1.0, 1e-6
        w = np.array(law.output(t, p, q, h))
        rate = np.array(law.rate(a))
        law.advance(h)
        later = np.array(law.output(t + h, p + h * q, q + h * a, h))
        assert rate == pytest.approx((later - w) / h, abs=2e-4), more


def test_implicit_step_does_not_chatter():
    """Without a layer the sign law switches every step; the implicit one settles, exact when calm."""
    h = 1e-2

    def variation(**more):
        law = block(1, k=2.0, eps=1e-9, sigma=0.0, mu0=10.0, **more)
        p, q, last, total = np.zeros(1), np.zeros(1), 0.0, 0.0
        law.reset(p, q)
        for k in range(500):
            (w,) = law.output(k * h, p, q, h)
            law.advance(h)
            total += abs(w - last) if k else 0.0
            last = w
            p, q = p + h * q, q + h * (w + 0.3)
        return total

    assert variation(implicit=True) < 1.0
    assert variation() > 500.0


def test_gain_law_as_printed_outweighs_the_average():
    """(4.14): without -kappa in w the grown gain still keeps ||s|| within eps."""
    law = block(2, k=bounds.gain(0.3, 0.1), eps=0.05, dominating=True)
    _, _, s = closed(law, (0.5, -0.5), (0.3, 0.1), lambda t: 0.2 * np.array([np.sin(t), np.cos(t)]))
    assert s.max() <= 0.05


def test_floored_mu_forgets_at_a_constant_rate():
    """A disturbance met late leaves the printed law with an error that the floored one does not have."""

    def late(mu_min):
        law = block(1, k=2.0, eps=0.1, mu_min=mu_min)
        t, p, _ = closed(
            law, [0.0], [0.0], lambda x: 0.8 * math.sin(0.5 * x), duration=100.0, h=1e-2
        )
        return np.abs(p[t > 70.0]).max()

    assert late(0.2) < 0.5 * late(0.0)


def test_wrong_lengths_are_refused():
    """A gain or a vector of another length than the law's is an error that says both lengths."""
    with pytest.raises(ValueError, match="2 entries is needed, not 3"):
        AsgIsm(k=[1.0, 1.0], eps_min=[0.1, 0.1, 0.1], mu0_s=1.0, sigma=1.0)
    with pytest.raises(ValueError, match="1 to 6 dimensions, not 7"):
        block(7)
    with pytest.raises(ValueError, match="2 entries is needed, not 1"):
        block(2).output(0.0, [0.0], [0.0, 0.0], 1e-3)


def test_the_derivative_form_is_an_algebraic_loop():
    """(5.10) with phi := u(s), s holding phi itself: below the step's gain it switches every step."""

    def variation(eps):
        x, u, total, speed, h = 0.5, 0.0, 0.0, 0.3, 1e-3
        averaged, steps = 0.0, 5000
        for k in range(steps):
            mu = 1.0 / (k * h + 1.0)
            s = (u - speed) + mu * (x - 0.5) + mu * averaged
            new = -s / (abs(s) + eps)
            total += abs(new - u)
            u, averaged = new, averaged + h * np.sign(x)
            x += h * (u - speed)
        return total / steps

    assert variation(0.1) > 0.5
    assert variation(2.0) < 0.01
