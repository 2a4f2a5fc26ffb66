"""The linearised chain (2.35)-(2.36) and its damped inverse: what both outer laws stand on.

World frame, SI. e = [cos theta, sin theta] is the heading, n = [-sin theta, cos theta] the left
lateral direction, w = theta_dot = -eta2 / d0. In this split the third derivative of the flat output

    z_dddot = A + B v    is    jerk_e = v1 - eta1 w^2,    jerk_n = 2 zeta w + eta1 w_dot

so that A and B need no matrices; tests prove it against the closed form of docs/control.md section 1.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from hil.config.control import OuterLimits
    from hil.core.types import Estimate, Vec2


class ChainState(NamedTuple):
    """z2 and z3 in world axes, with the heading and body rates they were formed from."""

    z2: Vec2
    z3: Vec2
    cos: float
    sin: float
    eta1: float
    w: float
    limited: bool = False  # a side of the robot stands at its motor's limit


class ChainCommand(NamedTuple):
    """What the inverse made of a wanted jerk: inputs v1 and w_dot, and the bounded set-points."""

    v1: float
    w_dot: float
    zeta: float
    eta1: float
    w: float
    saturated: bool


def clip(value: float, limit: float) -> float:
    """Return `value` bounded to [-limit, limit]."""
    return limit if value > limit else -limit if value < -limit else value


def damped_inverse(
    jerk_e: float,
    jerk_n: float,
    *,
    eta1: float,
    w: float,
    zeta: float,
    w_dot_rest: float,
    lambda_m_s: float,
) -> tuple[float, float]:
    """Return (v1, w_dot) that give the wanted jerk, regularised where det B = -eta1/d0 vanishes.

    w_dot minimises (eta1 w_dot - r)^2 + lambda^2 (w_dot - w_dot_rest)^2, r = jerk_n - 2 zeta w: the
    exact inverse at speed, and `w_dot_rest` at standstill, where the plain damped inverse
    det/(det^2 + lambda^2) would leave a turn standing.
    """
    lam2 = lambda_m_s * lambda_m_s
    w_dot = (eta1 * (jerk_n - 2.0 * zeta * w) + lam2 * w_dot_rest) / (eta1 * eta1 + lam2)
    return jerk_e + eta1 * w * w, w_dot


class Chain:
    """The dynamic extension: integrates v to set-points under the restrictions.

    zeta (d eta1/dt) is the only state of the linearisation; the set-points eta1_ref and
    theta_dot_ref are what the board is asked for. Each is bounded, and stops growing at its bound.
    """

    def __init__(self, limits: OuterLimits) -> None:
        self._limits = limits
        self.zeta = 0.0
        self._eta1_ref = 0.0
        self._w_ref = 0.0

    def reset(
        self, estimate: Estimate, towards: Vec2, zeta_start_m_s2: float | None = None
    ) -> None:
        """Start from the estimated speeds; at standstill zeta starts along `towards` (world).

        It starts at `zeta_start_m_s2`, or at what the limits say where that is None.
        """
        limits = self._limits
        theta = estimate.pose.theta_rad
        self._eta1_ref = clip(estimate.eta1_m_s, limits.eta1_max_m_s)
        self._w_ref = clip(estimate.theta_dot_rad_s, limits.theta_dot_max_rad_s)
        self.zeta = 0.0
        if abs(estimate.eta1_m_s) < limits.lambda_m_s:
            ahead = math.cos(theta) * towards[0] + math.sin(theta) * towards[1]
            start = limits.zeta_start_m_s2 if zeta_start_m_s2 is None else zeta_start_m_s2
            self.zeta = math.copysign(start, ahead)

    def state(self, estimate: Estimate) -> ChainState:
        """Return z2, z3 from the estimate; z3 from zeta unless the estimator observes it."""
        theta = estimate.pose.theta_rad
        cos, sin = math.cos(theta), math.sin(theta)
        eta1, w = estimate.eta1_m_s, estimate.theta_dot_rad_s
        z3 = estimate.z3_m_s2
        if z3 is None:
            lateral = eta1 * w
            z3 = (cos * self.zeta - sin * lateral, sin * self.zeta + cos * lateral)
        return ChainState(estimate.z2_m_s, z3, cos, sin, eta1, w, estimate.sides_at_limit != (0, 0))

    def command(self, jerk: Vec2, state: ChainState, dt_s: float) -> ChainCommand:
        """Invert the wanted jerk (world) and integrate it over dt_s to bounded set-points."""
        limits = self._limits
        zeta = self.zeta
        v1_free, w_dot_free = damped_inverse(
            state.cos * jerk[0] + state.sin * jerk[1],
            state.cos * jerk[1] - state.sin * jerk[0],
            eta1=state.eta1,
            w=state.w,
            zeta=zeta,
            # The set-point decays, not the turn rate seen: a wheel that sticks shall not wind it up.
            w_dot_rest=-self._w_ref / limits.spin_decay_s,
            lambda_m_s=limits.lambda_m_s,
        )
        v1 = clip(v1_free, limits.v1_max_m_s3)
        w_dot = clip(w_dot_free, limits.theta_ddot_max_rad_s2)
        zeta_free = zeta + v1 * dt_s
        zeta_next = clip(zeta_free, limits.zeta_max_m_s2)
        eta1_free = self._eta1_ref + zeta_next * dt_s
        eta1 = clip(eta1_free, limits.eta1_max_m_s)
        w_free = self._w_ref + w_dot * dt_s
        w = clip(w_free, limits.theta_dot_max_rad_s)
        saturated = (
            v1 != v1_free
            or w_dot != w_dot_free
            or zeta_next != zeta_free
            or eta1 != eta1_free
            or w != w_free
            or state.limited
        )
        # At the speed limit the robot does not accelerate: zeta says so, else z3 is a fiction.
        self.zeta = 0.0 if eta1 != eta1_free else zeta_next
        self._eta1_ref, self._w_ref = eta1, w
        lead = limits.lead_s
        return ChainCommand(
            v1,
            w_dot,
            zeta,
            clip(eta1 + lead * self.zeta, limits.eta1_max_m_s),
            clip(w + lead * (w_dot if w == w_free else 0.0), limits.theta_dot_max_rad_s),
            saturated,
        )


def executed_jerk(state: ChainState, out: ChainCommand, zeta_next: float, dt_s: float) -> Vec2:
    """Return the jerk (world) that a command makes of the model once the limits have had their say.

    `zeta_next` is the chain's zeta after it: what v1 was worth.
    """
    along = (zeta_next - out.zeta) / dt_s - state.eta1 * state.w * state.w
    across = 2.0 * out.zeta * state.w + state.eta1 * out.w_dot
    return (
        state.cos * along - state.sin * across,
        state.sin * along + state.cos * across,
    )


def restrict(value: Vec2, rate: Vec2, accel: Vec2, limit: float | None) -> tuple[Vec2, Vec2, Vec2]:
    """Bound a vector's length smoothly, with its first two time derivatives.

    g = q x with q = 1/sqrt(1 + |x|^2/limit^2): identity near zero, length below `limit` far out,
    direction kept, and consistent derivatives (q' = -q^3 x.x'/limit^2), so that a backstepping
    stage above it stays exact.
    """
    if limit is None:
        return value, rate, accel
    (x, y), (xd, yd), (xdd, ydd) = value, rate, accel
    inv2 = 1.0 / (limit * limit)
    q = 1.0 / math.sqrt(1.0 + (x * x + y * y) * inv2)
    q3 = q * q * q * inv2
    dot = x * xd + y * yd
    qd = -q3 * dot
    qdd = 3.0 * q3 * q * q * inv2 * dot * dot - q3 * (xd * xd + yd * yd + x * xdd + y * ydd)
    return (
        (q * x, q * y),
        (qd * x + q * xd, qd * y + q * yd),
        (qdd * x + 2.0 * qd * xd + q * xdd, qdd * y + 2.0 * qd * yd + q * ydd),
    )


def authority(value: Vec2, limit: float | None) -> float:
    """Return how much of a change along `value` passes `restrict`: q^3, 1 inside and 0 far out.

    An integrator that acts through the restriction grows by this share, so that it does not wind up
    over an approach at the speed limit.
    """
    if limit is None:
        return 1.0
    q = 1.0 / math.sqrt(1.0 + (value[0] * value[0] + value[1] * value[1]) / (limit * limit))
    return q * q * q
