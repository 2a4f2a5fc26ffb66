"""Whatever ends a run, the robot is stopped first, the record is whole or readable, the status is right."""

from __future__ import annotations

import errno
import json
import os
import random
import shutil
import signal
import subprocess
import sys
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import pytest

from hil.config.load import load_scenario
from hil.core.errors import BadInput, HilError, RecordFault, RigFault, Stopped
from hil.core.files import unwritable
from hil.record import closing
from hil.record.manifest import read_manifest, write_manifest
from hil.record.reader import read_run
from hil.record.recorder import Recorder
from hil.replays.exact import replay
from hil.runs.execute import RunSpec, execute, exit_status
from hil.study.side_by_side import still_to_do
from tests.ends import drawn
from tests.ends.commands import COMMANDS

pytestmark = pytest.mark.realtime

HIL = [sys.executable, "-m", "hil"]


def spec(out: Path, *overrides: str, duration_s: float = 1.0, estimator: str = "") -> RunSpec:
    """Return a short run on the twin."""
    chosen = [f"control.estimator={estimator}"] if estimator else []
    scenario = load_scenario("circle", [f"duration_s={duration_s}", *chosen, *overrides])
    return RunSpec(scenario, "twin", "pose", "asg-ism", "asg-ism", 1, out, rerun=False)


@pytest.mark.parametrize("kind", drawn.kinds())
def test_the_real_process_ended_at_a_drawn_instant(tmp_path: Path, kind: str) -> None:
    """A short form of `python -m tests.ends.drawn`: one end of each kind."""
    done = drawn.end(COMMANDS["run"], kind, random.Random(f"short/{kind}"), tmp_path)
    assert not done.flaws, done


@pytest.mark.parametrize("number", drawn.SIGNALS)
def test_a_signal_names_itself_and_a_replay_is_told_it_too(
    tmp_path: Path, number: signal.Signals
) -> None:
    """In mid-run the signal is the outcome's detail, its status 128 and its number."""

    def press(t_s: float) -> None:
        if 0.5 < t_s < 0.54:
            signal.raise_signal(number)

    made = execute(spec(tmp_path / "run"), press)
    names = {signal.SIGINT: "Ctrl-C", signal.SIGTERM: "SIGTERM", signal.SIGHUP: "SIGHUP"}
    assert made.manifest.outcome == "interrupted"
    assert made.manifest.outcome_detail == names[number]
    assert exit_status(made) == 128 + number
    assert [event.kind for event in made.events][-2:] == ["stopped", "interrupted"]
    again = replay(made.path)
    assert again.identical
    assert again.ending.detail == names[number]


@pytest.mark.parametrize("times", [1, 3])
def test_signals_while_the_record_is_closed_wait_for_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, times: int
) -> None:
    """Closing is finished, then the signal is obeyed; pressed again it does not help."""
    stop_writers = Recorder._stop_writers

    def press(self: Recorder) -> None:
        for _ in range(times):
            signal.raise_signal(signal.SIGTERM)
        stop_writers(self)

    monkeypatch.setattr(Recorder, "_stop_writers", press)
    with pytest.raises(Stopped, match="SIGTERM"):
        execute(spec(tmp_path / "run"))
    made = read_run(tmp_path / "run")
    assert made.manifest.outcome == "complete"
    assert not made.problems
    assert "samples.parquet" in made.manifest.files


def test_a_file_limit_in_mid_run_stops_the_robot_and_keeps_what_was_written(tmp_path: Path) -> None:
    """The stop command goes out after the last row that could be written; what is there replays."""
    own = spec(tmp_path / "run", duration_s=10.0)
    command = [
        *HIL, "run", "circle", "--camera", "pose", "--set", "duration_s=10", "--out", str(own.out),
    ]  # fmt: skip
    pipe = subprocess.PIPE
    process = subprocess.Popen(command, text=True, stdout=pipe, stderr=pipe)
    drawn.limit_files(process, 20_000)
    out, said = process.communicate(timeout=60)
    assert process.returncode == 3
    assert out == ""
    assert said.count("\n") == 1
    assert "File too large" in said
    made = read_run(own.out)
    assert made.manifest.outcome == "fault"
    assert "File too large" in made.manifest.outcome_detail
    assert 30 < made.samples["t_s"].size < 100
    again = replay(own.out)
    assert again.identical, again.first


