"""The host stops the robot when camera and wheels no longer tell of one robot inside the fence."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path
from random import Random

import numpy as np
import pytest
from click.testing import CliRunner

from hil.cli.main import cli
from hil.config.load import load_scenario
from hil.core.rig import Frame
from hil.core.types import Pose
from hil.record.reader import RunRecord
from hil.runs.execute import RunSpec, execute_in_memory
from sim_twin.twin import HOST_START_S, Twin

LAWS = ("pid", "asg-ism")
Change = Callable[[Twin, Frame], Frame]


def run(
    scenario: str, overrides: tuple[str, ...] = (), law: str = "pid", seed: int = 1
) -> RunRecord:
    """Return a run with drawn poses."""
    loaded = load_scenario(scenario, overrides)
    return execute_in_memory(RunSpec(loaded, "twin", "pose", law, "asg-ism", seed, Path()))


def seen_as(monkeypatch: pytest.MonkeyPatch, change: Change) -> None:
    """Let every frame with a pose go through `change` on its way."""
    real = Twin.poll_frame

    def poll(twin: Twin) -> Frame | None:
        frame = real(twin)
        seen = frame is not None and frame.pose is not None and frame.pose.pose is not None
        return change(twin, frame) if frame is not None and seen else frame

    monkeypatch.setattr(Twin, "poll_frame", poll)


def with_pose(frame: Frame, pose: Pose) -> Frame:
    assert frame.pose is not None
    return dataclasses.replace(frame, pose=dataclasses.replace(frame.pose, pose=pose))


def outside_m(record: RunRecord) -> float:
    """Return how far the robot was beyond the fence at most."""
    fence, true = record.manifest.scenario["safety"], record.samples
    over = [
        true["true_x_m"] - fence["fence_x_max_m"], fence["fence_x_min_m"] - true["true_x_m"],
        true["true_y_m"] - fence["fence_y_max_m"], fence["fence_y_min_m"] - true["true_y_m"],
    ]  # fmt: skip
    return float(np.max(over))


def estimate_off_m(record: RunRecord) -> float:
    """Return the largest distance of the estimate from the truth."""
    s = record.samples
    return float(np.hypot(s["est_x_m"] - s["true_x_m"], s["est_y_m"] - s["true_y_m"]).max())


@pytest.mark.parametrize("law", LAWS)
def test_poses_that_nobody_believes_stop_the_robot(
    monkeypatch: pytest.MonkeyPatch, law: str
) -> None:
    """From 1 s on the camera says anything: 0.7 s after the last pose believed the run ends."""
    rng = Random(3)

    def anywhere(twin: Twin, frame: Frame) -> Frame:
        if twin.now_s() < HOST_START_S + 2.0:
            return frame
        draw = (rng.uniform(-0.8, 0.8), rng.uniform(-0.6, 0.6), rng.uniform(-3.0, 3.0))
        return with_pose(frame, Pose(*draw))

    seen_as(monkeypatch, anywhere)
    record = run("scenario-1", (), law)
    assert record.manifest.outcome == "fault"
    assert record.manifest.outcome_detail.startswith("camera and wheels disagree")
    last = record.samples["pose_accepted"] > 0
    silent_s = record.samples["t_s"][-1] - record.samples["t_s"][last][-1]
    assert silent_s < 0.7
    assert np.all(record.samples["pose_seen"][-15:].max() == 1.0)
    assert record.samples["pose_accepted"][-15:].max() == 0.0


@pytest.mark.parametrize(("newtons", "law"), [(20.0, "pid"), (20.0, "asg-ism"), (40.0, "pid")])
def test_a_robot_carried_off_is_stopped_in_time(newtons: float, law: str) -> None:
    """Pushed sideways on slipping wheels: the estimate goes along, and the run ends at the fence."""
    push = f'{{target="force_left_n",shape="step",amplitude={newtons},start_s=1.0,end_s=2.5}}'
    record = run("scenario-1", ("robot.variant=slip", f"disturbances=[{push}]"), law)
    assert record.manifest.outcome == "fault"
    assert outside_m(record) < 0.3
    assert estimate_off_m(record) < 0.5
    assert record.samples["t_s"][-1] < 2.0


@pytest.mark.parametrize("law", LAWS)
def test_the_fence_judges_what_is_seen(monkeypatch: pytest.MonkeyPatch, law: str) -> None:
    """Two poses outside end the run whatever the estimate says; a single one may be a wrong find."""
    count = {"most": 1, "done": 0}

    def far_off(twin: Twin, frame: Frame) -> Frame:
        if twin.now_s() < HOST_START_S + 2.0 or count["done"] >= count["most"]:
            return frame
        count["done"] += 1
        return with_pose(frame, Pose(1.4, 0.0, 0.0))

    seen_as(monkeypatch, far_off)
    assert run("scenario-1", ("duration_s=4",), law).manifest.outcome == "complete"
    count.update(most=2, done=0)
    record = run("scenario-1", ("duration_s=4",), law)
    assert record.manifest.outcome_detail.startswith("geofence: robot seen at (1.400, 0.000) m")


@pytest.mark.parametrize("ahead_s", [1.0, 10.0, 100.0])
def test_one_frame_from_the_future_changes_nothing(
    monkeypatch: pytest.MonkeyPatch, ahead_s: float
) -> None:
    """Its stamp alone is wrong: it is as good as dropped, and the record says so."""
    done: list[int] = []

    def stamped_late(twin: Twin, frame: Frame) -> Frame:
        if done or twin.now_s() < HOST_START_S + 2.5:
            return frame
        done.append(frame.index)
        return dataclasses.replace(frame, t_cam_s=frame.t_cam_s + ahead_s)

    seen_as(monkeypatch, stamped_late)
    record = run("scenario-1", ("duration_s=6",))
    assert record.manifest.outcome == "complete"
    assert estimate_off_m(record) < 0.01
    row = record.frames["index"].tolist().index(done[0])
    assert record.frames["seen"][row] == 0.0


@pytest.mark.parametrize("step_s", [0.3, -1.0])
def test_a_step_of_the_cameras_clock_is_taken_in(
    monkeypatch: pytest.MonkeyPatch, step_s: float
) -> None:
    """After a few frames poses are dated right again; the record tells of the step."""

    def stepped(twin: Twin, frame: Frame) -> Frame:
        by_s = step_s if twin.now_s() > HOST_START_S + 2.5 else 0.0
        return dataclasses.replace(frame, t_cam_s=frame.t_cam_s + by_s)

    seen_as(monkeypatch, stepped)
    record = run("scenario-1", ("duration_s=6",))
    assert record.manifest.outcome == "complete"
    assert estimate_off_m(record) < 0.02
    assert any("clock has stepped" in event.text for event in record.events)


def mirrored(_twin: Twin, frame: Frame) -> Frame:
    """Return the frame as a mirrored picture shows it."""
    assert frame.pose is not None
    assert frame.pose.pose is not None
    pose = frame.pose.pose
    return with_pose(frame, Pose(-pose.x_m, pose.y_m, math.pi - pose.theta_rad))


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("scenario", ["scenario-1", "scenario-2", "scenario-3"])
@pytest.mark.parametrize("speed_m_s", [0.4, 0.05])
def test_a_mirrored_picture_is_a_fault_of_its_own(
    monkeypatch: pytest.MonkeyPatch, scenario: str, law: str, speed_m_s: float
) -> None:
    """It turns the other way than the wheels: stopped before the robot is anywhere."""
    seen_as(monkeypatch, mirrored)
    record = run(scenario, (f"control.limits.approach_speed_m_s={speed_m_s}",), law)
    assert record.manifest.outcome_detail.startswith("camera and wheels disagree")
    assert record.samples["t_s"][-1] < 1.5
    assert outside_m(record) < 0.0


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("speed_m_s", [0.4, 0.1, 0.05, 0.02])
def test_exchanged_marks_are_a_fault_of_their_own(law: str, speed_m_s: float) -> None:
    """The robot drives the other way than it is seen to: also so slowly that the filter adapts."""
    slow = tuple(
        f"control.limits.{key}={speed_m_s}" for key in ("approach_speed_m_s", "eta1_max_m_s")
    )
    record = run("scenario-1", ("camera.marks.swapped_marks=true", *slow), law)
    assert record.manifest.outcome_detail.startswith("camera and wheels disagree")
    assert record.samples["t_s"][-1] < 2.0
    assert outside_m(record) < 0.0


def test_the_command_says_so_and_ends_with_3(tmp_path: Path) -> None:
    """`hil run` names the fault with its figures."""
    out = str(tmp_path / "run")
    words = ["run", "scenario-2", "--camera", "pose", "--set", "camera.marks.swapped_marks=true"]
    ended = CliRunner().invoke(cli, [*words, "--json", "--out", out], standalone_mode=False)
    assert ended.return_value == 3
    told = json.dumps(json.loads(ended.stdout))
    assert "camera and wheels disagree" in told
    assert "limit 0.7 s" in told


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_no_false_alarm_on_a_robot_that_slips(seed: int) -> None:
    """Slipping tyres, a robot file off by a fifth, a late camera with drops: nothing disagrees."""
    off = (
        "robot.variant=slip", "duration_s=8", "mismatch.wheel_radius_m=1.2",
        "mismatch.track_m=0.8", "mismatch.floor.friction_ratio=1.2",
        "camera.latency_s=0.1", "camera.latency_jitter_s=0.03", "camera.drop_ratio=0.1",
    )  # fmt: skip
    for scenario, law in (("scenario-1", "pid"), ("scenario-3", "asg-ism")):
        record = run(scenario, off, law, seed)
        assert record.manifest.outcome == "complete", record.manifest.outcome_detail


@pytest.mark.parametrize(
    ("scenario", "seed"), [("scenario-1", 1), ("scenario-2", 1), ("scenario-1", 3)]
)
def test_a_hidden_robot_is_found_where_the_wheels_took_it(scenario: str, seed: int) -> None:
    """Occluded over its first turn: the first poses after it make the estimate better, not worse."""
    hidden = 'faults=[{kind="camera_occluded",start_s=0.25,end_s=0.85}]'
    record = run(scenario, ("duration_s=3", hidden), "asg-ism", seed)
    s = record.samples
    off_m = np.hypot(s["est_x_m"] - s["true_x_m"], s["est_y_m"] - s["true_y_m"])
    assert off_m[(s["t_s"] > 0.98) & (s["t_s"] < 1.3)].max() < 0.01
