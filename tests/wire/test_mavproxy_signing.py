"""MAVProxy's own signing against the served twin: it sets the key, and speaks signed from then on."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

MAVPROXY = Path(sys.executable).with_name("mavproxy.py")
pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(os.name != "posix", reason="a pseudo-terminal"),
    pytest.mark.skipif(not MAVPROXY.exists(), reason="no MAVProxy; pip install --no-deps mavproxy"),
]

# Seconds to wait before each line.
SIGNED = [
    (5, "signing setup robot"), (6, "param set PWM_MAX 0.5"), (3, "param fetch PWM_MAX"),
    (3, "link"), (2, ""),
]  # fmt: skip
UNSIGNED = [(6, "param set PWM_MAX 0.25"), (4, "link"), (2, "")]


def mavproxy(folder: Path, lines: list[tuple[int, str]]) -> str:
    """Start MAVProxy on the port, type the lines, and return what it has shown."""
    words = [
        sys.executable,
        str(MAVPROXY),
        "--master=./port",
        "--baudrate",
        "57600",
        "--default-modules=signing,param,link",
    ]
    process = subprocess.Popen(
        words,
        cwd=folder,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdin is not None
    for seconds, line in lines:
        time.sleep(seconds)
        process.stdin.write(f"{line}\n")
        process.stdin.flush()
    shown, _ = process.communicate(timeout=30)
    return shown


def test_mavproxy_sets_the_key_and_speaks_signed(tmp_path):
    """Its key is stored; what it sets then is set; one that does not sign changes nothing."""
    served = subprocess.Popen(
        [sys.executable, "-m", "hil", "twin", "serve", "--camera", "pose", "--usb",
         "--pty", "port", "--frames", "frames", "--duration", "60"],
        cwd=tmp_path, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        while not (tmp_path / "port").exists():
            time.sleep(0.1)
        shown = mavproxy(tmp_path, SIGNED)
        assert "AP: signing key stored" in shown
        assert "PWM_MAX = 0.5" in shown
        assert "reject 0)" in shown
        shown = mavproxy(tmp_path, UNSIGNED)
        assert "frame refused: not signed" in shown
        assert "PWM_MAX = 0.25" not in shown
    finally:
        served.terminate()
        served.wait(timeout=10)