def test_a_full_disk_has_room_for_the_last_manifest(tmp_path: Path) -> None:
    """On a disk of 256 KB the record ends as a fault that names the disk, and can be read."""
    disk = tmp_path / "disk"
    disk.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(disk)]
    if os.geteuid() != 0 or subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("a disk of its own needs the right to mount one")
    try:
        with pytest.raises(RecordFault, match="No space left on device"):
            execute(spec(disk / "run", duration_s=20.0))
        made = read_run(disk / "run")
    finally:
        subprocess.run(["umount", str(disk)], check=True)
    assert made.manifest.outcome == "fault"
    assert "No space left on device" in made.manifest.outcome_detail
    assert made.samples["t_s"].size > 30


def test_a_folder_that_goes_away_is_seen_within_a_second_and_the_robot_is_stopped(
    tmp_path: Path,
) -> None:
    """The run does not go on for its 20 s with nothing to write to."""
    reached = 0.0

    def remove(t_s: float) -> None:
        nonlocal reached
        reached = t_s
        if 0.5 < t_s < 0.54:
            shutil.rmtree(tmp_path / "run")

    with pytest.raises(RecordFault, match="the folder has gone away"):
        execute(spec(tmp_path / "run", duration_s=20.0), remove)
    assert reached < 1.6


_ESTIMATOR = """
import hil
from hil.control.estimators.making import make_estimator

class Mine:
    def __init__(self, settings, geometry):
        self._inner = make_estimator("fused", settings, geometry)
        self._seen = 0
    def __getattr__(self, name):
        return getattr(self._inner, name)
    def on_wheels(self, sample):
        self._inner.on_wheels(sample)
    def on_command(self, t_s, eta1_m_s, theta_dot_rad_s):
        self._inner.on_command(t_s, eta1_m_s, theta_dot_rad_s)
    def estimate_at(self, t_s):
        return self._inner.estimate_at(t_s)
    def on_pose(self, t_s, measurement):
        self._seen += 1
        if self._seen > 90:
            raise ZeroDivisionError("by my own hand")
        return self._inner.on_pose(t_s, measurement)

hil.estimator("mine")(Mine)
"""


_MADE = """def __init__(self, settings, geometry):
        self._inner = make_estimator("fused", settings, geometry)
        self._seen = 0"""


@pytest.mark.parametrize(
    "step", ["journal_to_parquet", "read_events", "read_pictures", "replace_file"]
)
def test_a_folder_that_goes_away_while_the_record_is_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    """Whatever finds it gone, and whatever that raises, it is told as what it is."""
    then = getattr(closing, step)

    def gone(*arguments: object) -> object:
        shutil.rmtree(tmp_path / "run", ignore_errors=True)
        return then(*arguments)

    monkeypatch.setattr(closing, step, gone)
    with pytest.raises(RecordFault, match="cannot be written any more"):
        execute(replace(spec(tmp_path / "run"), rerun=True))
    assert not (tmp_path / "run").exists()


def test_an_estimator_of_ones_own_that_raises_is_named_with_its_line(tmp_path: Path) -> None:
    """Robot stopped, record closed, outcome a fault that names file and line; no traceback."""
    file = tmp_path / "mine.py"
    file.write_text(_ESTIMATOR)
    made = execute(spec(tmp_path / "run", duration_s=5.0, estimator=str(file)))
    assert made.manifest.outcome == "fault"
    assert "mine.py, line 20" in made.manifest.outcome_detail
    assert "by my own hand" in made.manifest.outcome_detail
    assert exit_status(made) == 3
    assert {"stopped", "stop"} & {event.kind for event in made.events}


