"""Logs of other programs made into run records: MAVLink telemetry logs, and CSV with a mapping.

A mapping (TOML) says what the run was and where each column of `samples.parquet` comes from:

    scenario = "scenario-1"       # the task: reference, robot, requirements
    outer = "pid"
    t = { column = "time_ms", scale = 0.001 }
    [columns]
    est_x_m = { column = "X_mm", scale = 0.001 }
    est_theta_rad = { message = "ATTITUDE", field = "yaw", scale = -1.0, offset = 1.5707963 }

Of a telemetry log, poses and commands of standard messages need no mapping. Columns nobody gives
stay empty, but for those that follow: speeds from the pose, delta1 from pose and reference, wheel
commands from body commands.
"""

from __future__ import annotations

import bisect
import csv
import math
import time
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pydantic import Field, ValidationError

from hil.config.base import Section
from hil.config.load import load_scenario
from hil.control.estimators.geometry import BelievedGeometry
from hil.control.references import make_reference
from hil.core.errors import BadInput
from hil.core.files import LOG_BYTES, check_size, read_bounded, read_text
from hil.record.manifest import Manifest, collect_versions, git_revision
from hil.record.recorder import Recorder
from hil.record.schema import SAMPLE_NAMES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.config.scenario import Scenario
    from hil.record.reader import RunRecord

    Array = NDArray[np.float64]

_POSE = ("est_x_m", "est_y_m", "est_theta_rad")


class Source(Section):
    """Where a signal comes from; what is read is value * scale + offset in the column's unit."""

    column: str = ""
    message: str = ""
    field: str = ""
    scale: float = 1.0
    offset: float = 0.0


class LogMapping(Section):
    """What a foreign log is a log of."""

    scenario: str = Field("scenario-1", description="the task: built-in name or TOML file")
    set: tuple[str, ...] = ()
    outer: str = Field("unknown", min_length=1, description="law on the host, as it was called")
    inner: str = Field("unknown", min_length=1, description="law on the board")
    seed: int = 0
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


class Message(NamedTuple):
    """One decoded frame of a telemetry log; `frame` is None for MAVLink 1."""

    t_s: float
    name: str
    values: Any
    frame: bytes | None


@dataclass(frozen=True, slots=True)
class Signals:
    """Columns read from a log, all on the times `t_s`, and the frames to keep."""

    t_s: Array
    columns: dict[str, Array]
    frames: tuple[tuple[float, bytes], ...] = ()


def import_log(log: Path, mapping: Path | None, out: Path, command: str) -> RunRecord:
    """Make a run record of a foreign log in the new folder `out`; raises BadInput."""
    settings = _read_mapping(mapping)
    scenario = load_scenario(_beside(mapping, settings.scenario), settings.set)
    signals = _read_tlog(log, settings) if log.suffix == ".tlog" else _read_csv(log, settings)
    if signals.t_s.size < 2:
        raise BadInput(f"{log}: {signals.t_s.size} rows with a time, at least 2 are needed")
    columns = _completed(signals, scenario)
    recorder = Recorder(out, _manifest(log, scenario, settings, command))
    for t_s, frame in signals.frames:
        recorder.link_frame(t_s, frame)
    table = np.column_stack([columns[name] for name in SAMPLE_NAMES])
    for row in table.tolist():
        recorder.append(row)
    recorder.event(0.0, "imported", f"{log.name}, {signals.t_s.size} rows")
    return recorder.close("complete", f"imported from {log.name}")


def _read_mapping(path: Path | None) -> LogMapping:
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


def _beside(mapping: Path | None, name: str) -> str:
    if mapping is not None and name.endswith(".toml"):
        return str(mapping.parent / name)
    return name


def _read_csv(path: Path, settings: LogMapping) -> Signals:
    try:
        check_size(path)
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise BadInput(f"{path}: cannot be read as CSV: {error}") from None
    names = list(rows[0]) if rows else []

    def column(source: Source, what: str) -> Array:
        if source.column not in names:
            raise BadInput(
                f"{path}: has no column {source.column!r} for {what}; it has {', '.join(names)}"
            )
        raw = np.array([_number(row[source.column]) for row in rows])
        return raw * source.scale + source.offset

    t_s = column(settings.t, "t")
    known = np.isfinite(t_s)
    order = np.flatnonzero(known)[np.argsort(t_s[known], kind="stable")]
    wanted = {name: source for name, source in settings.columns.items() if source.column}
    found = {name: column(source, name)[order] for name, source in wanted.items()}
    return Signals(t_s[order] - (t_s[order[0]] if order.size else 0.0), found)


def _number(text: str | None) -> float:
    try:
        return float(text) if text else math.nan
    except ValueError:
        return math.nan


def _read_tlog(path: Path, settings: LogMapping) -> Signals:
    """Return one row per message that gives est_x_m; other signals hold their latest value."""
    sources = STANDARD | {n: s for n, s in settings.columns.items() if s.message}
    messages = list(_messages(path))
    series: dict[str, tuple[list[float], list[float]]] = {name: ([], []) for name in sources}
    for message in messages:
        for name, source in sources.items():
            if message.name == source.message and hasattr(message.values, source.field):
                value = float(getattr(message.values, source.field))
                series[name][0].append(message.t_s)
                series[name][1].append(value * source.scale + source.offset)
    rows = series["est_x_m"][0]
    if not rows:
        raise BadInput(
            f"{path}: has no {sources['est_x_m'].message} among its {len(messages)} messages; "
            "name the message of the pose in a mapping"
        )
    start_s = rows[0]
    columns = {name: _held(*pair, rows) for name, pair in series.items() if pair[0]}
    frames = tuple((m.t_s - start_s, m.frame) for m in messages if m.frame is not None)
    return Signals(np.array(rows) - start_s, columns, frames)


