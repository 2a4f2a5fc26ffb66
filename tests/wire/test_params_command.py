"""`hil firmware params set` against a board on a port."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from hil.board import _firmware
from tests.wire.test_served import FilmedBoard, served

SET = [sys.executable, "-m", "hil", "firmware", "params", "set", "--on"]


def set_parameters(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command on the board served in `folder`."""
    command = [*SET, str(folder / "board"), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def test_stored_means_that_the_last_byte_is_in_the_eeprom(tmp_path):
    """When the command has said "stored", a board that starts with that EEPROM has the values."""
    board = FilmedBoard()
    with served(tmp_path, board):
        done = set_parameters(tmp_path, "BATT_LOW=10.5", "OVER_W=12", "--store")
        kept = _firmware.Board(board.board.eeprom)
    assert (done.returncode, done.stdout) == (0, "2 set and stored\n"), done.stderr
    assert kept.loaded == _firmware.ImageResult.LOADED
    assert (kept.parameters["BATT_LOW"], kept.parameters["OVER_W"]) == (10.5, 12.0)


def test_an_encoder_that_the_board_cannot_count_is_refused_before_anything_is_sent(tmp_path):
    """ENC_COUNTS 20,000 at OVER_W 28 rad/s is 89,127 counts/s: one line, status 2, nothing set."""
    board = FilmedBoard()
    with served(tmp_path, board):
        done = set_parameters(tmp_path, "BATT_LOW=10.5", "ENC_COUNTS=20000")
    assert done.returncode == 2
    assert "89127 counts/s: the board counts up to 31750 counts/s; lower OVER_W" in done.stderr
    assert done.stderr.count("\n") == 1
    assert board.board.parameters == _firmware.Board().parameters
