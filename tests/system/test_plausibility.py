"""Faults that only the host can see: named with their evidence, stopped or told as the scenario says."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from hil.cli.main import cli
from hil.config.load import load_scenario
from hil.config.scenario import ReactionsConfig
from hil.core.errors import BadInput, RigFault
from hil.core.rig import Frame
from hil.core.types import Pose, PoseMeasurement
from hil.record.reader import RunRecord
from hil.runs._native import Plausibility
from hil.runs.execute import RunSpec, execute_in_memory
from hil.runs.watching import picture_of, stops
from hil.study.fault_campaign import finished, finished_free, run_fault_free, run_matrix
from hil.study.fault_free import fault_free, most_ratio
from hil.study.fault_matrix import run_cell
from hil.study.work_folder import LOCK, sole_writer

LAWS = ("pid", "asg-ism")
TICK_S = 1.0 / 30.0


def run(scenario: str, overrides: list[str], law: str = "pid") -> RunRecord:
    """Return a run with drawn poses."""
    loaded = load_scenario(scenario, overrides)
    return execute_in_memory(RunSpec(loaded, "twin", "pose", law, "asg-ism", 1, Path()))


def fault(kind: str, side: str = "both", start_s: float = 1.0) -> str:
    return f'faults=[{{kind="{kind}", side="{side}", start_s={start_s}}}]'


@pytest.mark.parametrize("law", LAWS)
def test_a_motor_stuck_in_mid_run_is_named_and_stopped(law: str) -> None:
    """On the circle the board's stall does not see a wheel that creeps; 0.6 s later the host stops."""
    record = run("circle", ["duration_s=8", fault("motor_stuck", "left")], law)
    assert record.manifest.outcome == "fault"
    assert record.manifest.outcome_detail.startswith("motor stuck: left wheels turn")
    assert "(limits 3%, 0.6 s)" in record.manifest.outcome_detail
    assert 1.6 <= record.samples["t_s"][-1] < 1.85


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_weak_side_is_a_diagnosis_and_stops_nothing(side: str) -> None:
    """The fence ends this run; the verdict says which side gives how much of what is asked."""
    record = run("circle", ["duration_s=10", fault("motor_weak", side, 0.0)])
    (told,) = [text for text in record.diagnoses() if text.startswith("side weak")]
    assert told.startswith(f"side weak: {side} side gives 0.")
    given = float(told.split("gives ")[1].split(" ")[0])
    assert 0.4 < given < 0.75
    assert "side weak" not in record.manifest.outcome_detail


def test_the_same_picture_again_and_again_is_named() -> None:
    """New stamps do not make a copy a new picture; it is seen before the wheels have turned 3 rad."""
    record = run("scenario-1", [fault("camera_repeated")])
    assert record.manifest.outcome_detail.startswith("camera: frames repeated: the same picture 6")
    assert record.samples["t_s"][-1] < 1.3


def test_drawn_images_that_repeat_are_told_from_those_of_a_robot_at_rest() -> None:
    """A rendered picture that comes again is the fault; a robot that waits for its start is none."""
    loaded = load_scenario("scenario-1", ["duration_s=2", fault("camera_repeated")])
    spec = RunSpec(loaded, "twin", "rendered", "pid", "asg-ism", 1, Path())
    assert "frames repeated" in execute_in_memory(spec).manifest.outcome_detail


def test_a_reaction_to_warn_goes_on_and_tells_once() -> None:
    """With frames_repeated = warn the run goes on until the camera's own limit ends it."""
    record = run("scenario-1", [fault("camera_repeated"), "safety.reactions.frames_repeated=warn"])
    assert len([text for text in record.diagnoses() if "frames repeated" in text]) == 1
    assert "frames repeated" not in record.manifest.outcome_detail
    with pytest.raises(BadInput, match="frames_repeated"):
        run("scenario-1", ["safety.reactions.frames_repeated=ignore"])


class Told:
    """A monitor, with what it noted."""

    def __init__(self, **reactions: Any) -> None:
        self.notes: list[str] = []
        self.monitor = Plausibility(
            stops(ReactionsConfig(**reactions)), lambda _, text: self.notes.append(text)
        )

    def wheels(
        self, now_s: float, asked: tuple[float, float], given: tuple[float, float], pwm: int = 200
    ) -> None:
        self.monitor.asked(*asked)
        self.monitor.check(now_s, given, (pwm, pwm), 400)


