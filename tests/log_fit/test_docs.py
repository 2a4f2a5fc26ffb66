"""Every block of docs/own-robot-fit.md does what the page says."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import tests.log_fit.coverage as coverage_script
from tests.log_fit.twins import Answer, drive
from tests.replay.logs import Command, hil

__all__ = ["hil"]

PAGE = Path(__file__).parents[2] / "docs" / "own-robot-fit.md"
BLOCKS = re.findall(
    r"^```(\w+)\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
)


def write_logs(mapping: str) -> None:
    """Write the two logs that the page speaks of, and its mapping."""
    Path("my_map.toml").write_text(
        'scenario = "circle"\nset = ["requirements=[]"]\n' + mapping, encoding="utf-8"
    )
    for name, seed in (("my_log.csv", 31), ("other_log.csv", 32)):
        log = drive(Answer(), seed, 20.0, pose_hz=15.0)
        row = np.clip(
            np.searchsorted(log.commands[:, 0], log.poses[:, 0], side="right") - 1, 0, None
        )
        lines = ["ms,X_mm,Y_mm,yaw_deg,v,w"]
        for (t, x, y, a), (_, v, w) in zip(log.poses, log.commands[row], strict=True):
            lines.append(f"{1e3 * t},{1e3 * x},{1e3 * y},{57.29577951308232 * a},{v},{w}")
        Path(name).write_text("\n".join(lines) + "\n", encoding="utf-8")


def test_the_page_from_top_to_bottom(hil: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """The mapping is one, each command ends well, the robot file tells the distance scale."""
    write_logs(next(text for kind, text in BLOCKS if kind == "toml"))
    ran: list[str] = []
    measured: list[tuple[str, int]] = []

    def measure(layer: str, twins: int) -> dict[str, list[tuple[bool, float]]]:
        measured.append((layer, twins))
        return {"veer_rad_m": [(True, 1.0)]}

    for kind, text in BLOCKS:
        for line in text.splitlines() if kind == "console" else ():
            words = shlex.split(line)
            if words[0] == "hil":
                status, _, err = hil(*words[1:])
                assert status == 0, f"{line}: {err}"
            else:
                assert words[:3] == ["python", "-m", "tests.log_fit.coverage"], line
                monkeypatch.setattr(coverage_script, "measure", measure)
                monkeypatch.setattr("sys.argv", ["coverage", *words[3:]])
                coverage_script.main()
            ran.append(words[0])
    assert ran.count("hil") == 4
    assert measured == [(layer, 20) for layer in coverage_script.LAYERS]
    assert '"body.distance_scale_ratio"' in Path("my_robot.toml").read_text(encoding="utf-8")
    assert Path("my_robot.html").is_file()