@pytest.mark.parametrize(
    ("raised", "error", "outcome"),
    [
        ("ZeroDivisionError('by hand')", RigFault, "fault"),
        ("KeyboardInterrupt", None, "interrupted"),
    ],
)
def test_a_part_that_cannot_be_made_leaves_a_closed_record(
    tmp_path: Path, raised: str, error: type[Exception] | None, outcome: str
) -> None:
    """The record is open by then: it says how it ended, and what came from outside is named."""
    file = tmp_path / "mine.py"
    made = (
        f"def __init__(self, settings, geometry):\n        raise {raised}\n        self._seen = 0"
    )
    text = _ESTIMATOR.replace(_MADE, made)
    assert text != _ESTIMATOR
    file.write_text(text.replace('"mine"', f'"mine-{outcome}"'))
    with pytest.raises(error) if error is not None else nullcontext():
        execute(spec(tmp_path / "run", estimator=str(file)))
    found = read_manifest(tmp_path / "run")
    assert found.outcome == outcome
    assert ("by hand" if error is not None else "Ctrl-C") in found.outcome_detail


def test_an_error_of_the_harness_itself_leaves_robot_and_record_in_order(tmp_path: Path) -> None:
    """It is raised in the end, with its traceback; the record says fault, not running."""

    def fail(t_s: float) -> None:
        if t_s > 0.5:
            raise LookupError("not expected")

    with pytest.raises(LookupError):
        execute(spec(tmp_path / "run"), fail)
    made = read_run(tmp_path / "run")
    assert made.manifest.outcome == "fault"
    assert "LookupError: not expected" in made.manifest.outcome_detail
    assert "stopped" in [event.kind for event in made.events]


def test_a_reader_that_goes_away_is_no_end(tmp_path: Path) -> None:
    """`| head` gets its line; the status is the run's own and stderr stays quiet."""
    out = tmp_path / "run"
    line = (
        f"set -o pipefail; {' '.join(HIL)} run circle --camera pose --set duration_s=1 --json "
        f"--out {out} | true"
    )
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=False)
    assert done.stderr == ""
    assert done.returncode == 1  # in a second the circle's requirement cannot hold
    assert json.loads((out / "manifest.json").read_text())["outcome"] == "complete"


def test_results_that_cannot_be_written_are_no_verdict() -> None:
    """A full disk behind stdout is one line and status 3."""
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*HIL, "--help"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 3
    assert done.stderr.splitlines() == ["hil: output cannot be written: No space left on device"]


@pytest.mark.parametrize(
    ("number", "kind"),
    [(errno.ENOSPC, RigFault), (errno.EFBIG, RigFault), (errno.ENOENT, BadInput)],
)
def test_a_full_disk_is_a_fault_and_a_wrong_path_is_not(number: int, kind: type[HilError]) -> None:
    """So that a report on a full disk ends with 3 and one in no folder with 2."""
    error = unwritable("report x.html", OSError(number, os.strerror(number)))
    assert type(error) is kind
    assert str(error) == f"report x.html: cannot be written: {os.strerror(number)}"


def test_a_run_whose_record_could_not_be_finished_is_done_anew(tmp_path: Path) -> None:
    """A fault of the rig is a result; a record that the disk cut short is none."""
    own = spec(tmp_path / "run", 'faults=[{kind="link_cut", start_s=0.5}]')
    made = execute(own)
    assert made.manifest.outcome == "fault"
    said: list[str] = []
    assert still_to_do([own], said.append) == []
    write_manifest(made.path, made.manifest.model_copy(update={"files": {}}))
    assert still_to_do([own], said.append) == [own]
    assert "its record could not be finished" in said[0]
    assert not own.out.exists()
