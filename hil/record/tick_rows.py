"""The rows of the run record, composed in the order of hil/record/schema.py."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from hil.record.schema import trace_row

if TYPE_CHECKING:
    from hil.core.rig import Frame, Truth
    from hil.core.types import Estimate, OuterCommand, PoseMeasurement, Vec2
    from hil.wire.link import BoardLink, WheelReport

_NAN = math.nan
COVARIANCE = (
    "cov_xx_m2", "cov_xy_m2", "cov_xt_m_rad", "cov_yy_m2", "cov_yt_m_rad", "cov_tt_rad2",
)  # fmt: skip
MARKS = ("front_u_px", "front_v_px", "rear_u_px", "rear_v_px")
_NO_ESTIMATE = (_NAN,) * 5
_NO_REPORT = (_NAN,) * 6
_NO_MARKS = (_NAN,) * len(MARKS)
_NO_COVARIANCE = (_NAN,) * len(COVARIANCE)


def sample_row(
    *,
    t_s: float,
    estimate: Estimate | None,
    truth: Truth | None,
    goal_m: Vec2,
    command: OuterCommand,
    wheels_rad_s: Vec2,
    report: WheelReport | None,
    latency: tuple[float, float, float, float, float],
    link: BoardLink,
    late: bool,
    own_terms: Sequence[str] = (),
) -> tuple[float, ...]:
    """Return one outer tick in the order of schema.SAMPLE_NAMES; NaN for what is not known.

    `latency` is (pose seen since the last tick, pose accepted since then, quality of the newest,
    exposure to host in s, exposure to actuation in s). The terms of the trace named in `own_terms` follow, in
    their order.
    """
    return (
        t_s,
        *(_motion(estimate) if estimate else _NO_ESTIMATE),
        *(_motion(truth) if truth else _NO_ESTIMATE),
        *goal_m,
        *(_error(estimate.z1_m, goal_m) if estimate else (_NAN, _NAN)),
        *(_error(truth.z1_m, goal_m) if truth else (_NAN, _NAN)),
        *trace_row(command.trace),
        command.eta1_m_s,
        command.theta_dot_rad_s,
        *wheels_rad_s,
        *(_wheels(report) if report else _NO_REPORT),
        link.battery_v,
        *latency,
        link.clock.rtt_s,
        link.clock.sigma_s,
        link.counters.lost,
        late,
        *[command.trace.get(name, _NAN) for name in own_terms],
    )


def _motion(state: Estimate | Truth) -> tuple[float, float, float, float, float]:
    pose = state.pose
    return pose.x_m, pose.y_m, pose.theta_rad, state.eta1_m_s, state.theta_dot_rad_s


def _error(z1_m: Vec2, goal_m: Vec2) -> Vec2:
    return z1_m[0] - goal_m[0], z1_m[1] - goal_m[1]


def _wheels(report: WheelReport) -> tuple[float, ...]:
    """Return measured speeds, PWM and wheel sliding variables (left, right each)."""
    wire = report.wire
    return (
        wire.omega_left_rad_s,
        wire.omega_right_rad_s,
        wire.pwm_left_counts,
        wire.pwm_right_counts,
        wire.s_left,
        wire.s_right,
    )


def frame_row(
    frame: Frame, t_arrival_s: float, t_exposure_s: float, measurement: PoseMeasurement
) -> tuple[float, ...]:
    """Return one camera frame in the order of schema.FRAME_NAMES."""
    pose, details = measurement.pose, measurement.details
    return (
        t_arrival_s,
        t_exposure_s,
        frame.t_cam_s,
        frame.index,
        pose is not None,
        *((pose.x_m, pose.y_m, pose.theta_rad) if pose else (_NAN, _NAN, _NAN)),
        measurement.quality,
        measurement.sigma_xy_m,
        measurement.sigma_theta_rad,
        *(measurement.covariance or _NO_COVARIANCE),
        *(tuple([details.get(name, _NAN) for name in MARKS]) if details else _NO_MARKS),
    )
