"""A replay gives the recorded commands bit for bit, or says where it does not."""

from __future__ import annotations

import re
import shutil
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hil.cli.replay import shadow_lines
from hil.config.load import load_scenario
from hil.core.errors import BadInput, RigFault
from hil.core.types import Estimate
from hil.record.journal import read_parquet, write_parquet
from hil.record.reader import read_run
from hil.record.schema import SAMPLE_COLUMNS
from hil.replays.exact import COMMANDS, replay
from hil.rigs.opening import open_rig
from hil.runs.execute import execute
from hil.runs.interruption import CtrlC
from tests.replay.records import cut, record, record_on_wall_clock, spec, unclose

GAIN = "control.gains.tuned.asg_ism.k1_s"
GAIN_VALUE = load_scenario("scenario-1").control.gains.tuned.asg_ism.k1_s


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One short run; tests that change it copy it first."""
    return record(tmp_path_factory.mktemp("replay") / "run").path


@pytest.fixture
def own(shared: Path, tmp_path: Path) -> Path:
    """Return a copy of the run."""
    return Path(shutil.copytree(shared, tmp_path / "run"))


def test_a_record_made_before_a_column_was_added_is_replayed(own: Path) -> None:
    """What an older record does not have is not compared; reading it gives a column without values."""
    table = own / "samples.parquet"
    older = [column for column in SAMPLE_COLUMNS if column.name != "pose_accepted"]
    write_parquet(table, read_parquet(table), older)
    report = replay(own)
    assert report.identical, report.first
    assert "pose_accepted" not in {channel.name for channel in report.channels}
    assert np.isnan(read_run(own).samples["pose_accepted"]).all()


@pytest.mark.parametrize(
    "changes",
    [
        {"outer": "pid"},
        {"inner": "pid", "seed": 7},
        {"overrides": ("duration_s=2", "link.corruption_ratio=0.003", "link.loss_ratio=0.05")},
        {"overrides": ("duration_s=2", "control.estimator=camera-only")},
        {"overrides": ("duration_s=2", "camera.marks.swapped_marks=true")},
        {"overrides": ("duration_s=8",), "extra": {"faults": [{"kind": "link_cut", "start_s": 1}]}},
    ],
    ids=["pid", "inner-pid", "bad-link", "camera-only", "disagree", "fault"],
)
def test_every_kind_of_run_comes_out_bit_for_bit(tmp_path: Path, changes: dict[str, Any]) -> None:
    """Whatever laws, estimator, link and ending: all computed channels equal the record."""
    made = record(tmp_path / "run", **changes)
    report = replay(made.path)
    assert report.identical, report.first
    assert report.ticks_replayed == made.samples["t_s"].size > 20
    assert report.ending.outcome == made.manifest.outcome
    assert not report.problems


def test_frames_go_through_the_localiser_again(tmp_path: Path) -> None:
    """With the video in the record, poses are found anew in its images, bit for bit."""
    made = record(tmp_path / "run", ("duration_s=0.5",), camera="rendered", record_camera=True)
    report = replay(made.path)
    assert report.seen_by == "frames of camera.mkv"
    assert report.identical, report.first
    # Negative control: marks believed to stand elsewhere give other poses in those images.
    report = replay(made.path, None, ["camera.marks.height_m=0.16"])
    assert "frame x_m" in [channel.name for channel in report.channels if not channel.same]


def test_wall_clock_run_comes_out_bit_for_bit(tmp_path: Path) -> None:
    """A host clock that shows another time at each reading does not blur the replay."""
    report = replay(record_on_wall_clock(tmp_path / "run").path)
    assert report.identical, report.first


@pytest.mark.parametrize(
    ("stop", "outcome"),
    [(KeyboardInterrupt(), "interrupted"), (RigFault("port: unplugged"), "fault")],
)
def test_stop_in_mid_run_is_told_again(tmp_path: Path, stop: BaseException, outcome: str) -> None:
    """Ctrl-C and a port that is gone end the replay where and as they ended the run."""
    made = record_on_wall_clock(tmp_path / "run", stop)
    assert made.manifest.outcome == outcome
    report = replay(made.path)
    assert report.identical, report.first
    assert (report.ending.outcome, report.ending.detail) == (
        made.manifest.outcome, made.manifest.outcome_detail,
    )  # fmt: skip
    assert 25 < report.ticks_replayed < 40


def test_ctrl_c_in_the_middle_of_a_tick_is_told_again(tmp_path: Path) -> None:
    """A real SIGINT while the host computes takes effect at the next wait, and so in the replay."""
    own = spec(tmp_path / "run")
    pressed = False

    def press(t_s: float) -> None:
        nonlocal pressed
        if t_s > 1.0 and not pressed:
            pressed = True
            signal.raise_signal(signal.SIGINT)

    handler = signal.getsignal(signal.SIGINT)
    made = execute(own, press)
    assert signal.getsignal(signal.SIGINT) is handler
    assert made.manifest.outcome == "interrupted"
    assert made.samples["t_s"][-1] < 1.1
    report = replay(made.path)
    assert report.identical, report.first
    assert report.ending.outcome == "interrupted"


def test_ctrl_c_reaches_a_host_that_is_always_late(tmp_path: Path) -> None:
    """With 40 ms of work a tick of 33 ms the host never has to wait, and stops all the same."""
    own = spec(tmp_path / "run")
    twin = open_rig("twin", own.scenario, own.camera, own.seed)

    def busy(t_host_s: float, _estimate: Estimate, _armed: bool) -> None:
        while twin.now_s() < t_host_s + 0.04:
            twin.wait(t_host_s + 0.04)

    def press(t_s: float) -> None:
        if 0.3 < t_s < 0.34:
            signal.raise_signal(signal.SIGINT)

    made = execute(own, press, rig=twin, publish=busy)
    assert made.manifest.outcome == "interrupted"
    assert made.samples["t_s"][-1] < 0.5
    report = replay(made.path)
    assert report.ending.outcome == "interrupted"


def test_ctrl_c_is_kept_until_it_is_obeyed_and_the_second_is_not_kept() -> None:
    """Pressed with no wait to come it is there for whoever asks next; twice is at once."""
    with CtrlC() as ctrl_c:
        signal.raise_signal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        ctrl_c.obey()
    ctrl_c.obey()  # once for each time
    with CtrlC():
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_gain_changed_by_one_percent_is_told_apart(shared: Path) -> None:
    """The first difference is a command, at the first tick at which the gain acts."""
    report = replay(shared, None, [f"{GAIN}={1.01 * GAIN_VALUE!r}"])
    assert report.kind == "shadow"
    assert not report.identical
    first = report.first
    assert first is not None
    assert first.name in {*COMMANDS, "v1_m_s3", "u2_m_s2", "zeta_m_s2"}
    assert first.first_s < 0.2  # the limits may hide it at the very first ticks
    different = {channel.name for channel in report.channels if not channel.same}
    assert set(COMMANDS) <= different
    # The states that the shadow saw are the recorded ones.
    assert not {name for name in different if name.startswith(("est_", "frame", "link"))}


def test_shadow_of_the_law_itself_shows_no_difference(shared: Path) -> None:
    """Negative control: a value set to what it was gives the recorded commands."""
    report = replay(shared, None, [f"{GAIN}={GAIN_VALUE!r}"])
    assert report.kind == "shadow"
    assert report.identical


def test_shadow_of_the_other_law_differs_in_commands_only(shared: Path) -> None:
    """PID on the states of an ASG-ISM run: estimate and link as recorded, commands its own."""
    report = replay(shared, "pid")
    same = {channel.name for channel in report.channels if channel.same}
    assert {"est_x_m", "est_theta_rad", "link received", "link sent"} <= same
    assert "eta1_cmd_m_s" not in same
    assert np.isnan(report.samples["s_x_m_s2"]).all()  # PID has no sliding variable


def test_shadow_is_told_by_how_far_its_commands_are(shared: Path) -> None:
    """Both commands and both wheels, RMS and largest in their unit; no figure of 16 digits, no nan."""
    report = replay(shared, "pid")
    recorded = read_run(shared).samples["eta1_cmd_m_s"]
    apart = report.samples["eta1_cmd_m_s"] - recorded
    lines = shadow_lines(report)
    rms, most = np.sqrt(np.mean(apart**2)), np.abs(apart).max()
    assert f"forward speed commanded: {rms:.3g} m/s apart (RMS), {most:.3g} m/s at most" in lines[0]
    assert "rad/s" in lines[1]
    assert not any("nan" in line or re.search(r"\d\.\d{7}", line) for line in lines)
    assert len(lines) == 5


def test_altered_command_is_found_where_it_is(own: Path) -> None:
    """One command raised by one bit in row 40: the digest says altered, the replay says where."""
    columns = read_parquet(own / "samples.parquet")
    column = columns["omega_cmd_left_rad_s"].copy()
    column[40] = np.nextafter(column[40], np.inf)
    columns["omega_cmd_left_rad_s"] = column
    write_parquet(own / "samples.parquet", columns, SAMPLE_COLUMNS)
    report = replay(own)
    assert any("samples.parquet" in problem for problem in report.problems)
    assert not report.identical
    different = [channel for channel in report.channels if not channel.same]
    assert [(channel.name, channel.different) for channel in different] == [
        ("omega_cmd_left_rad_s", 1)
    ]
    assert different[0].first_s == columns["t_s"][40]


def test_altered_link_log_is_found(own: Path) -> None:
    """A byte changed in a frame of link.tlog shows in its direction's channel."""
    data = bytearray((own / "link.tlog").read_bytes())
    data[-30] ^= 1
    (own / "link.tlog").write_bytes(data)
    report = replay(own)
    assert any("link.tlog was altered" in problem for problem in report.problems)
    assert not report.identical


