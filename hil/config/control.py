"""Configuration of the outer loop: rate, restrictions, gains of both laws, estimator, reference."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    Field,
    SerializeAsAny,
    ValidationInfo,
    WithJsonSchema,
    field_validator,
    model_validator,
)

from hil.config.base import OpenSection, Section, known_name, quantity
from hil.config.gains import Gains, GainSets
from hil.config.own_settings import BY_NAME_KEY, own_of, validated
from hil.core.errors import BadInput
from hil.core.registries import ESTIMATORS, OUTER_LAWS, REFERENCES
from hil.core.registry import Entry

# Where it is read, a file in its place is laid over the tuned set (hil/config/gain_file.py).
GainSetName = Annotated[
    Literal["tuned", "thesis"],
    WithJsonSchema(
        {"anyOf": [{"enum": ["tuned", "thesis"]}, {"type": "string", "pattern": r"\.toml$"}]}
    ),
]


OuterLawName = Annotated[str, known_name(OUTER_LAWS)]
EstimatorName = Annotated[str, known_name(ESTIMATORS)]


class OuterLimits(Section):
    """Restrictions on trajectory and control (8.11); both laws run under the same ones."""

    eta1_max_m_s: float = quantity(
        "m/s", "forward speed command; what the drive holds when sagging", 0.5, gt=0, le=5
    )
    theta_dot_max_rad_s: float = quantity(
        "rad/s", "turn rate command; skid steering scrubs beyond it", 2.5, gt=0, le=20
    )
    zeta_max_m_s2: float = quantity(
        "m/s^2", "zeta = d eta1/dt; keeps the wheels from slipping", 1.0, gt=0, le=50
    )
    v1_max_m_s3: float = quantity(
        "m/s^3", "v1 = d zeta/dt; zeta limit within 3 ticks", 10.0, gt=0, le=1e4
    )
    theta_ddot_max_rad_s2: float = quantity(
        "rad/s^2", "|u2|/d0; full turn rate within 6 ticks", 12.0, gt=0, le=1e4
    )
    approach_speed_m_s: float | None = quantity(
        "m/s", "most that the position error asks for", 0.4, gt=0, le=5
    )
    approach_accel_m_s2: float | None = quantity(
        "m/s^2", "most that the velocity error asks for", 1.0, gt=0, le=50
    )
    lambda_m_s: float = quantity("m/s", "damping of the inverse of B", 0.05, ge=1e-4, le=1)
    spin_decay_s: float = quantity("s", "a turn dies with it where B is damped", 0.2, gt=0, le=10)
    zeta_start_m_s2: float = quantity(
        "m/s^2", "start of zeta at standstill, where B is singular", 0.1, ge=0, le=5
    )
    turn_missing_rad_s: float | None = quantity(
        "rad/s",
        "turn missing, with a side at its motor's limit, at which forward speed gives way; none: never",
        1.0,
        gt=0,
        le=20,
    )
    let_go_rad_s: float | None = quantity(
        "rad/s",
        "wheel speed up to which a side driven with STALL_DUTY is let go; none: never",
        0.5,
        gt=0,
        le=20,
    )
    lead_s: float = quantity(
        "s", "lead of set-points; half the wheel lag, as noise grows", 0.03, ge=0, le=0.5
    )
    hold_enter_m: float = quantity(
        "m", "arrived: rest within; estimate's noise is 0.5 mm; 0 = never", 0.0025, ge=0, le=1
    )
    hold_leave_m: float = quantity(
        "m", "pushed away: start anew beyond; well above hold_enter_m", 0.006, gt=0, le=1
    )

    @model_validator(mode="after")
    def _leaves_beyond_entering(self) -> OuterLimits:
        if self.hold_leave_m < self.hold_enter_m:
            raise ValueError(
                f"hold_leave_m must be at least hold_enter_m = {self.hold_enter_m:g} m"
            )
        return self


class EstimatorConfig(Section):
    """What the estimator assumes of robot, camera and wheel loop."""

    wheel_lag_s: float = quantity(
        "s", "first-order lag of the wheel loop, for the prediction", 0.05, gt=0, le=0.5
    )
    sigma_accel_rad_s2: float = quantity(
        "rad/s^2", "wheel acceleration the lag model misses (1 sigma)", 6.0, gt=0, le=1e4
    )
    sigma_short_rad_s15: float = quantity(
        "rad/s^1.5", "random walk of the wheel loop's standing error", 0.5, gt=0, le=1e3
    )
    sigma_scale: float = quantity(
        "(ratio)", "prior 1 sigma of the distance and turn scales", 0.15, gt=0, le=1
    )
    sigma_d0_m: float = quantity(
        "m", "prior 1 sigma of d0: skid steering moves it about", 0.005, gt=0, le=0.1
    )
    d0_walk_m_rad05: float = quantity(
        "m/rad^0.5", "random walk of d0 over the angle turned", 3e-4, ge=0, le=0.1
    )
    slip_ratio: float = quantity("m^0.5", "random walk of odometry per path", 0.02, ge=0, le=1)
    drift_m_s05: float = quantity(
        "m/s^0.5", "position random walk at rest (pushed, floor uneven)", 5e-4, ge=0, le=1
    )
    drift_rad_s05: float = quantity("rad/s^0.5", "heading random walk at rest", 2e-3, ge=0, le=1)
    sigma_time_s: float = quantity(
        "s", "1 sigma of the tie between camera and board time", 0.003, ge=0, le=0.1
    )
    gate_chi2: float = quantity(
        "", "squared Mahalanobis gate on a pose; 3 dof at 99.9 %", 16.3, gt=0, le=1e6
    )
    reacquire_poses: int = quantity(
        "poses", "run of agreeing gated poses to believe", 5, ge=2, le=100
    )
    history_s: float = quantity(
        "s", "oldest exposure that can still be taken in", 1.0, gt=0.2, le=10
    )
    st_accel_m_s2: float = quantity(
        "m/s^2", "camera-only: L of the z1 differentiator", 0.5, gt=0, le=100
    )
    st_jerk_m_s3: float = quantity(
        "m/s^3", "camera-only: L of the z2 differentiator", 1.0, gt=0, le=1000
    )
    st_theta_ddot_rad_s2: float = quantity(
        "rad/s^2", "camera-only: L of the heading differentiator", 8.0, gt=0, le=1000
    )


class ReferenceConfig(OpenSection):
    """What a reference of some kind is made of; each kind's own model lies on this one."""

    kind: str = Field(description="kind of reference: a registered name or a file")

    @field_validator("kind")
    @classmethod
    def _as_registered(cls, kind: str) -> str:
        try:
            return REFERENCES.get(kind).name
        except BadInput as error:
            raise ValueError(str(error)) from None

    @classmethod
    def model_for(cls, tree: Any) -> type[BaseModel]:
        """Return the model of the kind that a table names; raises BadInput for an unknown one."""
        return REFERENCES.get(str(tree.get("kind", ""))).settings or cls

    @classmethod
    def models(cls) -> list[type[BaseModel]]:
        """Return the models of all kinds."""
        return [entry.settings for entry in REFERENCES.entries() if entry.settings is not None]


