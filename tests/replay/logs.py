"""Logs of other programs for the tests, and the real `hil` command in this process."""

from __future__ import annotations

import math
import struct
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import common

from hil.cli.main import main

MAP = """
scenario = "circle"
set = ["requirements=[]"]
t = { column = "t" }
[columns]
est_x_m = { column = "x" }
est_y_m = { column = "y" }
est_theta_rad = { column = "theta" }
"""
START_US = 1_700_000_000_000_000
RATE_RAD_S = 0.5
SPEED_M_S = 0.3

Command = Callable[..., tuple[int, str, str]]


@pytest.fixture
def hil(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> Command:
    """Return what runs a command line in a new folder: (exit status, stdout, stderr)."""
    monkeypatch.chdir(tmp_path)

    def run(*words: str | Path) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["hil", *map(str, words)])
        with pytest.raises(SystemExit) as end:
            main()
        said = capsys.readouterr()
        return int(end.value.code or 0), said.out, said.err

    return run


def arc(t_s: float) -> tuple[float, float, float]:
    """Return the pose at `t_s` on an arc driven at 0.3 m/s and 0.5 rad/s."""
    theta = RATE_RAD_S * t_s
    radius_m = SPEED_M_S / RATE_RAD_S
    return radius_m * math.sin(theta), radius_m * (1.0 - math.cos(theta)), theta


def arc_rows(count: int = 200, period_s: float = 0.05) -> list[tuple[float, ...]]:
    """Return (t, x, y, theta) of the arc."""
    return [(k * period_s, *arc(k * period_s)) for k in range(count)]


def write_rows(path: Path, rows: Iterable[Iterable[Any]], heading: str = "t,x,y,theta") -> None:
    """Write a CSV file and its mapping beside it."""
    mark = ";" if ";" in heading else ","
    lines = [heading, *(mark.join(str(cell) for cell in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    path.with_suffix(".toml").write_text(MAP, encoding="utf-8")


def stamped(t_s: float, message: Any, link: Any) -> bytes:
    """Return one frame of a telemetry log."""
    return struct.pack(">Q", START_US + round(t_s * 1e6)) + bytes(message.pack(link))


def pose_frames(
    t_s: float, pose: tuple[float, float, float], link: Any, stamp_s: float | None = None
) -> bytes:
    """Return ATTITUDE and LOCAL_POSITION_NED of a pose in the world (X east, Y north)."""
    x_m, y_m, theta = pose
    boot_ms = round(t_s * 1e3)
    yaw = math.remainder(math.pi / 2 - theta, 2 * math.pi)
    at_s = t_s if stamp_s is None else stamp_s
    attitude = common.MAVLink_attitude_message(boot_ms, 0, 0, yaw, 0, 0, 0)
    place = common.MAVLink_local_position_ned_message(boot_ms, y_m, x_m, 0, 0, 0, 0)
    return stamped(at_s, attitude, link) + stamped(at_s, place, link)


def link_of(system: int, component: int = 1) -> Any:
    """Return what numbers and signs the frames of one sender."""
    return common.MAVLink(None, srcSystem=system, srcComponent=component)
