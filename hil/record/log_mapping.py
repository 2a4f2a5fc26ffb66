"""The mapping of a foreign log (TOML): what it is a log of, and where each column comes from."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Literal

from pydantic import Field, ValidationError

from hil.config.base import Section
from hil.core.errors import BadInput
from hil.core.files import read_text
from hil.record.schema import SAMPLE_NAMES

Disorder = Literal["refuse", "cut", "sort"]


class Source(Section):
    """Where a signal comes from; what is read is value * scale + offset in the column's unit."""

    column: str = ""
    message: str = ""
    field: str = Field("", description="of the message; name[2] is one element of an array")
    scale: float = 1.0
    offset: float = 0.0
    wraps_at: float = Field(
        0.0, ge=0.0, description="raw value at which a counter starts again from 0; 0: no counter"
    )
    system: int | None = Field(None, ge=1, le=255, description="MAVLink system that sends it")
    component: int | None = Field(None, ge=0, le=255, description="MAVLink component of it")


class LogMapping(Section):
    """What a foreign log is a log of."""

    scenario: str = Field("scenario-1", description="the task: built-in name or TOML file")
    set: tuple[str, ...] = ()
    outer: str = Field("unknown", min_length=1, description="law on the host, as it was called")
    inner: str = Field("unknown", min_length=1, description="law on the board")
    seed: int = 0
    system: int | None = Field(None, ge=1, le=255, description="MAVLink system that is the robot")
    component: int | None = Field(None, ge=0, le=255, description="component that gives its pose")
    only: dict[str, str] = Field(
        default_factory=dict, description="CSV rows to take: column = text that stands in it"
    )
    decimal: Literal["", ".", ","] = Field("", description="decimal mark; empty: as the file shows")
    disorder: Disorder = Field(
        "refuse", description="where time falls back: refuse the log, cut it there, or sort it"
    )
    t: Source = Source(column="t_s")
    columns: dict[str, Source] = Field(default_factory=dict)


# From north-east-down of ground stations to world X east, Y north, theta from X (hil/tools/bridge.py).
STANDARD = {
    "est_x_m": Source(message="LOCAL_POSITION_NED", field="y"),
    "est_y_m": Source(message="LOCAL_POSITION_NED", field="x"),
    "est_theta_rad": Source(message="ATTITUDE", field="yaw", scale=-1.0, offset=math.pi / 2),
    "eta1_cmd_m_s": Source(message="SET_POSITION_TARGET_LOCAL_NED", field="vx"),
    "theta_dot_cmd_rad_s": Source(
        message="SET_POSITION_TARGET_LOCAL_NED", field="yaw_rate", scale=-1.0
    ),
    "omega_cmd_left_rad_s": Source(message="WHEEL_SETPOINT", field="omega_left_rad_s"),
    "omega_cmd_right_rad_s": Source(message="WHEEL_SETPOINT", field="omega_right_rad_s"),
    "omega_meas_left_rad_s": Source(message="WHEEL_STATE", field="omega_left_rad_s"),
    "omega_meas_right_rad_s": Source(message="WHEEL_STATE", field="omega_right_rad_s"),
    "pwm_left_counts": Source(message="WHEEL_STATE", field="pwm_left_counts"),
    "pwm_right_counts": Source(message="WHEEL_STATE", field="pwm_right_counts"),
    "battery_v": Source(message="SYS_STATUS", field="voltage_battery", scale=1e-3),
}


def read_mapping(path: Path | None) -> LogMapping:
    """Return the mapping of a file, or the default one; raises BadInput."""
    if path is None:
        return LogMapping()
    try:
        settings = LogMapping.model_validate(tomllib.loads(read_text(path)))
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"mapping {path}: cannot be read: {error}") from None
    except tomllib.TOMLDecodeError as error:
        raise BadInput(f"{path}: not valid TOML: {error}") from None
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        said = first["msg"].removeprefix("Value error, ")
        raise BadInput(f"{path}: {key}: {said}") from None
    for name in settings.columns:
        if name not in SAMPLE_NAMES or name == "t_s":
            raise BadInput(f"{path}: columns.{name}: no such column of samples.parquet")
    return settings