def dips(count: int, length: int, told: Told) -> None:
    """Let the left counts stop `count` times for `length` ticks, once a second."""
    for tick in range(30 * count + 30):
        low = tick >= 30 and tick % 30 < length
        told.wheels(tick * TICK_S, (12.0, 12.0), (0.0 if low else 12.0, 12.0))


def exchanged(told: Told) -> None:
    """Let each side give for a second what the other is asked for."""
    for tick in range(30):
        told.wheels(tick * TICK_S, (3.0, 9.0), (9.0, 3.0))


def nowhere(told: Told) -> None:
    """Stay 0.3 m off for 10 s."""
    for tick in range(300):
        told.monitor.check_progress(tick * TICK_S, 0.3)


def test_counts_that_come_and_go_are_an_intermittent_encoder() -> None:
    """Two dips of 0.13 s; one is none, and neither is a slow fall as in a braking turn."""
    with pytest.raises(RigFault, match="encoder intermittent: left counts stopped and came back 2"):
        dips(2, 4, Told())
    dips(1, 4, Told())
    slow = Told()
    for tick in range(120):
        slow.wheels(tick * TICK_S, (12.0, 12.0), (12.0 * abs(1.0 - tick % 30 / 15.0) + 1.0, 12.0))
    assert not slow.notes


def test_a_change_of_direction_is_no_dip() -> None:
    """Asked forward and backward in turns, the wheels pass through rest each time."""
    told = Told()
    for tick in range(240):
        sign = 1.0 if tick // 30 % 2 == 0 else -1.0
        given = sign * 12.0 * min(tick % 30 / 8.0, 1.0)
        told.wheels(tick * TICK_S, (sign * 12.0, sign * 12.0), (given, given))
    assert not told.notes


def test_sides_that_give_what_the_other_is_asked_are_swapped() -> None:
    """Named after 0.4 s; a side that only stands is not swapped."""
    with pytest.raises(RigFault, match=r"sides swapped: left gives 9.0 rad/s of 3.0 asked"):
        exchanged(Told())
    standing = Told()
    for tick in range(60):
        standing.wheels(tick * TICK_S, (3.0, 9.0), (0.0, 9.0), pwm=100)
    assert not standing.notes


def test_a_robot_that_gets_nowhere_is_stopped_after_8_s() -> None:
    """0.3 m from the goal for 8 s; a slow but steady approach, or being near, is progress."""
    with pytest.raises(RigFault, match=r"no progress: 0.300 m from the goal"):
        nowhere(Told())
    near, slow = Told(), Told()
    for tick in range(900):
        near.monitor.check_progress(tick * TICK_S, 0.14)
        slow.monitor.check_progress(tick * TICK_S, 1.0 - 0.001 * tick)


def test_equal_poses_at_rest_are_no_fault() -> None:
    """Without counts there is nothing that the picture should have shown."""
    told = Told()
    frame = Frame(0, 0.0, None, PoseMeasurement(Pose(0.0, 0.0, 0.0), 1.0))
    for _ in range(100):
        told.monitor.saw(picture_of(frame), (5, 5), 0.01)
    with pytest.raises(RigFault, match="frames repeated"):
        told.monitor.saw(picture_of(frame), (105, 5), 0.0101)


@pytest.mark.parametrize("seed", [4, 10])
def test_runs_without_a_fault_are_left_alone(seed: int) -> None:
    """A short form of `hil faults --fault-free N`, with slip among them."""
    assert fault_free(seed)[1] == ""


def test_runs_without_a_fault_are_kept_and_bounded(tmp_path: Path) -> None:
    """What is done is not done again; 3 / n bounds the share when none of n was stopped."""
    asked = 2
    lines = [{"seed": seed, "said": "stopped" if seed == 1 else ""} for seed in range(1, asked + 1)]
    text = "".join(json.dumps(line) + "\n" for line in lines)
    (tmp_path / "fault_free.jsonl").write_text(text)
    told = run_fault_free(asked, 1, tmp_path, lambda *_: None)
    assert (told["alarms"], told["met"], told["said"]) == (1, False, ["stopped"])
    assert (tmp_path / "fault_free.jsonl").read_text() == text
    assert finished_free(tmp_path, 1) == [1, 2]
    assert most_ratio(0, 2995) == pytest.approx(1e-3, rel=1e-3)  # 1 - 0.05 ** (1 / n)
    assert most_ratio(1, 4742) == pytest.approx(1e-3, rel=1e-2)
    assert most_ratio(5, 5) == 1.0


