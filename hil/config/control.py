"""Configuration of the outer loop: rate, restrictions, gains of both laws, estimator, reference."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from hil.config.base import Section

OuterLawName = Literal["asg-ism", "pid"]
GainSetName = Literal["tuned", "thesis"]
EstimatorName = Literal["fused", "camera-only"]


class OuterLimits(Section):
    """Restrictions on trajectory and control (8.11); both laws run under the same ones."""

    eta1_max_m_s: float = Field(
        0.5, gt=0, le=5, description="m/s, forward speed command; what the drive holds when sagging"
    )
    theta_dot_max_rad_s: float = Field(
        2.5, gt=0, le=20, description="rad/s, turn rate command; skid steering scrubs beyond it"
    )
    zeta_max_m_s2: float = Field(
        1.0, gt=0, le=50, description="m/s^2, zeta = d eta1/dt; keeps the wheels from slipping"
    )
    v1_max_m_s3: float = Field(
        10.0, gt=0, le=1e4, description="m/s^3, v1 = d zeta/dt; zeta limit within 3 ticks"
    )
    theta_ddot_max_rad_s2: float = Field(
        12.0, gt=0, le=1e4, description="rad/s^2, |u2|/d0; full turn rate within 6 ticks"
    )
    approach_speed_m_s: float | None = Field(
        0.4, gt=0, le=5, description="m/s, most that the position error asks for"
    )
    approach_accel_m_s2: float | None = Field(
        1.0, gt=0, le=50, description="m/s^2, most that the velocity error asks for"
    )
    lambda_m_s: float = Field(0.05, ge=1e-4, le=1, description="m/s, damping of the inverse of B")
    spin_decay_s: float = Field(
        0.2, gt=0, le=10, description="s, a turn dies with it where B is damped"
    )
    zeta_start_m_s2: float = Field(
        0.1, ge=0, le=5, description="m/s^2, start of zeta at standstill, where B is singular"
    )
    lead_s: float = Field(
        0.03, ge=0, le=0.5, description="s, lead of set-points; half the wheel lag, as noise grows"
    )
    hold_enter_m: float = Field(
        0.0025,
        ge=0,
        le=1,
        description="m, arrived: rest within; estimate's noise is 0.5 mm; 0 = never",
    )
    hold_leave_m: float = Field(
        0.006, gt=0, le=1, description="m, pushed away: start anew beyond; well above hold_enter_m"
    )


class AsgIsmGains(Section):
    """Gains of backstepping with ASG-ISM (8.6)-(8.22), corrected as in docs/control.md."""

    k1_s: float = Field(gt=0, le=100, description="1/s at p = 1, position error to speed")
    k2_s: float = Field(gt=0, le=100, description="1/s at p = 1, speed error to acceleration")
    p: float = Field(1.0, ge=1, le=3, description="exponent 1 + epsilon of (8.6), (8.11)")
    alpha_m_s3: float = Field(ge=0, le=1e4, description="m/s^3, gain of the sliding term")
    eps0_m_s2: float = Field(0.0, ge=0, le=100, description="m/s^2, layer eps0/(t+mu0)^(1+beta)")
    beta: float = Field(0.5, gt=0, lt=1, description="rate at which the layer shrinks, (4.20)")
    eps_min_m_s2: float = Field(gt=0, le=100, description="m/s^2, floor of the layer")
    mu0_s: float = Field(gt=0, le=100, description="s, mu = 1/(t + mu0)")
    sigma_m_s2: float = Field(ge=0, le=100, description="m/s^2, scale of the cost H in Psi")


class PidGains(Section):
    """Gains of the state feedback in PID form on the linearised chain (docs/control.md section 1)."""

    kp_s3: float = Field(gt=0, le=1e6, description="1/s^3, on delta1")
    ki_s4: float = Field(0.0, ge=0, le=1e6, description="1/s^4, on the integral of delta1")
    kd1_s2: float = Field(gt=0, le=1e6, description="1/s^2, on d delta1/dt")
    kd2_s: float = Field(gt=0, le=1e4, description="1/s, on d2 delta1/dt2")


class Gains(Section):
    """The gains of both laws, as one named set; `origin` says where they come from."""

    asg_ism: AsgIsmGains = Field(description="gains of asg-ism")
    pid: PidGains = Field(description="gains of pid")
    origin: dict[str, str | int | float] = Field(
        default_factory=dict, description="procedure, budget, seed, cost, revision; or the source"
    )


class GainSets(Section):
    """The named sets of hil/data/gains; values given in a scenario are laid over those files."""

    tuned: Gains = Field(description="found by `hil.study.tune`, the same budget for both laws")
    thesis: Gains = Field(description="table 8.2 as read in docs/control.md")

    @model_validator(mode="before")
    @classmethod
    def _over_files(cls, given: object) -> object:
        if not isinstance(given, dict):
            return given
        known = {name: read_gain_set(name) for name in cls.model_fields}
        return _laid_over(known, given)

    @classmethod
    def from_files(cls) -> GainSets:
        """Return the sets as they ship."""
        return cls.model_validate({})


def read_gain_set(name: str) -> dict[str, Any]:
    """Return the tables of a gain file that ships with the package."""
    text = (files("hil") / "data" / "gains" / f"{name}.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def _laid_over(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """Return `below` with the keys of `above` over it, table by table."""
    result = dict(below)
    for key, value in above.items():
        old = result.get(key)
        if isinstance(old, dict) and isinstance(value, dict):
            result[key] = _laid_over(old, value)
        else:
            result[key] = value
    return result


class EstimatorConfig(Section):
    """What the estimator assumes of robot, camera and wheel loop."""

    wheel_lag_s: float = Field(
        0.05, gt=0, le=0.5, description="s, first-order lag of the wheel loop, for the prediction"
    )
    sigma_accel_rad_s2: float = Field(
        6.0, gt=0, le=1e4, description="rad/s^2, wheel acceleration the lag model misses (1 sigma)"
    )
    sigma_short_rad_s15: float = Field(
        0.5, gt=0, le=1e3, description="rad/s^1.5, random walk of the wheel loop's standing error"
    )
    sigma_scale: float = Field(
        0.15, gt=0, le=1, description="ratio, prior 1 sigma of the distance and turn scales"
    )
    sigma_d0_m: float = Field(
        0.005, gt=0, le=0.1, description="m, prior 1 sigma of d0: skid steering moves it about"
    )
    d0_walk_m_rad05: float = Field(
        3e-4, ge=0, le=0.1, description="m/rad^0.5, random walk of d0 over the angle turned"
    )
    slip_ratio: float = Field(
        0.02, ge=0, le=1, description="m^0.5, random walk of odometry per path"
    )
    drift_m_s05: float = Field(
        5e-4, ge=0, le=1, description="m/s^0.5, position random walk at rest (pushed, floor uneven)"
    )
    drift_rad_s05: float = Field(
        2e-3, ge=0, le=1, description="rad/s^0.5, heading random walk at rest"
    )
    sigma_time_s: float = Field(
        0.003, ge=0, le=0.1, description="s, 1 sigma of the tie between camera and board time"
    )
    gate_chi2: float = Field(
        16.3, gt=0, le=1e6, description="squared Mahalanobis gate on a pose; 3 dof at 99.9 %"
    )
    reacquire_poses: int = Field(
        5, ge=2, le=100, description="run of agreeing gated poses to believe"
    )
    history_s: float = Field(
        1.0, gt=0.2, le=10, description="s, oldest exposure that can still be taken in"
    )
    st_accel_m_s2: float = Field(
        0.5, gt=0, le=100, description="m/s^2, camera-only: L of the z1 differentiator"
    )
    st_jerk_m_s3: float = Field(
        1.0, gt=0, le=1000, description="m/s^3, camera-only: L of the z2 differentiator"
    )
    st_theta_ddot_rad_s2: float = Field(
        8.0, gt=0, le=1000, description="rad/s^2, camera-only: L of the heading differentiator"
    )


class PointReference(Section):
    """A desired point on the floor for the flat output, reached and held."""

    kind: Literal["point"] = "point"
    x_m: float = Field(0.0, ge=-100, le=100, description="m, world X of z1*")
    y_m: float = Field(0.0, ge=-100, le=100, description="m, world Y of z1*")


class CircleReference(Section):
    """The circle (8.23): the centre of mass runs clockwise from (0, radius), z1* leads it by d0."""

    kind: Literal["circle"] = "circle"
    radius_m: float = Field(8.0, gt=0, le=100, description="m, (8.23)")
    rate_rad_s: float = Field(0.1, gt=0, le=5, description="rad/s, (8.23)")
    d0_m: float = Field(0.03, gt=0, le=0.15, description="m, offset of the flat output (2.31)")
    center_x_m: float = Field(0.0, ge=-100, le=100, description="m, world X of the centre")
    center_y_m: float = Field(0.0, ge=-100, le=100, description="m, world Y of the centre")


class WaypointReference(Section):
    """A smooth path through waypoints from rest to rest, three times differentiable in time."""

    kind: Literal["waypoints"] = "waypoints"
    points_m: tuple[tuple[float, float], ...] = Field(
        min_length=2, max_length=200, description="m, world (X, Y) that z1* passes, in order"
    )
    speed_max_m_s: float = Field(0.3, gt=0, le=5, description="m/s, bound on |d z1*/dt|")
    turn_rate_max_rad_s: float = Field(
        1.5, gt=0, le=20, description="rad/s, bound on the turn rate that the path asks for"
    )


ReferenceConfig = Annotated[
    PointReference | CircleReference | WaypointReference, Field(discriminator="kind")
]


class ControlConfig(Section):
    """The outer loop of a scenario."""

    rate_hz: float = Field(30.0, ge=1, le=200, description="Hz, outer tick; the camera's rate")
    outer: OuterLawName = Field("asg-ism", description="outer law")
    estimator: EstimatorName = Field("fused", description="state estimator")
    limits: OuterLimits = Field(default_factory=OuterLimits, description="restrictions, both laws")
    gain_set: GainSetName = Field("tuned", description="set of gains in use")
    gains: GainSets = Field(default_factory=GainSets.from_files, description="the named sets")
    fusion: EstimatorConfig = Field(
        default_factory=EstimatorConfig, description="what the estimator assumes"
    )

    @property
    def active_gains(self) -> Gains:
        """Return the gains in use."""
        return self.gains.tuned if self.gain_set == "tuned" else self.gains.thesis
