"""The measured robot file: what is in it, and that a scenario can use it."""

from __future__ import annotations

import tomllib

import pytest

from hil.config.load import load_robot, load_scenario
from hil.core.errors import BadInput
from hil.tools.bringup.result import Measured
from hil.tools.bringup.robot_file import check_out, write_robot_file

SPEEDS = {
    "dead_duty_forward": (0.15, 0.16),
    "dead_duty_backward": (0.14, 0.15),
    "top_speed_forward_rad_s": (27.0, 26.5),
    "top_speed_backward_rad_s": (26.9, 26.4),
    "top_speed_battery_v": 11.7,
}


def test_only_what_was_measured_stands_in_the_file(tmp_path):
    """1,632 counts a turn were measured: that and the raw figures, each with its how; no more."""
    out = tmp_path / "robot.toml"
    measured = Measured(counts_per_turn=(1630.0, 1634.0), turns=10.0, **SPEEDS)
    assert write_robot_file(out, "thesis-4wd", 1920, measured, "today")
    tree = tomllib.loads(out.read_text())
    assert set(tree) == {"base", "encoder_counts_per_turn", "bring_up"}
    assert all("#" in line for line in out.read_text().splitlines() if " = [" in line)
    assert [path.name for path in tmp_path.iterdir()] == ["robot.toml"]
    robot, believed = load_robot(str(out)), load_robot("thesis-4wd")
    assert robot.encoder_counts_per_turn == 1632
    assert robot.bring_up is not None
    assert robot.bring_up.dead_duty_forward == (0.15, 0.16)
    assert robot.mass_kg == believed.mass_kg


def test_a_count_that_agrees_confirms_the_file(tmp_path):
    """1,915 counted by eye is 1,920 read to a twentieth of a turn: the believed number stays."""
    out = tmp_path / "robot.toml"
    measured = Measured(counts_per_turn=(1915.0, None), turns=10.0)
    assert write_robot_file(out, "thesis-4wd", 1920, measured, "today")
    assert tomllib.loads(out.read_text()) == {
        "base": "thesis-4wd",
        "encoder_counts_per_turn": 1920,
    }


def test_a_scenario_runs_with_the_measured_robot(tmp_path):
    """A scenario beside the file names it; the count reaches the board's parameters' source."""
    measured = Measured(counts_per_turn=(1632.0, 1632.0), turns=10.0)
    write_robot_file(tmp_path / "robot.toml", "thesis-4wd", 1920, measured, "today")
    mine = tmp_path / "mine.toml"
    mine.write_text('base = "scenario-1"\n[robot]\nfile = "robot.toml"\n')
    assert load_scenario(str(mine)).robot.encoder_counts_per_turn == 1632


def test_a_file_lies_on_another_file(tmp_path):
    """A second bring-up in another folder lies on the first one's file, wherever that is."""
    first = tmp_path / "first.toml"
    write_robot_file(
        first, "thesis-4wd", 1920, Measured(counts_per_turn=(1632.0, None), turns=10.0), "today"
    )
    (tmp_path / "sub").mkdir()
    second = tmp_path / "sub" / "second.toml"
    write_robot_file(second, str(first), 1632, Measured(**SPEEDS), "today")
    robot = load_robot(str(second))
    assert robot.encoder_counts_per_turn == 1632
    assert robot.bring_up is not None


def test_nothing_measured_is_nothing_written(tmp_path):
    """A bring-up that came to nothing leaves no file, and one it does not own alone."""
    out = tmp_path / "robot.toml"
    assert not write_robot_file(out, "thesis-4wd", 1920, Measured(), "today")
    assert not out.exists()


def test_a_place_that_cannot_be_written_is_refused_first(tmp_path):
    """A missing folder, a folder, the believed file itself: bad input before a wheel turns."""
    robot = tmp_path / "robot.toml"
    robot.write_text('base = "thesis-4wd"\n')
    with pytest.raises(BadInput, match="no such folder"):
        check_out(tmp_path / "none" / "robot.toml", "thesis-4wd")
    with pytest.raises(BadInput, match="is a folder"):
        check_out(tmp_path, "thesis-4wd")
    with pytest.raises(BadInput, match="the file that --robot names"):
        check_out(robot, str(robot))
