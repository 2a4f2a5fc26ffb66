"""The default estimator and its parts, compiled from hil/control/estimators/native.

SI units, radians, host times in s. World X right, Y up; body x forward, y left; theta counter-clockwise
and unwrapped. z1 is the flat output point, d0 ahead of the centre of mass.
"""

from collections.abc import Sequence

Matrix = list[list[float]]
"""6 x 6, over [z1_x, z1_y, theta, k_d, k_t, d0]."""
Piece = tuple[float, float, float]
"""A piece of constant command: duration in s, left and right wheel speed in rad/s."""
State = tuple[float, float, float, float, float, tuple[float, float], tuple[float, float]]
"""x_m, y_m, theta_rad of the centre of mass, eta1_m_s, theta_dot_rad_s, z1_m, z2_m_s."""

ASSUMPTIONS: tuple[str, ...]
"""Names of the attributes of Assumptions."""

class Assumptions:
    """What hil.config.control.EstimatorConfig says; the names in ASSUMPTIONS, all 0 at first."""

    def __setattr__(self, name: str, value: float, /) -> None: ...
    def __getattr__(self, name: str, /) -> float: ...

def wrap_pi(angle_rad: float) -> float:
    """Return the angle wrapped to [-pi, pi), as hil.core.types.wrap_pi does."""

def counts_between(old: int, new: int) -> int:
    """Return new - old of a signed 32-bit counter that may have wrapped in between."""

class Geometry:
    """The robot as the host believes it to be (hil.control.estimators.BelievedGeometry)."""

    def __init__(
        self,
        wheel_radius_m: float,
        track_width_m: float,
        d0_m: float,
        rad_per_count: float,
        omega_max_rad_s: float = 40.0,
    ) -> None: ...
    def body(self, left: float, right: float) -> tuple[float, float]:
        """Return (forward, turn) of a pair of wheel angles or speeds: m and rad, or per s."""

class CommandHistory:
    """Wheel speeds commanded, each from its time of effect on; at rest before the first."""

    def __init__(self) -> None: ...
    def add(self, t_s: float, left_rad_s: float, right_rad_s: float) -> None:
        """Add a command; one that takes effect before an earlier one replaces it."""

    def forget_before(self, t_s: float) -> None:
        """Drop what was superseded before t_s."""

    def segments(self, t0_s: float, t1_s: float) -> list[Piece]:
        """Return the constant pieces between two times, in order."""

class WheelSpeeds:
    """Both wheel speeds by a Kalman filter on the counts, with the wheel loop's lag as the model."""

    def __init__(
        self, lag_s: float, sigma_accel_rad_s2: float, sigma_short_rad_s15: float, unit_rad: float
    ) -> None: ...
    def restart(self) -> None:
        """Forget what was learned: at the start, and when the counters have jumped."""

    def ahead(self, pieces: list[Piece]) -> tuple[float, float, float, float]:
        """Return angles turned under the commands `pieces` and final speeds (left, right each)."""

    def step(self, dt_s: float, turned_rad: tuple[float, float], pieces: list[Piece]) -> None:
        """Take the angles turned (left and right) in dt_s under the commands `pieces`."""

    @property
    def omega_rad_s(self) -> tuple[float, float]:
        """Speeds (left, right) at the latest report."""

class PoseFilter:
    """Extended Kalman filter of [z1_x, z1_y, theta, k_d, k_t, d0] at one instant."""

    def __init__(self, assumptions: Assumptions, d0_m: float) -> None: ...
    def place(
        self, x_m: float, y_m: float, theta_rad: float, sigma_xy_m: float, sigma_theta_rad: float
    ) -> None:
        """Start at a pose; scales and d0 keep what is known of them, theta stays unwrapped."""

    def move(
        self, dt_s: float, forward_m: float, turn_rad: float, length_m: float, angle_rad: float
    ) -> None:
        """Carry mean and covariance over one increment of odometry (believed units).

        `length_m` and `angle_rad` are distance and turn with all signs positive: noise grows with
        what was travelled, not with the net of it.
        """

    def innovation(self, x_m: float, y_m: float, theta_rad: float) -> tuple[float, float, float]:
        """Return the pose seen minus the pose expected (m, m, rad)."""

    def correct(
        self,
        innovation: tuple[float, float, float],
        var_xy: float,
        var_theta: float,
        gate: float,
        excess: Sequence[float] = ...,
    ) -> bool:
        """Take the innovation unless its squared Mahalanobis distance exceeds `gate`.

        `excess` (xx, xy, xt, yy, yt, tt) is the measurement's covariance less the two variances.
        """

    @property
    def x(self) -> list[float]:
        """Mean."""

    @property
    def P(self) -> Matrix:  # noqa: N802 - the matrix keeps its capital
        """Covariance."""

class Fused:
    """The default estimator; hil.control.estimators.fused.Fused is it with the types of hil/core/types.py."""

    def __init__(self, assumptions: Assumptions, geometry: Geometry) -> None: ...
    def take_command(self, t_effect_s: float, left_rad_s: float, right_rad_s: float) -> None:
        """Take wheel speeds commanded to be in effect from `t_effect_s` on."""

    def take_wheels(self, t_host_s: float, counts_left: int, counts_right: int) -> None:
        """Take one wheel report (in time order; a stale one is dropped). Counts are int32."""

    def expect(self, excess: Sequence[float]) -> None:
        """Take (xx, xy, xt, yy, yt, tt), the covariance of poses to come less their two sigmas'."""

    def take_pose(
        self,
        t_exposure_s: float,
        x_m: float,
        y_m: float,
        theta_rad: float,
        sigma_xy_m: float,
        sigma_theta_rad: float,
    ) -> bool:
        """Take the pose seen at `t_exposure_s` in the past; older than the last one is dropped.

        Return whether it was believed.
        """

    def state_at(self, t_host_s: float) -> State | None:
        """Return the state at `t_host_s`, past the last exposure; None before the first pose."""

    def pose_age_s(self, t_host_s: float) -> float:
        """Return the time since the last exposure that was believed; inf before the first.

        Believed: passed the gate, or ended a run of refused poses that agree with each other.
        """

    def agreement_age_s(self, t_host_s: float) -> float:
        """Return the time since a pose last agreed with the wheels (passed the gate); inf before."""

    @property
    def refused(self) -> tuple[float, float, float]:
        """The last pose refused minus the pose expected then (m, m, rad); zero before the first."""

    @property
    def covariance(self) -> Matrix:
        """Covariance of [z1_x, z1_y, theta, k_d, k_t, d0] at the last exposure."""

    @property
    def scales(self) -> tuple[float, float]:
        """(k_d, k_t): true over believed distance and turn of the same wheel counts."""

    @property
    def d0_m(self) -> float:
        """How far the point without lateral speed lies ahead of the centre of mass."""

    @property
    def gated_total(self) -> int:
        """Poses refused since the start."""
