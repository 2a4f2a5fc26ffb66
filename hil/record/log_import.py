"""Logs of other programs made into run records: MAVLink telemetry, DataFlash, ULog, MCAP, CSV.

A mapping (TOML) says what the run was and where each column of `samples.parquet` comes from:

    scenario = "scenario-1"       # the task: reference, robot, requirements
    outer = "pid"
    t = { column = "time_ms", scale = 0.001 }
    [columns]
    est_x_m = { column = "X_mm", scale = 0.001 }
    est_theta_rad = { message = "ATTITUDE", field = "yaw", scale = -1.0, offset = 1.5707963 }

Poses and commands of standard messages of MAVLink, ArduPilot and PX4 need no mapping. Columns nobody gives
stay empty, but for those that follow: speeds from the pose, delta1 from pose and reference, wheel
commands from body commands. What was left out, repaired or assumed is said in notes, which are
also events of the record.
"""

from __future__ import annotations

import importlib
import math
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hil.config.load import load_scenario
from hil.control.references import make_reference
from hil.control.vehicles.vehicle import make_vehicle
from hil.record.log_csv import read_csv
from hil.record.log_mapping import LogMapping, read_mapping
from hil.record.log_signals import Signals
from hil.record.log_telemetry import read_tlog
from hil.record.log_topics import signals_of
from hil.record.manifest import Manifest, collect_versions, git_revision
from hil.record.recorder import Recorder
from hil.record.schema import SAMPLE_NAMES

if TYPE_CHECKING:
    from hil.config.scenario import Scenario
    from hil.record.log_signals import Array
    from hil.record.log_topics import TopicLog
    from hil.record.reader import RunRecord

# Ending of the name -> (module, reader), imported when one is read.
_TOPIC_READERS = {
    ".bin": ("hil.record.log_dataflash", "read_dataflash"),
    ".ulg": ("hil.record.log_ulog", "read_ulog"),
    ".ulog": ("hil.record.log_ulog", "read_ulog"),
    ".mcap": ("hil.record.log_mcap", "read_mcap"),
}
# Faster than this no small wheeled robot drives: the rows are of two, or in another unit.
_SPEED_BELIEVED_M_S = 5.0
# A hole in the pose is told from this length on, where it is many times the usual step.
_HOLE_S = 0.5
_HOLE_STEPS = 10.0


@dataclass(frozen=True, slots=True)
class Imported:
    """A record made of a log, and a line for each thing that was left out, repaired or assumed."""

    record: RunRecord
    notes: tuple[str, ...]


def import_log(log: Path, mapping: Path | None, out: Path, command: str) -> Imported:
    """Make a run record of a foreign log in the new folder `out`; raises BadInput.

    Whatever stops it on the way (Ctrl-C, a full disk) leaves nothing in `out`: it is made of the log anew.
    """
    settings = read_mapping(mapping)
    scenario = load_scenario(_beside(mapping, settings.scenario), settings.set)
    signals = read_log(log, settings)
    columns = _completed(signals, scenario)
    notes = (*signals.notes, *_doubts(columns), *_assumed(settings, scenario, columns["t_s"]))
    recorder = Recorder(out, _manifest(log, scenario, settings, command))
    try:
        for t_s, frame in signals.frames:
            recorder.link_frame(t_s, frame)
        table = np.column_stack([columns[name] for name in SAMPLE_NAMES])
        for row in table.tolist():
            recorder.append(row)
        recorder.event(0.0, "imported", f"{log.name}, {signals.t_s.size} rows")
        for note in notes:
            recorder.event(0.0, "note", note)
        return Imported(recorder.close("complete", f"imported from {log.name}"), notes)
    except BaseException:
        recorder.discard()
        raise


def read_log(log: Path, settings: LogMapping) -> Signals:
    """Return what a log says, by the reader of its name's ending; raises BadInput."""
    suffix = log.suffix.lower()
    if suffix == ".tlog":
        return read_tlog(log, settings)
    if suffix not in _TOPIC_READERS:
        return read_csv(log, settings)
    module, reader = _TOPIC_READERS[suffix]
    found: TopicLog = getattr(importlib.import_module(module), reader)(log)
    return signals_of(found, settings)


def _assumed(settings: LogMapping, scenario: Scenario, t_s: Array) -> list[str]:
    """Return what was taken for granted about the task."""
    said = []
    if "scenario" not in settings.model_fields_set:
        said.append(
            f"no mapping says what the task was: {scenario.name} assumed, with its reference and "
            "requirements"
        )
    lasts_s = float(t_s[-1])
    if lasts_s < 0.95 * scenario.duration_s:
        said.append(
            f"the log lasts {lasts_s:.3g} s, {scenario.name} takes {scenario.duration_s:g} s: figures "
            "are of the part that is there"
        )
    return said


def _doubts(columns: dict[str, Array]) -> list[str]:
    """Return a line when the pose jumps further than a robot drives, and one when it is long away."""
    t_s = columns["t_s"]
    steps_s = np.diff(t_s)
    steps_m = np.hypot(np.diff(columns["est_x_m"]), np.diff(columns["est_y_m"]))
    speeds_m_s = steps_m / steps_s
    notes = []
    fast = np.flatnonzero(speeds_m_s > _SPEED_BELIEVED_M_S)
    if fast.size:
        worst = int(np.argmax(speeds_m_s))
        notes.append(
            f"the pose jumps {fast.size} times, at {t_s[worst]:.3f} s by {steps_m[worst]:.3g} m "
            f"({speeds_m_s[worst]:.3g} m/s): two robots in one log, or another unit?"
        )
    away = np.flatnonzero(steps_s > max(_HOLE_S, _HOLE_STEPS * float(np.median(steps_s))))
    if away.size:
        longest = int(np.argmax(steps_s))
        more = f"; {away.size} such holes of {steps_s[away].sum():.3g} s in all"
        notes.append(
            f"no pose for {steps_s[longest]:.3g} s from {t_s[longest]:.3g} s on"
            + (more if away.size > 1 else "")
        )
    return notes


def _beside(mapping: Path | None, name: str) -> str:
    if mapping is not None and name.endswith(".toml"):
        return str(mapping.parent / name)
    return name


def _completed(signals: Signals, scenario: Scenario) -> dict[str, Array]:
    """Return every column of the record: those given, those that follow from them, NaN."""
    t_s, given = signals.t_s, dict(signals.columns)
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
    vehicle = make_vehicle(robot)
    if "eta1_cmd_m_s" in given and "omega_cmd_left_rad_s" not in given:
        pairs = zip(columns["eta1_cmd_m_s"], columns["theta_dot_cmd_rad_s"], strict=True)
        wheels = np.array([vehicle.wheels(float(eta1), float(turn)) for eta1, turn in pairs])
        columns["omega_cmd_left_rad_s"], columns["omega_cmd_right_rad_s"] = wheels.T
    elif "omega_cmd_left_rad_s" in given and "eta1_cmd_m_s" not in given:
        pairs = zip(columns["omega_cmd_left_rad_s"], columns["omega_cmd_right_rad_s"], strict=True)
        body = np.array([vehicle.body(float(left), float(right)) for left, right in pairs])
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