def _held(times: list[float], values: list[float], at: list[float]) -> Array:
    """Return the latest value at or before each time; NaN before the first."""
    places = [bisect.bisect_right(times, t_s) - 1 for t_s in at]
    return np.array([values[place] if place >= 0 else math.nan for place in places])


def _messages(path: Path) -> Iterator[Message]:
    """Yield every message of a telemetry log that a known dialect can decode."""
    from pymavlink.dialects.v20 import ardupilotmega  # noqa: PLC0415 - large, for this errand only

    from hil.wire import dialect  # noqa: PLC0415 - as above

    decoders: list[tuple[Any, Mapping[int, Any]]] = [
        (dialect.MAVLink(None), dialect.mavlink_map),
        (ardupilotmega.MAVLink(None), ardupilotmega.mavlink_map),
    ]
    try:
        data = read_bounded(path, LOG_BYTES)
    except OSError as error:
        raise BadInput(f"{path}: cannot be read: {error.strerror}") from None
    at = 0
    while (end := _frame_end(data, at + 8)) is not None:
        frame = data[at + 8 : end]
        msg_id = int.from_bytes(frame[7:10], "little") if frame[0] == 0xFD else frame[5]
        for decoder, known in decoders:
            if msg_id in known:
                try:
                    message = decoder.decode(bytearray(frame))
                except Exception:
                    continue
                whole = frame if frame[0] == 0xFD else None
                t_s = int.from_bytes(data[at : at + 8], "big") * 1e-6
                yield Message(t_s, message.get_type(), message, whole)
                break
        at = end


def _frame_end(data: bytes, start: int) -> int | None:
    """Return where the frame ends that begins at `start`; None at the end or where none begins."""
    if start + 10 > len(data) or data[start] not in {0xFD, 0xFE}:
        return None
    if data[start] == 0xFE:
        end = start + 8 + data[start + 1]
    else:
        end = start + 12 + data[start + 1] + 13 * (data[start + 2] & 1)
    return end if end <= len(data) else None


def _completed(signals: Signals, scenario: Scenario) -> dict[str, Array]:
    """Return every column of the record: those given, those that follow from them, NaN."""
    t_s, given = signals.t_s, dict(signals.columns)
    missing = [name for name in _POSE if name not in given]
    if missing:
        raise BadInput(f"the log gives no {missing[0]}: a record needs the pose {', '.join(_POSE)}")
    robot = scenario.robot
    x, y = given["est_x_m"], given["est_y_m"]
    theta = _unwrapped(given["est_theta_rad"])
    given["est_theta_rad"] = theta
    cos, sin = np.cos(theta), np.sin(theta)
    z1 = (x + robot.d0_m * cos, y + robot.d0_m * sin)
    reference = make_reference(scenario.reference)
    goal = np.array([reference.at(float(t)).z1_m for t in t_s])
    rate = [np.gradient(values, t_s) for values in (*z1, theta)]
    derived = {
        "t_s": t_s,
        "est_eta1_m_s": rate[0] * cos + rate[1] * sin,
        "est_theta_dot_rad_s": rate[2],
        "ref_z1_x_m": goal[:, 0],
        "ref_z1_y_m": goal[:, 1],
        "delta1_x_m": z1[0] - goal[:, 0],
        "delta1_y_m": z1[1] - goal[:, 1],
    }
    columns = {name: np.full(t_s.size, math.nan) for name in SAMPLE_NAMES} | derived | given
    geometry = BelievedGeometry.of(robot)
    if "eta1_cmd_m_s" in given and "omega_cmd_left_rad_s" not in given:
        pairs = zip(columns["eta1_cmd_m_s"], columns["theta_dot_cmd_rad_s"], strict=True)
        wheels = np.array([geometry.wheels(float(eta1), float(turn)) for eta1, turn in pairs])
        columns["omega_cmd_left_rad_s"], columns["omega_cmd_right_rad_s"] = wheels.T
    elif "omega_cmd_left_rad_s" in given and "eta1_cmd_m_s" not in given:
        pairs = zip(columns["omega_cmd_left_rad_s"], columns["omega_cmd_right_rad_s"], strict=True)
        body = np.array([geometry.body(float(left), float(right)) for left, right in pairs])
        columns["eta1_cmd_m_s"], columns["theta_dot_cmd_rad_s"] = body.T
    return columns


def _unwrapped(theta: Array) -> Array:
    known = np.isfinite(theta)
    result = theta.copy()
    result[known] = np.unwrap(theta[known])
    return result


def _manifest(log: Path, scenario: Scenario, settings: LogMapping, command: str) -> Manifest:
    now_us = time.time_ns() // 1000
    return Manifest(
        command=command,
        scenario=scenario.model_dump(mode="json"),
        seed=settings.seed,
        target=f"import:{log.name}",
        camera="as logged",
        outer=settings.outer,
        inner=settings.inner,
        versions=collect_versions(),
        git_revision=git_revision(),
        start_time_utc=datetime.fromtimestamp(now_us * 1e-6, UTC).isoformat(timespec="seconds"),
        start_unix_us=now_us,
    )
