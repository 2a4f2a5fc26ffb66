"""The link log is a standard telemetry log: pymavlink's own tools read it with the dialect."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from hil.core.errors import BadInput
from hil.record.tlog import install_dialect, log_entry, read_tlog
from hil.wire import dialect

START_US = 1_714_557_600_000_000


def frames() -> list[tuple[float, bytes]]:
    """Return a set-point of the host and a heartbeat of the board, each with its time."""
    host = dialect.MAVLink(None, srcSystem=255, srcComponent=190)
    board = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    beat = dialect.MAVLink_heartbeat_message(10, 8, 0, 0, 4, 3)
    names = dialect.MAVLink_wheel_setpoint_message.fieldnames
    values = {"omega_left_rad_s": 1.5, "omega_right_rad_s": -2.5}
    setpoint = dialect.MAVLink_wheel_setpoint_message(*(values.get(name, 7) for name in names))
    return [(-0.25, bytes(beat.pack(board))), (1.5, bytes(setpoint.pack(host)))]


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "link.tlog"
    entries = (log_entry(START_US + round(t_s * 1e6), frame) for t_s, frame in frames())
    path.write_bytes(b"".join(entries))
    return path


def test_bytes_are_stamp_then_frame(log):
    """Each frame follows its wall time: 8 bytes, big-endian, microseconds."""
    data = log.read_bytes()
    assert int.from_bytes(data[:8], "big") == START_US - 250_000
    assert data[8] == 0xFD
    assert [(item.unix_us, item.frame) for item in read_tlog(log)] == [
        (START_US - 250_000, frames()[0][1]),
        (START_US + 1_500_000, frames()[1][1]),
    ]


def test_cut_anywhere_gives_the_whole_frames_before(log, tmp_path):
    """A log cut at any byte gives exactly the frames that lie whole before the cut."""
    data, ends = log.read_bytes(), []
    for _, frame in frames():
        ends.append((ends[-1] if ends else 0) + 8 + len(frame))
    cut = tmp_path / "cut.tlog"
    for offset in range(len(data) + 1):
        cut.write_bytes(data[:offset])
        assert len(list(read_tlog(cut))) == sum(end <= offset for end in ends)


def test_mavlogdump_reads_both_directions(log, tmp_path):
    """The real mavlogdump.py, with the dialect installed as documented, names own messages."""
    folder = tmp_path / "dialects"
    folder.mkdir()
    assert install_dialect(folder).name == "hil.py"
    # Stands for the v20 folder of pymavlink, so that a test run leaves the environment as it was.
    hook = f"import pymavlink.dialects.v20 as v; v.__path__.append({str(folder)!r})"
    (tmp_path / "sitecustomize.py").write_text(hook)
    tool = Path(sys.executable).with_name("mavlogdump.py")
    command = [sys.executable, str(tool), "--dialect", "hil", "--format", "json", str(log)]
    environ = os.environ | {"PYTHONPATH": str(tmp_path)}
    done = subprocess.run(command, capture_output=True, text=True, env=environ, check=True)
    beat, setpoint = (json.loads(line) for line in done.stdout.splitlines())
    assert beat["meta"]["type"] == "HEARTBEAT"
    assert beat["meta"]["timestamp"] == pytest.approx(START_US * 1e-6 - 0.25)
    assert setpoint["meta"]["type"] == "WHEEL_SETPOINT"
    assert setpoint["data"]["omega_right_rad_s"] == -2.5


def test_dialect_that_cannot_be_installed_is_one_clear_line(tmp_path):
    """A folder that is not there is named in one line."""
    with pytest.raises(BadInput, match=r"hil.py: the dialect cannot be put there: No such file"):
        install_dialect(tmp_path / "nowhere")
