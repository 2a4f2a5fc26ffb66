"""The columns of `samples.parquet` and `frames.parquet`, each declared once.

One row of samples is one outer tick; one row of frames is one camera frame that reached the host.
World frame, SI units, theta counter-clockwise and unwrapped; the unit stands in the name. A value
that does not exist (no truth on a real robot, no sliding variable under PID) is NaN in a row and
null in the file.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

SCHEMA_VERSION = 1

Kind = Literal["float64", "int32", "bool"]


@dataclass(frozen=True, slots=True)
class Column:
    """One signal: `group` is the plot it belongs to, `trace_key` the name a law's trace gives it."""

    name: str
    unit: str
    group: str
    meaning: str
    kind: Kind = "float64"
    trace_key: str = ""


def _pose(prefix: str, group: str, whose: str) -> tuple[Column, ...]:
    return (
        Column(f"{prefix}_x_m", "m", group, f"{whose} centre of mass, world X"),
        Column(f"{prefix}_y_m", "m", group, f"{whose} centre of mass, world Y"),
        Column(f"{prefix}_theta_rad", "rad", group, f"{whose} heading, unwrapped"),
        Column(f"{prefix}_eta1_m_s", "m/s", group, f"{whose} forward speed"),
        Column(f"{prefix}_theta_dot_rad_s", "rad/s", group, f"{whose} turn rate"),
    )


def _sides(name: str, unit_suffix: str, unit: str, meaning: str) -> tuple[Column, ...]:
    return tuple(
        Column(f"{name}_{side}_{unit_suffix}", unit, "wheels", f"{meaning}, {side} side")
        for side in ("left", "right")
    )


LAW_COLUMNS = (
    Column("z2_x_m_s", "m/s", "flat", "rate of the flat output z1, world X", trace_key="z2_x_m_s"),
    Column("z2_y_m_s", "m/s", "flat", "rate of the flat output z1, world Y", trace_key="z2_y_m_s"),
    Column("z3_x_m_s2", "m/s^2", "flat", "acceleration of z1, world X", trace_key="z3_x_m_s2"),
    Column("z3_y_m_s2", "m/s^2", "flat", "acceleration of z1, world Y", trace_key="z3_y_m_s2"),
    Column("s_x_m_s2", "m/s^2", "sliding", "sliding variable s (8.17), X", trace_key="s_x"),
    Column("s_y_m_s2", "m/s^2", "sliding", "sliding variable s (8.17), Y", trace_key="s_y"),
    Column("psi_x_m_s2", "m/s^2", "sliding", "averaged sub-gradient Psi, X", trace_key="psi_x"),
    Column("psi_y_m_s2", "m/s^2", "sliding", "averaged sub-gradient Psi, Y", trace_key="psi_y"),
    Column("zeta_m_s2", "m/s^2", "control", "u1: forward acceleration", trace_key="zeta_m_s2"),
    Column("v1_m_s3", "m/s^3", "control", "v1: rate of zeta", trace_key="v1_m_s3"),
    Column("u2_m_s2", "m/s^2", "control", "u2: rate of eta2 = -d0 theta_dot", trace_key="u2_m_s2"),
    Column("eps_m_s2", "m/s^2", "sliding", "boundary layer of the sliding term", trace_key="eps"),
    Column("in_layer", "", "sliding", "||s|| is at most eps", "bool", "in_layer"),
    Column("saturated", "", "control", "a limit held the command back", "bool", "saturated"),
)

