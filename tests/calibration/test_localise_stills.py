"""A folder of pictures is taken as stills, each localised for itself, and the command says so."""

from __future__ import annotations

import csv
import json
import math
import subprocess
import sys
from pathlib import Path

import pytest

from hil.config.camera import CameraConfig
from sim_twin.camera_sim import RenderedCamera
from vision.cv_compat import write_image

PLACES = [
    (0.6 * math.cos(k * math.pi / 4), 0.4 * math.sin(k * math.pi / 4), 0.7 * k) for k in range(8)
]


@pytest.fixture(scope="module")
def stills(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make eight pictures of the robot at eight places, and a camera file of its size."""
    folder = tmp_path_factory.mktemp("lab")
    camera = CameraConfig()
    twin = RenderedCamera(camera, 1)
    (folder / "stills").mkdir()
    for k, place in enumerate(PLACES):
        write_image(folder / "stills" / f"place{k}.png", twin.make(k, [place, place]))
    size = f"width_px = {camera.width_px}\nheight_px = {camera.height_px}\n"
    (folder / "camera.toml").write_text(size, encoding="utf-8")
    return folder


def localise(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "hil.cli.main", "localise", *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def test_stills_are_localised_each_for_itself(stills: Path) -> None:
    """Eight of eight at their places to 3 mm; no time is made up; the text says what was assumed."""
    done = localise(stills, "stills", "--out", "rows.csv", "--overlay", "seen.avi")
    assert done.returncode == 0, done.stderr
    assert "robot seen in 8 of 8 frames" in done.stdout
    assert "8 stills, each for itself (--rate HZ" in done.stdout
    with (stills / "rows.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for row, (x_m, y_m, _) in zip(rows, PLACES, strict=True):
        assert math.hypot(float(row["x_m"]) - x_m, float(row["y_m"]) - y_m) < 0.003
        assert row["t_s"] == ""


def test_a_rate_makes_a_video_of_a_folder(stills: Path) -> None:
    """At 30 Hz eight places 0.4 m apart are jumps, and refused; the rate is said."""
    document = json.loads(localise(stills, "stills", "--rate", "30", "--json").stdout)
    assert document["taken_as"] == "a video of 30 Hz"
    assert document["seen"] < 8
    assert any(reason.startswith("jump") for reason in document["not_seen"])


def test_a_rate_for_a_video_is_refused(stills: Path) -> None:
    """Its stamps are its own."""
    done = localise(stills, "film.avi", "--rate", "30")
    assert done.returncode == 2
    assert "--rate is for a folder" in done.stderr
