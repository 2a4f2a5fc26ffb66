"""Logs as separate series, each on its own times: for fits, which want no common rows.

Where `hil.record.log_import` makes one row a pose, here every signal keeps its own rate. Besides the
columns of `samples.parquet` a mapping may name those of EXTRA.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.config.load import build
from hil.core.errors import BadInput
from hil.core.files import read_toml
from hil.record.log_csv import _read_table, timed_cells, wanted_columns
from hil.record.log_mapping import STANDARD, LogMapping, Source
from hil.record.log_signals import in_order, scaled
from hil.record.log_telemetry import _chosen as _senders
from hil.record.log_telemetry import _Log, _ordered, _robot
from hil.record.reader import read_run
from hil.record.schema import SAMPLE_NAMES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Series = dict[str, tuple[Array, Array]]

# What a fit takes besides the columns of a record.
EXTRA = {
    "motor_left_v": "voltage over the left motors, V",
    "motor_right_v": "voltage over the right motors, V",
    "curvature_cmd_1_m": "curvature commanded, 1/m; turn rate = curvature * forward speed",
}
_DEG = math.pi / 180.0
# Usual spellings, for a CSV file without a mapping.
_TIMES = ("t_s", "time_s", "t", "time", "timestamp_s", "timestamp", "stamp")
_KNOWN: dict[str, tuple[str, ...]] = {
    "est_x_m": ("x_m", "x", "pos_x", "pose_x"),
    "est_y_m": ("y_m", "y", "pos_y", "pose_y"),
    "est_theta_rad": ("theta_rad", "theta", "yaw_rad", "yaw", "heading_rad", "heading"),
    "eta1_cmd_m_s": ("v_cmd_m_s", "v_cmd", "cmd_v", "speed_cmd_mps", "v_m_s", "v"),
    "theta_dot_cmd_rad_s": ("w_cmd_rad_s", "w_cmd", "cmd_w", "omega_cmd", "w_rad_s", "w"),
    "curvature_cmd_1_m": ("curvature_cmd_1pm",),
    "omega_meas_left_rad_s": ("omega_left_rad_s", "omega_l", "wl"),
    "omega_meas_right_rad_s": ("omega_right_rad_s", "omega_r", "wr"),
    "omega_cmd_left_rad_s": (), "omega_cmd_right_rad_s": (),
    "pwm_left_counts": ("pwm_left",), "pwm_right_counts": ("pwm_right",),
    "battery_v": (), "motor_left_v": (), "motor_right_v": (),
}  # fmt: skip
_DEGREES = ("theta_deg", "yaw_deg", "heading_deg")


@dataclass(frozen=True, slots=True)
class LogSeries:
    """Signals of a log by column name, each (times in s, values) with no empty value, from t = 0.

    `settings` is the mapping that was used, `scenario` the task of a record (a tree) or None.
    """

    series: Series
    notes: tuple[str, ...]
    settings: LogMapping | None
    scenario: dict[str, Any] | None


def read_series(log: Path, mapping: Path | None) -> LogSeries:
    """Return the signals of a CSV file, a telemetry log or a run record; raises BadInput."""
    if log.is_dir():
        if mapping is not None:
            raise BadInput(f"--map {mapping}: {log} is a run record, which needs no mapping")
        found = _of_record(log)
    elif not log.exists():
        raise BadInput(f"{log}: no such file or folder")
    else:
        settings = _mapping(mapping)
        reader = _of_tlog if log.suffix.lower() == ".tlog" else _of_csv
        series, notes = reader(log, settings, mapping is not None)
        found = LogSeries(series, tuple(notes), settings, None)
    filled = {name: pair for name, pair in found.series.items() if pair[0].size}
    if not filled:
        raise BadInput(f"{log}: no signal that a fit can use has a value in it")
    start_s = min(float(t_s[0]) for t_s, _ in filled.values())
    return LogSeries(
        {name: (t_s - start_s, values) for name, (t_s, values) in filled.items()},
        found.notes,
        found.settings,
        found.scenario,
    )


def _mapping(path: Path | None) -> LogMapping:
    if path is None:
        return LogMapping()
    settings = build(LogMapping, read_toml(path, "mapping"), str(path))
    for name, source in settings.columns.items():
        if (name not in SAMPLE_NAMES and name not in EXTRA) or name == "t_s":
            raise BadInput(
                f"{path}: columns.{name}: neither a column of samples.parquet nor one of "
                f"{', '.join(EXTRA)}"
            )
        if not (math.isfinite(source.scale) and source.scale != 0.0):
            raise BadInput(f"{path}: columns.{name}.scale = {source.scale:g}: must not be 0")
    if settings.t.scale <= 0.0:
        raise BadInput(f"{path}: t.scale = {settings.t.scale:g} s: must be above 0")
    return settings


def _of_csv(path: Path, settings: LogMapping, mapped: bool) -> tuple[Series, list[str]]:
    notes: list[str] = []
    if not mapped:
        settings, notes = _guessed(path, settings)
    wanted = wanted_columns(settings)
    cells, t_s, refusal = timed_cells(path, settings)
    order, said = in_order(t_s, settings.disorder, refusal, "rows")
    series = {
        name: _known(t_s[order], scaled(cells.column(source.column, name)[order], source))
        for name, source in wanted.items()
    }
    return series, [*notes, *cells.notes(), *said]


def _guessed(path: Path, settings: LogMapping) -> tuple[LogMapping, list[str]]:
    """Return the mapping that the heading itself suggests, and what was taken for what."""
    names = _read_table(path, ["t_s"]).names
    time = next((name for name in _TIMES if name in names), None)
    if time is None:
        raise BadInput(
            f"{path}: no column is called {' or '.join(_TIMES[:4])}; say in a mapping (--map) which "
            f"is the time; it has {', '.join(names[:12])}"
        )
    columns: dict[str, Source] = {}
    for signal, spellings in _KNOWN.items():
        column = next((name for name in (signal, *spellings) if name in names), None)
        if column is not None:
            columns[signal] = Source(column=column)
    degrees = next((name for name in _DEGREES if name in names), None)
    if degrees is not None and "est_theta_rad" not in columns:
        columns["est_theta_rad"] = Source(column=degrees, scale=_DEG)
    if not columns:
        raise BadInput(
            f"{path}: no column has a name that is known; say in a mapping (--map) what they are; it "
            f"has {', '.join(names[:12])}"
        )
    taken = ", ".join(f"{source.column} as {name}" for name, source in columns.items())
    said = f"no mapping: {time} taken as time in s, {taken}"
    return settings.model_copy(update={"t": Source(column=time), "columns": columns}), [said]


def _of_tlog(path: Path, settings: LogMapping, mapped: bool) -> tuple[Series, list[str]]:  # noqa: ARG001 - as _of_csv
    sources = STANDARD | {n: s for n, s in settings.columns.items() if s.message}
    log = _Log(path, sources)
    robot, others = _robot(log, settings)
    notes = list(log.notes)
    series: Series = {}
    for name, source in sources.items():
        chosen, said = _senders(log, name, robot, others)
        notes += said
        if chosen is not None:
            one, said = _ordered(log, name, source, chosen, settings)
            notes += said
            series[name] = _known(np.array(one.t_s), np.array(one.values))
    return series, list(dict.fromkeys(notes))


def _of_record(path: Path) -> LogSeries:
    run = read_run(path)
    t_s = run.samples["t_s"]
    series = {name: _known(t_s, run.samples[name]) for name in SAMPLE_NAMES if name in _KNOWN}
    notes = list(run.problems)
    imported = run.manifest.target.startswith("import:")
    if run.frames and run.frames["t_exposure_s"].size:
        seen = run.frames["seen"] == 1.0
        for name, column in (
            ("x_m", "est_x_m"),
            ("y_m", "est_y_m"),
            ("theta_rad", "est_theta_rad"),
        ):
            series[column] = _known(run.frames["t_exposure_s"][seen], run.frames[name][seen])
        notes.append("poses as the camera saw them, at the middle of each exposure")
    elif not imported:
        notes.append("no frames in the record: poses are the estimator's")
    return LogSeries(series, tuple(notes), None, run.manifest.scenario)


def _known(t_s: Array, values: Array) -> tuple[Array, Array]:
    """Return the values that are there, one for each time (the last of equal ones)."""
    there = np.isfinite(t_s) & np.isfinite(values)
    t_s, values = t_s[there], values[there]
    order = np.argsort(t_s, kind="stable")
    t_s, values = t_s[order], values[order]
    last = np.concatenate((np.diff(t_s) > 0.0, [True])) if t_s.size else np.zeros(0, dtype=bool)
    return t_s[last], values[last]
