"""Input that cannot be used: one line, status 2, and nothing is written or moved."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil.record.manifest import read_manifest, write_manifest
from tests.cli.command import hil, run_pose

REFUSED = [
    # what is set, what the line must say
    ('requirements=[{metric="foo",max=1}]', "no such figure"),
    ('requirements=[{metric="iae_m"}]', "iae_m_s"),
    ('requirements=[{metric="iae_m_s"}]', "neither min nor max"),
    ('requirements=[{metric="iae_m_s",min=2,max=1}]', "could never hold"),
    ('requirements=[{metric="iae_m_s",mx=1}]', "unknown key"),
    ("safety.fence_x_min_m=0.9", "fence_x_min_m"),
    ("safety.fence_y_max_m=-3", "fence_y_max_m"),
    ("robot.battery.empty_v=13", "empty_v must be at most full_v"),
    ("control.limits.hold_leave_m=0.001", "hold_leave_m"),
    ('name="../../x"', "name"),
    ('name="a/b"', "name"),
    ('name=".."', "name"),
    ('name="a\\u0000"', "name"),
    ('name="a\\u001b[31m"', "name"),
    ('robot.name="a\\nb"', "robot.name"),
    ("camera.pose.eye_m.²=1", "no such value"),
    ("camera.pose.eye_m.٣=1", "no such value"),
    (f"camera.pose.eye_m.{'9' * 5000}=1", "no such value"),
    (f"duration_s={'9' * 5000}", "duration_s"),
    (f"duration_s={'[' * 5000}", "duration_s"),
    ("duration_s=1\nseed=2", "duration_s"),
    ("board=3", "board"),
    ("control.gains.tuned.asg_ism.k1_s=0", "k1_s = 0 1/s: input should be greater than 0 1/s"),
    ("control.gains.tuned.asg_ism.k2_s=-1", "k2_s = -1 1/s"),
    ("control.gains.tuned.pid.kd2_s=0", "kd2_s = 0 1/s"),
    ("control.gains.tuned.pid.kp_s3=0", "kp_s3 = 0 1/s^3"),
    ("control.gains.thesis.pid.ki_s4=-1", "ki_s4 = -1 1/s^4"),
    ("control.gains.thesis.pid.kd1_s2=0", "kd1_s2 = 0 1/s^2"),
    ("robot.motor.viscous_n_m_s_rad=-1", "-1 N m s/rad"),
    ("robot.motor.torque_constant_n_m_a=2", "2 N m/A"),
    ("robot.motor.gear_ratio=0", "gear_ratio = 0 (ratio)"),
    ("robot.battery.capacity_a_h=0", "0 A h"),
    ("control.rate_hz=3", "at least 5 Hz"),
    ("control.rate_hz=4.9", "at least 5 Hz"),
    ("board.SP_TIMEOUT=20", "SP_TIMEOUT"),
    ("robot.encoder_counts_per_turn=80", "80 counts/turn: input should be greater than or equal to 100"),
    ("robot.encoder_counts_per_turn=20001", "20001 counts/turn"),
    ("robot.encoder_counts_per_turn=20000", "board.OVER_W"),
    ("board.ENC_COUNTS=960", "robot.encoder_counts_per_turn = 1920"),
    ("board.W_MAX=40", "OVER_W = 28 rad/s"),
    ("board.OVER_W=10", "OVER_W = 10 rad/s"),
    ("board.BATT_LOW=12", "BATT_LOW = 12 V"),
    ('board={ST_VAR=1.0,ST_LMIN=300.0}', "ST_LMIN = 300 rad/s^2: must be at most ST_L = 200"),
    ("mismatch={wheel=1.1}", "mismatch.wheel"),
    ("board.LAW=1", "--inner"),
    ('control.outer="pid"', "--outer"),
    ("mismatch={d0_m=30.0}", "d0_m"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "says"), REFUSED)
def test_a_value_that_cannot_be_used_is_refused_before_anything(
    tmp_path: Path, change: str, says: str
) -> None:
    """One line that names it, status 2, and no folder."""
    done = run_pose("--set", change, "--out", tmp_path / "run")
    assert says in done.refusal
    assert len(done.refusal) < 1200
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("rate_hz", [5, 30, 200])
def test_a_rate_that_the_board_can_be_fed_at_runs(tmp_path: Path, rate_hz: int) -> None:
    """From the lowest rate on the robot stays armed to the end of the run."""
    changes = ("--set", f"control.rate_hz={rate_hz}", "--set", "duration_s=1")
    done = run_pose(*changes, "--json", "--out", tmp_path / "run")
    assert (done.json["outcome"], done.json["detail"]) == ("complete", "")


@pytest.mark.parametrize(
    "text",
    [
        'base = "own.toml"\nname = "a"\n',
        "duration_s = " + "9" * 5000,
        "x = " + "[" * 5000,
        'base = "scenario-1"\nboard = 3\n',
        'base = "scenario-1"\n[robot]\nfile = "own.toml"\n',
    ],
)
def test_a_file_that_cannot_be_used_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    """A file on itself, a number or brackets beyond what can be read, a table that is none."""
    monkeypatch.chdir(tmp_path)
    Path("own.toml").write_text(text, encoding="utf-8")
    assert hil("run", "own.toml", "--out", "run").refusal
    assert not Path("run").exists()


def deck(folder: Path, text: str) -> Path:
    """Return a deck file with two scenario files beside it that have one name."""
    for name, x_m in (("one", -0.6), ("two", -0.5)):
        (folder / f"{name}.toml").write_text(
            f'base = "scenario-1"\nname = "same"\n[start]\nx_m = {x_m}\n', encoding="utf-8"
        )
    file = folder / "deck.toml"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('scenarios = ["one.toml", "two.toml"]', "both named 'same'"),
        ('scenarios = ["one.toml", "one.toml"]', "'one.toml' is listed 2 times"),
        ('scenarios = ["scenario-1"]\nlaws = ["pid", "asg-ism", "pid"]', "'pid' is listed 2 times"),
    ],
)
def test_a_deck_in_which_two_runs_would_share_a_folder_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, says: str
) -> None:
    """Refused at the start: else the first one's records are reported for the second."""
    monkeypatch.chdir(tmp_path)
    done = hil("experiment", deck(tmp_path, text), "--camera", "pose", "--out", tmp_path / "e")
    assert says in done.refusal
    assert not (tmp_path / "e").exists()


