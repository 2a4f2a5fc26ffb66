"""The wheeled robot's outer law stands on the block: the numbers of control.md, to the last bit."""

from __future__ import annotations

import math
import random

from hil import control


class Written:
    """(8.13)-(8.20) corrected, written out in the order of operations of control.md section 2."""

    def __init__(self, delta3, *, mu0, sigma, eps0, beta, eps_min):
        self.mu0, self.sigma, self.eps0, self.beta, self.eps_min = mu0, sigma, eps0, beta, eps_min
        self.gamma = tuple(-mu0 * d for d in delta3)
        self.sum = [0.0] * len(delta3)

    def terms(self, t, delta4, delta3):
        mu = 1.0 / (t + self.mu0)
        psi = [mu * total for total in self.sum]
        pulled = [mu * (d + g) for d, g in zip(delta4, self.gamma, strict=True)]
        s = [d + a + b for d, a, b in zip(delta3, pulled, psi, strict=True)]
        dh = [self.sigma * (1.0 if d > 0.0 else -1.0 if d < 0.0 else 0.0) for d in delta4]
        kappa = [mu * (d - a + g - b) for d, a, g, b in zip(delta3, pulled, dh, psi, strict=True)]
        eps = max(self.eps0 * mu ** (1.0 + self.beta), self.eps_min)
        return s, kappa, psi, dh, eps

    def advance(self, dh, dt):
        self.sum = [total + d * dt for total, d in zip(self.sum, dh, strict=True)]


def test_block_gives_the_robot_s_terms_to_the_last_bit():
    """2,000 ticks of an irregular motion: s, kappa, Psi and eps are equal, not merely close."""
    rng = random.Random(4)
    gains = {"mu0": 1.2345, "sigma": 0.0517, "eps0": 0.7, "beta": 0.5, "eps_min": 0.02}
    delta3 = (rng.gauss(0, 1), rng.gauss(0, 1))
    written = Written(delta3, **gains)
    block = control.AsgIsm(
        k=[3.1, 3.1], eps_min=[0.02], eps0=0.7, beta=0.5, mu0_s=1.2345, sigma=0.0517
    )
    block.reset((0.0, 0.0), delta3)
    assert block.eta == written.gamma
    t, dt, delta4 = 0.0, 1.0 / 30.0, (0.0, 0.0)
    for _ in range(2000):
        s, kappa, psi, dh, eps = written.terms(t, delta4, delta3)
        assert block.terms(t, delta4, delta3) == (
            tuple(s), tuple(kappa), tuple(psi), tuple(dh), (eps, eps)
        )  # fmt: skip
        if rng.random() < 0.8:  # not while an output is saturated
            written.advance(dh, dt)
            block.advance(dt)
            delta4 = tuple(a + b * dt for a, b in zip(delta4, delta3, strict=True))
        delta3 = tuple(0.98 * d + rng.gauss(0, 0.3) for d in delta3)
        t += dt


def test_output_is_what_the_terms_say():
    """The output is -kappa - k s/(||s|| + eps) of the same terms."""
    block = control.AsgIsm(k=[3.0, 3.0], eps_min=[0.1], mu0_s=1.0, sigma=0.3)
    block.reset((0.4, -0.2), (1.0, 0.5))
    s, kappa, _, _, eps = block.terms(0.5, (0.6, -0.1), (0.7, 0.9))
    wide = math.hypot(*s) + eps[0]
    want = [-k - 3.0 * x / wide for k, x in zip(kappa, s, strict=True)]
    got = block.output(0.5, (0.6, -0.1), (0.7, 0.9), 0.01)
    assert all(math.isclose(a, b, rel_tol=1e-12) for a, b in zip(got, want, strict=True))