class PointReference(ReferenceConfig):
    """A desired point on the floor for the flat output, reached and held."""

    kind: Literal["point"] = Field("point", description="of this reference")
    x_m: float = quantity("m", "world X of z1*", 0.0, ge=-100, le=100)
    y_m: float = quantity("m", "world Y of z1*", 0.0, ge=-100, le=100)


class CircleReference(ReferenceConfig):
    """The circle (8.23): the centre of mass runs clockwise from (0, radius), z1* leads it by d0."""

    kind: Literal["circle"] = Field("circle", description="of this reference")
    radius_m: float = quantity("m", "radius of the circle", 8.0, gt=0, le=100, source="(8.23)")
    rate_rad_s: float = quantity(
        "rad/s", "angular rate of the circle", 0.1, gt=0, le=5, source="(8.23)"
    )
    d0_m: float = quantity("m", "offset of the flat output (2.31)", 0.03, gt=0, le=0.15)
    center_x_m: float = quantity("m", "world X of the centre", 0.0, ge=-100, le=100)
    center_y_m: float = quantity("m", "world Y of the centre", 0.0, ge=-100, le=100)


class WaypointReference(ReferenceConfig):
    """A smooth path through waypoints from rest to rest, three times differentiable in time."""

    kind: Literal["waypoints"] = Field("waypoints", description="of this reference")
    points_m: tuple[tuple[float, float], ...] = quantity(
        "m", "world (X, Y) that z1* passes, in order", min_length=2, max_length=200
    )
    speed_max_m_s: float = quantity("m/s", "bound on |d z1*/dt|", 0.3, gt=0, le=5)
    turn_rate_max_rad_s: float = quantity(
        "rad/s", "bound on the turn rate that the path asks for", 1.5, gt=0, le=20
    )


class StopsReference(ReferenceConfig):
    """Straight legs between points, each from rest to rest, with a pause at every point between."""

    kind: Literal["stops"] = Field("stops", description="of this reference")
    points_m: tuple[tuple[float, float], ...] = quantity(
        "m", "world (X, Y) at which z1* rests, in order", min_length=2, max_length=200
    )
    speed_max_m_s: float = quantity("m/s", "bound on |d z1*/dt|", 0.3, gt=0, le=5)
    pause_s: float = quantity("s", "rest at each point between two legs", 1.0, ge=0, le=60)


class ControlConfig(Section):
    """The outer loop of a scenario."""

    rate_hz: float = quantity("Hz", "outer tick; the camera's rate", 30.0, ge=1, le=200)
    outer: OuterLawName = Field("asg-ism", description="outer law")
    axes_rad: float = quantity(
        "rad", "turn of the world axes in which the law works", 0.0, ge=-3.15, le=3.15
    )
    estimator: EstimatorName = Field("fused", description="state estimator")
    estimator_settings: SerializeAsAny[BaseModel] = Field(
        default_factory=dict, validate_default=True, description="values of the estimator's own"
    )
    limits: OuterLimits = Field(default_factory=OuterLimits, description="restrictions, both laws")
    gain_set: GainSetName = Field(
        "tuned", description="set of gains in use, or a file that lies on tuned"
    )
    gains: GainSets = Field(default_factory=GainSets.from_files, description="the named sets")
    fusion: EstimatorConfig = Field(
        default_factory=EstimatorConfig, description="what the estimator assumes"
    )

    @field_validator("estimator_settings", mode="plain")
    @classmethod
    def _of_the_estimator(cls, table: Any, info: ValidationInfo) -> BaseModel:
        return validated(BY_NAME_KEY["control.estimator"], table, info)

    def own_settings_of(self, estimator: Entry) -> Any:
        """Return the settings of an estimator's own, None where they are not those of this one."""
        own = own_of(self.estimator_settings)
        return own if estimator.settings and isinstance(own, estimator.settings) else None

    @property
    def active_gains(self) -> Gains:
        """Return the gains in use."""
        return self.gains.tuned if self.gain_set == "tuned" else self.gains.thesis