def test_cut_off_record_is_replayed_as_far_as_it_goes(own: Path) -> None:
    """The tape of a process that died, torn in mid-entry: said so, and the rest is exact."""
    unclose(own)
    cut(own / "inputs.tape", 0.7)
    report = replay(own)
    assert report.cut_off
    assert report.identical, report.first
    assert 30 < report.ticks_replayed < report.ticks_recorded
    text = " ".join(report.problems)
    assert "never closed" in text
    assert "inputs.tape is cut off" in text


def test_record_cut_anywhere_is_exact_up_to_there(tmp_path: Path) -> None:
    """Wherever a tape with a wall clock is torn, nothing before the tear comes out differently."""
    folder = record_on_wall_clock(tmp_path / "run").path
    unclose(folder)
    whole = (folder / "inputs.tape").read_bytes()
    for length in range(len(whole) // 2, len(whole), len(whole) // 25 + 1):
        (folder / "inputs.tape").write_bytes(whole[:length])
        report = replay(folder)
        assert report.identical, (length, report.first)
        assert report.cut_off


@pytest.mark.parametrize("name", ["frames.parquet", "samples.parquet"])
def test_lost_table_leaves_the_rest(own: Path, name: str) -> None:
    """Without samples the link still proves the commands; without frames nothing is claimed."""
    (own / name).write_bytes(b"PAR1")
    report = replay(own)
    assert any(name in problem for problem in report.problems)
    if name == "samples.parquet":
        sent = next(channel for channel in report.channels if channel.name == "link sent")
        assert sent.same
        assert sent.rows > 100


def test_damaged_tape_is_used_up_to_the_damage(own: Path) -> None:
    """Bytes that are no entry end the replay there."""
    data = (own / "inputs.tape").read_bytes()
    (own / "inputs.tape").write_bytes(data[: len(data) // 2] + b"\xee" * 40)
    report = replay(own)
    assert any("inputs.tape is" in problem for problem in report.problems)
    assert 0 < report.ticks_replayed < report.ticks_recorded


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("duration_s=9", "duration_s: happened in the record"),
        ("control.rate_hz=20", "ticks of the record"),
        ("control.gains.tuned.asg_ism.k9_s=1", "no such value"),
    ],
)
def test_change_that_makes_no_sense_is_refused(shared: Path, change: str, said: str) -> None:
    """What the record alone decides, and unknown names, are one line."""
    with pytest.raises(BadInput, match=said):
        replay(shared, None, [change])


def test_folder_without_a_tape_is_refused(own: Path, tmp_path: Path) -> None:
    """Records without inputs, and folders that are none, are named as such."""
    (own / "inputs.tape").unlink()
    with pytest.raises(BadInput, match=r"has no inputs\.tape"):
        replay(own)
    with pytest.raises(BadInput, match="not a run record"):
        replay(tmp_path)


def test_record_is_a_target_like_any_other(shared: Path, tmp_path: Path) -> None:
    """`--on replay:RUN`: the session runs on the record, and its own record has the same rows."""
    again = record(tmp_path / "again", target=f"replay:{shared}", camera="as recorded")
    assert again.manifest.outcome == "complete"
    first, second = (read_parquet(path / "samples.parquet") for path in (shared, again.path))
    for name, column in first.items():
        assert np.array_equal(column, second[name], equal_nan=True), name
    # And that record can be replayed in its turn.
    assert replay(again.path).identical