def test_text_is_shown_as_it_was_typed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Brackets are no markup, in names, folders and tables alike."""
    monkeypatch.chdir(tmp_path)
    name, place = "[b]x[red]y[blue]", "rr[red]"
    short = ("--set", "duration_s=0.2", "--set", f'name="{name}"')
    done = run_pose(*short, "--out", place)
    assert name in done.out
    assert done.out.splitlines()[-1] == f"record: {place}"
    run_pose(*short, "--outer", "pid", "--out", "other")
    table = hil("compare", place, "other").out
    assert name in table


def test_what_does_not_show_is_made_visible() -> None:
    """A line end or an escape sequence in input cannot forge a line or colour a terminal."""
    line = hil("run", "a\nhil: all is well\x1b[2J").refusal
    assert "\\n" in line
    assert "\\x1b" in line


def test_a_record_of_another_task_is_no_target(tmp_path: Path) -> None:
    """A record answers for its own task only; what it answers for is marked as open loop."""
    run_pose("--set", "duration_s=0.5", "--out", tmp_path / "run")
    on = ("--on", f"replay:{tmp_path / 'run'}")
    other = hil("run", "scenario-2", "--set", "duration_s=0.5", *on, "--out", tmp_path / "x")
    assert "name differs (scenario-2 asked, scenario-1 recorded)" in other.refusal
    for change in ("start.x_m=-0.5", "reference.x_m=0.1", "control.rate_hz=20", "duration_s=0.6"):
        done = hil("run", "scenario-1", "--set", "duration_s=0.5", "--set", change, *on,
                   "--out", tmp_path / "x")  # fmt: skip
        assert change.split("_")[0].split(".")[0] in done.refusal
    done = hil("run", "scenario-1", "--set", "duration_s=0.5", *on, "--out", tmp_path / "again")
    assert done.status == 1
    manifest = (tmp_path / "again" / "manifest.json").read_text(encoding="utf-8")
    assert f'"open_loop_of": "{tmp_path / "run"}"' in manifest
    assert '"open_loop_of": ""' in (tmp_path / "run" / "manifest.json").read_text(encoding="utf-8")


def test_a_record_without_a_tick_is_not_replayed(tmp_path: Path) -> None:
    """Nothing is "reproduced bit for bit" where nothing was recorded."""
    run_pose("--set", "start.x_m=5", "--out", tmp_path / "run")
    assert "no tick" in hil("replay", tmp_path / "run").refusal
    manifest = read_manifest(tmp_path / "run").model_copy(update={"outcome": "running"})
    write_manifest(tmp_path / "run", manifest)  # as after a loss of power
    (tmp_path / "run" / "samples.parquet").unlink()
    (tmp_path / "run" / "frames.parquet").unlink()
    assert "no tick" in hil("replay", tmp_path / "run").refusal


def test_a_shadow_that_its_fence_stops_is_status_3(tmp_path: Path) -> None:
    """Status 0 is for a shadow of the whole record."""
    run_pose("--set", "duration_s=0.5", "--out", tmp_path / "run")
    stopped = hil("replay", tmp_path / "run", "--set", "safety.fence_x_min_m=-0.5")
    assert stopped.status == 3
    assert "stopped there: geofence" in stopped.out
    assert hil("replay", tmp_path / "run", "--outer", "pid").status == 0


def test_a_reference_longer_than_the_run_is_said(tmp_path: Path) -> None:
    """A cusp takes a quarter of an hour: errors of its first second are no result."""
    path = 'reference={kind="waypoints",points_m=[[-0.6,-0.35],[0.3,-0.35],[-0.5,-0.34]]}'
    short = ("--set", "duration_s=0.5", "--set", path)
    done = run_pose(*short, "--json", "--out", tmp_path / "run")
    assert "the run ends after 0.5 s" in done.json["notes"][0]
    assert (
        "note: reference.points_m: the way takes" in run_pose(*short, "--out", tmp_path / "two").out
    )
    plain = run_pose("--set", "duration_s=0.5", "--json", "--out", tmp_path / "three")
    assert plain.json["notes"] == []


def test_the_name_of_a_campaign_is_no_path(tmp_path: Path) -> None:
    """Results of a campaign stay where results go."""
    file = tmp_path / "c.toml"
    file.write_text('name = "../x"\nscenario = "scenario-1"\n', encoding="utf-8")
    assert "name: names a folder" in hil("sweep", file).refusal
