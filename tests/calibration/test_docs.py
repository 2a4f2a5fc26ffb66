"""The calibration page's commands without a camera, run as they stand there."""

import csv
import math
import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from hil.cli.main import cli as command
from hil.core.errors import BadInput
from vision.calibration.files import read_camera

PAGE = Path(__file__).parents[2] / "docs" / "calibration.md"


@pytest.fixture(scope="module")
def followed(tmp_path_factory):
    """Follow the page in an empty folder and return it."""
    folder = tmp_path_factory.mktemp("page")
    block = re.search(r"run as\nthey stand:\n\n((?:    hil .*\n)+)", PAGE.read_text())
    lines = [shlex.split(line) for line in block[1].splitlines()]
    assert [line[1] for line in lines] == [
        "twin",
        "calibrate",
        "calibrate",
        "calibrate",
        "localise",
    ]
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for line in lines:
            short = ["--duration", "1"] if line[1] == "twin" else []
            result = CliRunner().invoke(command, [*line[1:], *short])
            assert result.exit_code == 0, (line, result.output, result.exception)
    return folder


def test_the_page_can_be_followed_without_a_camera(followed):
    """What the page says of the result holds: 0.5 % of the focal length, 10 mm, every frame."""
    found, true = (read_camera(followed / name) for name in ("sample.toml", "samples/truth.toml"))
    assert found.lens.fx_px == pytest.approx(true.lens.fx_px, rel=0.005)
    assert math.dist(found.pose.eye_m, true.pose.eye_m) < 0.010
    with (followed / "seen.csv").open() as seen, (followed / "samples/drive.csv").open() as drive:
        rows = list(zip(csv.DictReader(seen), csv.DictReader(drive), strict=True))
    assert len(rows) == 30
    for row, truth in rows:
        assert row["seen"] == "1"
        off = [float(row[k]) - float(truth[k]) for k in ("x_m", "y_m")]
        assert math.hypot(*off) < 3e-3
        assert float(row["t_s"]) == pytest.approx(float(truth["t_s"]), abs=1.1e-3)
    assert all(
        (followed / name).stat().st_size > 1000
        for name in ("seen.avi", "floor.png", "coverage.png")
    )


def test_samples_are_not_written_over_a_folder_in_use(followed):
    """A folder that holds something is left as it is."""
    result = CliRunner().invoke(command, ["twin", "samples", "--out", str(followed)])
    assert isinstance(result.exception, BadInput)
    assert "new folder" in str(result.exception)
    film = CliRunner().invoke(command, ["twin", "film", "--out", str(followed / "film.mp4")])
    assert isinstance(film.exception, BadInput)
    assert not (followed / "film.mp4").exists()


def test_bring_up_has_the_marks_before_they_are_asked_for():
    """The drawing is named before the robot is to be found by its marks."""
    text = (PAGE.parent / "bring-up.md").read_text()
    assert text.index("hil calibrate marks") < text.index("hil localise")
    page = PAGE.read_text()
    assert page.index("hil calibrate marks") < page.index("hil calibrate colours")