SAMPLE_COLUMNS = (
    Column("t_s", "s", "time", "host time of the tick since the start of the controlled part"),
    *_pose("est", "estimate", "estimated"),
    *_pose("true", "truth", "true (simulated robots)"),
    Column("ref_z1_x_m", "m", "reference", "desired flat output z1*, world X"),
    Column("ref_z1_y_m", "m", "reference", "desired flat output z1*, world Y"),
    Column("delta1_x_m", "m", "error", "z1 - z1* from the estimate, world X"),
    Column("delta1_y_m", "m", "error", "z1 - z1* from the estimate, world Y"),
    Column("true_delta1_x_m", "m", "error", "z1 - z1* from the truth, world X"),
    Column("true_delta1_y_m", "m", "error", "z1 - z1* from the truth, world Y"),
    *LAW_COLUMNS,
    Column("eta1_cmd_m_s", "m/s", "command", "forward speed commanded"),
    Column("theta_dot_cmd_rad_s", "rad/s", "command", "turn rate commanded"),
    *_sides("omega_cmd", "rad_s", "rad/s", "wheel speed commanded"),
    *_sides("omega_meas", "rad_s", "rad/s", "wheel speed measured by the board"),
    *_sides("pwm", "counts", "counts", "PWM, positive is forward"),
    *_sides("wheel_s", "rad_s", "rad/s", "sliding variable of the wheel law"),
    Column("battery_v", "V", "power", "battery voltage measured by the board"),
    Column("pose_seen", "", "latency", "the localiser gave a pose since the last tick", "bool"),
    Column("pose_accepted", "", "latency", "the estimator believed one of them", "bool"),
    Column("pose_quality", "", "latency", "quality of the newest pose, 0 to 1"),
    Column("camera_latency_s", "s", "latency", "exposure to host of the newest frame"),
    Column("exposure_to_actuation_s", "s", "latency", "exposure to the command's effect"),
    Column("rtt_s", "s", "latency", "round trip of the newest time exchange with the board"),
    Column("clock_sigma_s", "s", "latency", "uncertainty of board time on the host clock"),
    Column("link_lost", "", "latency", "board frames missing so far, by sequence number", "int32"),
    Column("deadline_miss", "", "latency", "this tick began too late", "bool"),
)

FRAME_COLUMNS = (
    Column("t_arrival_s", "s", "time", "host time at which the frame was taken in"),
    Column("t_exposure_s", "s", "time", "middle of the exposure on the host clock"),
    Column("t_cam_s", "s", "time", "middle of the exposure on the camera's clock"),
    Column("index", "", "time", "running number of the camera; a gap is a dropped frame", "int32"),
    Column("seen", "", "pose", "the localiser gave a pose", "bool"),
    Column("x_m", "m", "pose", "centre of mass, world X"),
    Column("y_m", "m", "pose", "centre of mass, world Y"),
    Column("theta_rad", "rad", "pose", "heading"),
    Column("quality", "", "pose", "0 to 1"),
    Column("sigma_xy_m", "m", "pose", "standard deviation claimed for x and y"),
    Column("sigma_theta_rad", "rad", "pose", "standard deviation claimed for theta"),
    Column("cov_xx_m2", "m^2", "pose", "variance claimed for x; NaN where only sigmas are"),
    Column("cov_xy_m2", "m^2", "pose", "covariance claimed for x and y"),
    Column("cov_xt_m_rad", "m rad", "pose", "covariance claimed for x and theta"),
    Column("cov_yy_m2", "m^2", "pose", "variance claimed for y"),
    Column("cov_yt_m_rad", "m rad", "pose", "covariance claimed for y and theta"),
    Column("cov_tt_rad2", "rad^2", "pose", "variance claimed for theta"),
    Column("front_u_px", "px", "marks", "front mark (of a tag: its edge), image column"),
    Column("front_v_px", "px", "marks", "front mark (of a tag: its edge), image row"),
    Column("rear_u_px", "px", "marks", "rear mark (of a tag: its edge), image column"),
    Column("rear_v_px", "px", "marks", "rear mark (of a tag: its edge), image row"),
)

# Columns that records made before them do not have: not known there.
ADDED_LATER = ("pose_accepted",)

SAMPLE_NAMES = tuple(column.name for column in SAMPLE_COLUMNS)
FRAME_NAMES = tuple(column.name for column in FRAME_COLUMNS)
TRACE_KEYS = tuple(column.trace_key for column in LAW_COLUMNS)
