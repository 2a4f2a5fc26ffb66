"""The time base of a record."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest

from hil.config.load import load_scenario
from hil.record.memory import MemoryRecorder
from hil.record.reader import read_run
from hil.record.timeline import Timeline
from hil.record.tlog import read_tlog
from hil.runs.execute import RunSpec, execute, execute_in_memory
from tests.record.synthetic import manifest


def test_the_wall_time_is_that_of_the_start_of_control():
    """Asked once, at the start, and known before the first frame that it dates is written."""
    said: list[object] = []

    class Sink(MemoryRecorder):
        def start(self, unix_us: int) -> None:
            said.append(unix_us)

        def link_frame(self, t_s: float, data: bytes) -> None:
            said.append((t_s, data))

    timeline = Timeline(Sink(manifest()), iter([1_000, 2_000]).__next__)
    timeline.link_frame(97.5, b"early")
    timeline.start(100.0)
    timeline.start(105.0)
    timeline.link_frame(100.5, b"late")
    assert said == [1_000, (-2.5, b"early"), (0.5, b"late")]


def spec(tmp_path, *overrides: str) -> RunSpec:
    """Return a second of scenario 1 with drawn poses."""
    scenario = load_scenario("scenario-1", ("duration_s=1", *overrides))
    return RunSpec(scenario, "twin", "pose", "asg-ism", "asg-ism", 1, tmp_path / "run", rerun=False)


def test_frames_before_control_are_stamped_before_it(tmp_path):
    """The log runs from well before `start_unix_us` to a second after it, without a gap."""
    run = execute(spec(tmp_path))
    start_us = read_run(run.path).manifest.start_unix_us
    times = [(frame.unix_us - start_us) * 1e-6 for frame in read_tlog(run.path / "link.tlog")]
    assert -5.0 < times[0] < -0.5
    assert 1.0 < times[-1] < 2.0
    assert max(b - a for a, b in pairwise(times)) < 0.1


def test_the_counters_of_the_link_are_those_of_the_traffic(tmp_path):
    """30 set-points and about 15 other frames in and before a second; a clean link rejects nothing."""
    counters = execute_in_memory(spec(tmp_path)).manifest.link
    assert 30 + 15 < counters["frames_sent"] < 250
    assert counters["frames_received"] > 50
    assert counters["bytes_rejected"] == 0.0


def test_bytes_that_were_no_frame_are_counted(tmp_path):
    """One byte in a thousand changed: frames are lost and their bytes counted as rejected."""
    bad = replace(spec(tmp_path), seed=2)
    bad = replace(
        bad, scenario=load_scenario("scenario-1", ("duration_s=1", "link.corruption_ratio=0.001"))
    )
    counters = execute_in_memory(bad).manifest.link
    assert counters["frames_lost"] > 0
    # A frame is 21 to 63 bytes long.
    assert counters["bytes_rejected"] == pytest.approx(40 * counters["frames_lost"], rel=0.7)