@pytest.mark.parametrize(
    ("name", "instant"),
    [
        ("frames repeated", "at speed"),
        ("link cut", "closing"),
        ("encoder dead", "before arming"),
        ("host stopped for 1 s", "at speed"),
        ("host's clock steps by -5 s", "at start"),
        ("brown-out, board resets", "at speed"),
        ("colours exchanged", "at speed"),
    ],
)
def test_cells_of_the_matrix(name: str, instant: str) -> None:
    """A short form of `hil faults`; at speed the record is replayed too."""
    cell = run_cell(name, instant, "asg-ism")
    assert not cell.flaws, cell


def test_the_command_keeps_what_it_had(tmp_path: Path) -> None:
    """One cell as JSON with its page; the same command again runs nothing; an unknown row is refused."""
    line = ["faults", "--fault", "link cut", "--at", "at speed", "--outer", "pid", "--json"]
    runner = CliRunner()
    first = runner.invoke(cli, [*line, "--out", str(tmp_path)], catch_exceptions=False)
    assert first.exit_code == 0 or first.return_value == 0
    tree = json.loads(first.stdout)
    (cell,) = tree["cells"]
    assert (cell["outcome"], cell["met"]) == ("fault", True)
    assert "<svg" in (tmp_path / "faults.html").read_text()
    before = (tmp_path / "cells.jsonl").stat().st_mtime_ns
    second = runner.invoke(cli, [*line, "--out", str(tmp_path)], catch_exceptions=False)
    assert json.loads(second.stdout)["cells"] == tree["cells"]
    assert (tmp_path / "cells.jsonl").stat().st_mtime_ns == before
    with pytest.raises(BadInput, match="'no'"):
        runner.invoke(
            cli, ["faults", "--fault", "no"], catch_exceptions=False, standalone_mode=False
        )


def test_a_cell_that_raises_is_not_met_and_done_again(tmp_path: Path) -> None:
    """An error of the harness ends its cell and not the campaign."""
    keys = [("link cut", "closing", "pid"), ("no such fault", "at speed", "pid")]
    told: list[tuple[int, int]] = []
    cells = run_matrix(keys, 1, tmp_path, lambda done, count: told.append((done, count)))
    assert [cell["met"] for cell in cells] == [True, False]
    assert cells[1]["flaws"] == ("error: StopIteration",)
    assert told[-1] == (2, 2)
    assert finished(tmp_path, 1) == keys[:1]


def test_a_host_kept_from_running_has_figures() -> None:
    """Most of its ticks come at once: no slope is taken between those, and the verdict stands."""
    record = run("scenario-1", ["duration_s=3", fault("host_overloaded", start_s=0.0)], "asg-ism")
    steps_s = np.diff(record.samples["t_s"])
    assert np.median(steps_s) == 0.0
    figures = record.figures().values
    assert math.isnan(figures["disturbance_90_m_s3"])
    assert figures["law_ticks"] > 60
    assert record.verdicts()


def test_a_second_campaign_of_faults_in_one_folder_is_refused(tmp_path: Path) -> None:
    """Lines of two writers would be mixed."""
    with (
        sole_writer(tmp_path / LOCK, "the first"),
        pytest.raises(BadInput, match="is writing there"),
    ):
        run_fault_free(1, 1, tmp_path, lambda *_: None)
    assert not (tmp_path / "fault_free.jsonl").exists()


def test_a_line_torn_by_a_full_disk_is_dropped_and_the_others_are_kept(tmp_path: Path) -> None:
    """The next call goes on behind the last whole line, and not within the torn one."""
    path = tmp_path / "fault_free.jsonl"
    whole = '{"seed": 1, "said": ""}\n{"seed": 2, "said": "stopped"}\n'
    path.write_text(whole + '{"seed": 3, "sa')
    told = run_fault_free(2, 1, tmp_path, lambda *_: None)
    assert told["alarms"] == 1
    assert path.read_text() == whole
