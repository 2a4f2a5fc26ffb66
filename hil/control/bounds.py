"""What the theory promises of the averaged sub-gradient law: gain, layer, bound of the cost.

sigma = 1 and SI units throughout; equation numbers are those of the thesis, with 1/(1 - alpha) in
(4.21), (4.22) and (4.25), where 1/(1 + alpha) is printed: the integral of (t + mu0)^-alpha.
"""

from __future__ import annotations

import math
from collections.abc import Sequence


def gain(disturbance: float, k0: float) -> float:
    """Return k = 2 (D + k0) (4.14) for a bound D of the unmodelled part of dq/dt."""
    return 2.0 * (disturbance + k0)


def disturbance_bound(
    gamma: tuple[float, float, float], position: Sequence[float], velocity: Sequence[float]
) -> float:
    """Return gamma0 + gamma1 ||position|| + gamma2 ||velocity|| (4.8)."""
    return gamma[0] + gamma[1] * math.hypot(*position) + gamma[2] * math.hypot(*velocity)


def layer(t_s: float, eps0: float, mu0_s: float, alpha: float) -> float:
    """Return eps(t) = eps0/(t + mu0)^(1 + alpha) (4.20); it shrinks."""
    return float(eps0 / (t_s + mu0_s) ** (1.0 + alpha))


def layer_share(
    t_s: float, t0_s: float, *, eps0: float, mu0_s: float, alpha: float, axes: int
) -> float:
    """Return what the layer adds to the bound of H (4.21) for `axes` axes, h_g = sqrt(axes)."""
    now, then = t_s + mu0_s, t0_s + mu0_s
    bracket = (now ** (1.0 - alpha) - then ** (1.0 - alpha)) / ((1.0 - alpha) * now)
    return float(math.sqrt(axes) * eps0 * bracket)


def cost_bound(
    t_s: float, p0: Sequence[float], q0: Sequence[float], *, eps0: float, mu0_s: float, alpha: float
) -> float:
    """Return the bound of H(p(t)) from t = 0 on, while ||s|| <= eps(t) (4.22), (4.25)."""
    eta2 = sum((p + mu0_s * q) ** 2 for p, q in zip(p0, q0, strict=True))
    omega = mu0_s * sum(abs(p) for p in p0) + 0.5 * eta2
    share = layer_share(t_s, 0.0, eps0=eps0, mu0_s=mu0_s, alpha=alpha, axes=len(p0))
    return omega / (t_s + mu0_s) + share


def amplitude(t_s: float, p0: float, q0: float, *, sigma: float, mu0_s: float) -> float:
    """Return the largest |p| on s = 0: (t + mu0) p swings undamped, y'' = -sigma sgn(y)."""
    energy = 0.5 * (p0 + mu0_s * q0) ** 2 + sigma * mu0_s * abs(p0)
    return energy / (sigma * (t_s + mu0_s))
