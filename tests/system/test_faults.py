"""A fault planted in the twin ends the run in a named state with the robot at rest."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil.record.reader import RunRecord, read_run
from tests.system.runs import run, scenario_with

FAULT_AT_S = 1.5  # under way at full approach speed


def faulty(kind: str, out: Path, side: str = "both", **kwargs: str) -> RunRecord:
    """Return scenario 1 with one fault from FAULT_AT_S on."""
    fault = {"kind": kind, "side": side, "start_s": FAULT_AT_S}
    return run(scenario_with("scenario-1", extra={"faults": [fault]}), out, **kwargs)


@pytest.mark.parametrize(
    ("kind", "side", "reason"),
    [
        ("dead_encoder", "left", "STALL_LEFT"),
        ("dead_encoder", "right", "STALL_RIGHT"),
        ("dead_channel_a", "right", "STALL_RIGHT"),
        ("dead_channel_b", "left", "STALL_LEFT"),
        ("swapped_phases", "left", "RUNAWAY_LEFT"),
        ("swapped_phases", "right", "RUNAWAY_RIGHT"),
        ("motor_reversed", "left", "RUNAWAY_LEFT"),
        ("encoder_noise", "left", "ENCODER"),
        ("link_down_cut", "both", "SETPOINT_TIMEOUT"),
    ],
)
def test_board_finds_the_fault_and_names_it(
    tmp_path: Path, kind: str, side: str, reason: str
) -> None:
    """A wheel whose counts contradict its PWM latches SAFE within 0.6 s, with the wheel's name."""
    record = faulty(kind, tmp_path / "run", side)
    assert record.manifest.outcome == "fault"
    assert reason in record.manifest.outcome_detail
    assert record.samples["t_s"][-1] < FAULT_AT_S + 0.6
    assert not all(verdict.holds for verdict in record.verdicts())


@pytest.mark.parametrize(
    ("kind", "cause", "limit_s"),
    [
        ("camera_stall", "camera", 0.7),
        ("camera_occluded", "camera", 0.7),
        ("link_cut", "link", 0.5),
        ("link_up_cut", "link", 0.5),
        ("host_clock_step", "host: 5.0", 0.0),
        ("board_reset", "link", 0.5),
    ],
)
def test_host_stops_on_a_silent_camera_or_link(
    tmp_path: Path, kind: str, cause: str, limit_s: float
) -> None:
    """The host gives up when a source has been silent for the scenario's limit, and says which."""
    record = faulty(kind, tmp_path / "run")
    assert record.manifest.outcome == "fault"
    assert record.manifest.outcome_detail.startswith(cause)
    assert record.samples["t_s"][-1] == pytest.approx(FAULT_AT_S + limit_s, abs=0.15)


def test_stuck_motor_fails_the_requirement(tmp_path: Path) -> None:
    """A jammed side is not made good by the other one: the deck must fail."""
    record = faulty("motor_stuck", tmp_path / "run", "left")
    assert not all(verdict.holds for verdict in record.verdicts())


def test_record_of_a_cut_link_is_intact(tmp_path: Path) -> None:
    """After a link cut in mid-run the record is whole: tables, figures, checksums."""
    faulty("link_cut", tmp_path / "run")
    record = read_run(tmp_path / "run")
    assert record.problems == ()
    assert record.manifest.tick_count == len(record.samples["t_s"])
    assert (tmp_path / "run" / "metrics.json").is_file()


def test_geofence_stops_a_robot_that_leaves(tmp_path: Path) -> None:
    """A robot sent beyond the fence is stopped at the fence, not at the wall."""
    scenario = scenario_with("scenario-1", ["reference.x_m=5.0"])
    record = run(scenario, tmp_path / "run")
    assert record.manifest.outcome == "fault"
    assert record.manifest.outcome_detail.startswith("geofence")
    assert record.samples["true_x_m"][-1] < scenario.safety.fence_x_max_m + 0.05
