"""The numerical evaluation of section 8.9: an outer law on the linearised model, ideal sensing.

The plant is (2.30), (2.34) after the model compensation: eta1_dot = zeta + xi1, eta2_dot = u2 + xi2,
theta_dot = -eta2/d0; no delay, no noise, no wheel loop. World frame, SI. Between control steps the
law's inputs v1, u2 are held, zeta is their exact ramp, and the plant is stepped by RK4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hil.config.control import CircleReference, OuterLimits
from hil.config.gains import make_gains
from hil.control.laws.making import make_outer_law
from hil.control.references import make_reference
from hil.core.types import Estimate, Pose, Vec2

if TYPE_CHECKING:
    from hil.config.control import ReferenceConfig
    from hil.core.types import OuterLaw

State = tuple[float, float, float, float, float]  # X, Y, theta, eta1, eta2

# Section 8.9 as in docs/control.md section 6. K places the poles of the state feedback at -2, -4
# (the k1, k2 of the backstepping stages) and -4.
CIRCLE_LAYER_M_S2 = 0.02
CIRCLE_GAINS = make_gains(
    {
        "asg_ism": {
            "k1_s": 2, "k2_s": 4, "alpha_m_s3": 4, "eps0_m_s2": 0, "eps_min_m_s2": CIRCLE_LAYER_M_S2,
            "mu0_s": 1, "sigma_m_s2": 0.05,
        },
        "pid": {"kp_s3": 32, "ki_s4": 0, "kd1_s2": 32, "kd2_s": 10},
    }
)  # fmt: skip
# Restrictions out of the way: the evaluation has none, and eta1 stays far from 0.
CIRCLE_LIMITS = OuterLimits(
    eta1_max_m_s=5,
    theta_dot_max_rad_s=20,
    zeta_max_m_s2=50,
    v1_max_m_s3=1e4,
    theta_ddot_max_rad_s2=1e4,
    approach_speed_m_s=None,
    approach_accel_m_s2=None,
    lambda_m_s=1e-4,
    lead_s=0,
)
# X, Y, theta, eta1, eta2: 50 mm off the circle's start in X and in Y, heading theta*(0) = 0, and
# the circle's own speed and turn rate. The first sentence of that is the case chosen, the rest follows.
CIRCLE_START: State = (0.05, 7.95, 0.0, 0.8, 0.03 * 0.1)


@dataclass(frozen=True, slots=True)
class Disturbances:
    """Matched disturbances xi1 = a1 sin(w1 t) on eta1_dot and xi2 = a2 sin(w2 t) on eta2_dot."""

    a1_m_s2: float = 0.1
    w1_rad_s: float = 3.0
    a2_m_s2: float = 0.05
    w2_rad_s: float = 2.0


NO_DISTURBANCE = Disturbances(0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, repr=False)
class IdealRun:
    """Signals of one run, one entry a control step; s and psi are NaN for a law without them.

    Printed, it shows its figures and not its thousands of entries.
    """

    t_s: list[float]
    z1_m: list[Vec2]
    z1_ref_m: list[Vec2]
    delta1_m: list[Vec2]
    s: list[Vec2]
    psi: list[Vec2]
    u: list[Vec2]  # (zeta in m/s^2, u2 in m/s^2)

    def __repr__(self) -> str:
        return (
            f"IdealRun({len(self.t_s)} steps to {self.t_s[-1]:.6g} s, ISE {self.ise_m2_s:.4g} m^2 s, "
            f"worst |delta1| of the last second {self.worst_m(1.0):.4g} m)"
        )

    @property
    def ise_m2_s(self) -> float:
        """Return the integral of |delta1|^2."""
        return (self.t_s[1] - self.t_s[0]) * sum(x * x + y * y for x, y in self.delta1_m)

    def worst_m(self, last_s: float) -> float:
        """Return the largest |delta1| of the last `last_s`."""
        begin = self.t_s[-1] - last_s
        return max(
            math.hypot(*d) for t, d in zip(self.t_s, self.delta1_m, strict=True) if t > begin
        )

    @property
    def s_norm_max_m_s2(self) -> float:
        """Return the largest ||s|| of the run."""
        return max(math.hypot(*s) for s in self.s)


def _rates(x: State, t_s: float, u: Vec2, d0_m: float, xi: Disturbances) -> State:
    """Return d/dt of the state."""
    _, _, theta, eta1, eta2 = x
    c, s = math.cos(theta), math.sin(theta)
    return (
        c * eta1 - s * eta2,
        s * eta1 + c * eta2,
        -eta2 / d0_m,
        u[0] + xi.a1_m_s2 * math.sin(xi.w1_rad_s * t_s),
        u[1] + xi.a2_m_s2 * math.sin(xi.w2_rad_s * t_s),
    )


def _moved(x: State, k: State, h_s: float) -> State:
    """Return x + h k."""
    return (
        x[0] + h_s * k[0],
        x[1] + h_s * k[1],
        x[2] + h_s * k[2],
        x[3] + h_s * k[3],
        x[4] + h_s * k[4],
    )


def _rk4(
    x: State, t_s: float, h_s: float, *, zeta: float, v: Vec2, d0_m: float, xi: Disturbances
) -> State:
    """Step the linearised model; `zeta` is its value at t_s and v = (v1, u2) is held."""
    v1, u2 = v
    half = 0.5 * h_s
    zeta_half, zeta_end = zeta + v1 * half, zeta + v1 * h_s
    a = _rates(x, t_s, (zeta, u2), d0_m, xi)
    b = _rates(_moved(x, a, half), t_s + half, (zeta_half, u2), d0_m, xi)
    c = _rates(_moved(x, b, half), t_s + half, (zeta_half, u2), d0_m, xi)
    d = _rates(_moved(x, c, h_s), t_s + h_s, (zeta_end, u2), d0_m, xi)
    x = _moved(x, a, h_s / 6.0)
    x = _moved(x, b, h_s / 3.0)
    x = _moved(x, c, h_s / 3.0)
    return _moved(x, d, h_s / 6.0)


def _perfect(t_s: float, x: State, d0_m: float, accel_m_s2: float | None = None) -> Estimate:
    """Return the true state as the estimate; with z3 where the true d eta1/dt is given."""
    c, s = math.cos(x[2]), math.sin(x[2])
    pose = Pose(x[0], x[1], x[2])
    z1 = (x[0] + d0_m * c, x[1] + d0_m * s)
    w = -x[4] / d0_m
    z3 = None
    if accel_m_s2 is not None:
        across = x[3] * w
        z3 = (c * accel_m_s2 - s * across, s * accel_m_s2 + c * across)
    return Estimate(t_s, pose, x[3], w, z1, (c * x[3], s * x[3]), z3)


def run_ideal(
    law: OuterLaw,
    reference_config: ReferenceConfig,
    start: State,
    *,
    d0_m: float = 0.03,
    duration_s: float = 80.0,
    step_s: float = 2e-3,
    disturbances: Disturbances = Disturbances(),
    give_up_m: float = 2.0,
    observed: bool = False,
) -> IdealRun:
    """Run the loop; ends early once |delta1| exceeds `give_up_m` (the loop has diverged).

    The law runs and the plant steps at `step_s`. 2e-3 s gives the figures of docs/control.md section 6,
    which were taken at 1e-4 s, to the digits printed there. With `observed` the law is given z3 as it is,
    disturbed; else it forms z3 from its own zeta.
    """
    reference = make_reference(reference_config)
    x = start
    run = IdealRun([], [], [], [], [], [], [])
    zeta = 0.0
    law.reset(reference.at(0.0), _perfect(0.0, x, d0_m))
    for index in range(round(duration_s / step_s)):
        t = index * step_s
        accel = zeta + disturbances.a1_m_s2 * math.sin(disturbances.w1_rad_s * t)
        wanted, estimate = reference.at(t), _perfect(t, x, d0_m, accel if observed else None)
        trace = law.step(wanted, estimate, step_s).trace
        z1, z1_ref = estimate.z1_m, wanted.z1_m
        delta1 = (z1[0] - z1_ref[0], z1[1] - z1_ref[1])
        run.t_s.append(t)
        run.z1_m.append(z1)
        run.z1_ref_m.append(z1_ref)
        run.delta1_m.append(delta1)
        run.s.append((trace["s_x"], trace["s_y"]))
        run.psi.append((trace["psi_x"], trace["psi_y"]))
        run.u.append((trace["zeta_m_s2"], trace["u2_m_s2"]))
        if abs(delta1[0]) + abs(delta1[1]) > give_up_m:
            break
        v = (trace["v1_m_s3"], trace["u2_m_s2"])
        zeta = trace["zeta_m_s2"] + v[0] * step_s
        x = _rk4(x, t, step_s, zeta=trace["zeta_m_s2"], v=v, d0_m=d0_m, xi=disturbances)
    return run


def run_circle(outer: str, disturbances: Disturbances = Disturbances()) -> IdealRun:
    """Run section 8.9 with the law `outer`, as in docs/control.md section 6 (80 s)."""
    config = CircleReference()
    law = make_outer_law(outer, CIRCLE_GAINS, CIRCLE_LIMITS, config.d0_m)
    return run_ideal(law, config, CIRCLE_START, d0_m=config.d0_m, disturbances=disturbances)
