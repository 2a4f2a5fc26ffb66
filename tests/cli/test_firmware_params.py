"""`hil firmware params` on the compiled board: list, set, save, compare, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.command import Done, hil
from tests.wire.board_rig import BoardRig


@pytest.fixture
def board(monkeypatch: pytest.MonkeyPatch) -> BoardRig:
    """Return the board that stands behind every port; it keeps what it is told from call to call."""
    rig = BoardRig()
    monkeypatch.setattr("hil.tools.board_parameters.SerialRig", lambda *_: rig)
    return rig


def params(*words: object) -> Done:
    """Run `hil firmware params WORDS --on serial:/dev/ttyX`."""
    return hil("firmware", "params", *words, "--on", "serial:/dev/ttyX")


@pytest.mark.usefixtures("board")
def test_every_parameter_is_listed_with_unit_and_bounds() -> None:
    """All of the board's table, PID_KP among them."""
    done = params("list")
    assert done.status == 0
    assert "PID_KP" in done.out
    assert "ENC_COUNTS" in done.out


@pytest.mark.usefixtures("board")
def test_what_is_set_is_kept_and_compared(tmp_path: Path) -> None:
    """Saved, changed, compared: one difference with both values, status 1; set back: status 0."""
    file = tmp_path / "board.toml"
    assert params("save", file).status == 0
    assert params("compare", file).status == 0
    done = params("set", "PID_KP=0.25", "--store")
    assert (done.status, done.out) == (0, "1 set and stored\n")
    done = params("compare", file)
    assert done.status == 1
    assert done.out.startswith("PID_KP: board 0.25, file ")
    assert len(done.out.splitlines()) == 1


@pytest.mark.usefixtures("board")
@pytest.mark.parametrize(
    ("setting", "said"),
    [("PID_KP", "needs NAME=NUMBER"), ("PID_KP=x", "needs NAME=NUMBER"), ("PID_KQ=1", "PID_KQ"),
     ("PID_KP=-1", "PID_KP"), ("PID_KP=nan", "PID_KP")],
)  # fmt: skip
def test_a_bad_setting_is_refused_before_the_first_is_sent(
    tmp_path: Path, setting: str, said: str
) -> None:
    """The good one beside it is not sent either."""
    params("save", tmp_path / "before.toml")
    assert said in params("set", "PID_KD=0.001", setting).refusal
    assert params("compare", tmp_path / "before.toml").status == 0


@pytest.mark.usefixtures("board")
@pytest.mark.parametrize("text", ["", "board = 3", "[board]\nPID_KP = 'x'", "[board\n"])
def test_a_file_that_is_no_table_of_parameters_is_refused(tmp_path: Path, text: str) -> None:
    """One line with the file's name, before a port is opened."""
    file = tmp_path / "x.toml"
    file.write_text(text, encoding="utf-8")
    assert str(file) in params("compare", file).refusal


def test_a_silent_board_is_a_fault_of_the_rig(board: BoardRig) -> None:
    """Status 3 and one line."""
    board.powered = False
    done = params("list")
    assert done.status == 3
    assert len(done.err.splitlines()) == 1
