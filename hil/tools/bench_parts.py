"""What the parts of the host cost on this machine: a tick's shares, a report, a Rerun file."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from hil.analysis.speed import Figure, Plan, measure
from hil.config.load import load_scenario
from hil.control.estimators.geometry import BelievedGeometry
from hil.control.estimators.making import make_estimator
from hil.core.types import Pose, PoseMeasurement, WheelSample
from hil.record.manifest import Manifest
from hil.record.recorder import Recorder
from hil.record.rrd import write_rrd
from hil.record.schema import SAMPLE_NAMES
from hil.report.compare import compare_runs
from hil.report.html import render
from hil.runs.execute import RunSpec, execute
from hil.wire import dialect
from hil.wire.framing import FrameReader

if TYPE_CHECKING:
    from hil.record.reader import RunRecord

_SCENARIO = "scenario-1"
_TICKS = 2_000
_TICK_S = 1 / 30
_STATE_FIELDS = len(dialect.MAVLink_wheel_state_message.fieldnames) - 1


def figures(runs: int) -> list[Figure]:
    """Return the figures of the parts; some seconds in all."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        record = _record(folder / "run")
        plans: list[Plan] = [
            ("estimator, one tick", "us", "<= 500", estimator_tick_us),
            ("recorder, one row", "us", "<= 20", lambda: recorder_row_us(folder)),
            ("link, one WHEEL_STATE", "us", "", frame_us),
            ("link, the same by pymavlink's parser", "us", "", parser_frame_us),
            ("Rerun file of a run of 20 s", "s", "<= 0.3", lambda: rerun_file_s(folder, record)),
            ("report of one scenario", "s", "<= 1.5", lambda: report_s(record)),
        ]
        return [measure(what, unit, goal, runs, once) for what, unit, goal, once in plans]


def _record(folder: Path) -> RunRecord:
    return execute(
        RunSpec(
            scenario=load_scenario(_SCENARIO),
            target="twin",
            camera="pose",
            outer="asg-ism",
            inner="asg-ism",
            seed=1,
            out=folder,
            rerun=False,
            command="hil bench parts",
        )
    )


def estimator_tick_us() -> float:
    """Return microseconds of one pose, two wheel reports, one estimate and one command."""
    scenario = load_scenario(_SCENARIO)
    robot = scenario.robot
    geometry = BelievedGeometry(
        robot.wheel_radius_m, robot.track_m, robot.d0_m, robot.encoder_counts_per_turn
    )
    estimator = make_estimator("fused", scenario.control.fusion, geometry)
    seen = PoseMeasurement(Pose(0.0, 0.0, 0.0), 1.0)
    start_s = time.perf_counter()
    for k in range(_TICKS):
        t_s = k * _TICK_S
        for half in (0, 1):
            estimator.on_wheels(WheelSample(t_s + half * _TICK_S / 2, 0, 0, 0.0, 0.0))
        estimator.on_pose(t_s - 0.05, seen)
        estimator.estimate_at(t_s + 0.02)
        estimator.on_command(t_s + 0.02, 0.0, 0.0)
    return (time.perf_counter() - start_s) / _TICKS * 1e6


def recorder_row_us(folder: Path) -> float:
    """Return microseconds of appending one row to a record."""
    manifest = Manifest(scenario={}, seed=1, target="twin", camera="pose", outer="pid", inner="pid")
    with tempfile.TemporaryDirectory(dir=folder) as name:
        recorder = Recorder(Path(name) / "run", manifest, rerun=False)
        start_s = time.perf_counter()
        for k in range(_TICKS):
            recorder.append((k * _TICK_S, *([0.0] * (len(SAMPLE_NAMES) - 1))))
        spent_s = time.perf_counter() - start_s
        recorder.close("complete", "")
    return spent_s / _TICKS * 1e6


def _frames() -> list[bytes]:
    sender = dialect.MAVLink(None, srcSystem=1)
    return [
        bytes(dialect.MAVLink_wheel_state_message(k, *([0] * _STATE_FIELDS)).pack(sender))
        for k in range(_TICKS)
    ]


def frame_us() -> float:
    """Return microseconds of reading one WHEEL_STATE as the link does."""
    return _feeding_us(FrameReader().feed)


def parser_frame_us() -> float:
    """Return microseconds of reading one WHEEL_STATE by pymavlink's own parser."""
    return _feeding_us(dialect.MAVLink(None).parse_buffer)


def _feeding_us(feed: Callable[[bytes], object]) -> float:
    frames = _frames()
    start_s = time.perf_counter()
    for frame in frames:
        feed(frame)
    return (time.perf_counter() - start_s) / len(frames) * 1e6


def rerun_file_s(folder: Path, record: RunRecord) -> float:
    """Return seconds of writing the viewer's file of a run."""
    start_s = time.perf_counter()
    write_rrd(folder / "bench.rrd", [record])
    return time.perf_counter() - start_s


def report_s(record: RunRecord) -> float:
    """Return seconds of rendering the report of two runs of one scenario."""
    start_s = time.perf_counter()
    render([compare_runs([record, record])], command="hil bench parts")
    return time.perf_counter() - start_s
