"""The Rerun file holds every chart, the floor plan, camera and events on one timeline."""

from __future__ import annotations

import resource
import subprocess
import sys

import pytest

from hil.core.errors import BadInput
from hil.record import viewer
from hil.record.rrd import PLOTS, entity_names, write_rrd
from hil.record.schema import SAMPLE_NAMES
from tests.record.synthetic import make_run


def rerun(*arguments):
    """Run Rerun's own command line, which reads the file with other code than wrote it."""
    command = [sys.executable, "-m", "rerun", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    return [
        make_run(folder / law, law, images=law == "pid", rerun=law == "pid")
        for law in ("pid", "asg-ism")
    ]


def test_recorder_writes_a_valid_file_with_everything(runs):
    """A closed record has a run.rrd that Rerun verifies, with the run's entities in it."""
    path = runs[0].path / "run.rrd"
    rerun("rrd", "verify", path)
    text = rerun("rrd", "print", path)
    for entity in ("floor/robot", "floor/path", "camera/image", "camera/image/marks", "events"):
        assert f"/scenario-1/pid/{entity}" in text
    for plot in PLOTS:
        there = f"/scenario-1/pid/{plot.key}" in text
        assert there is (plot.key != "sliding"), plot.key  # PID has no sliding variable


@pytest.mark.parametrize("share", [0.1, 0.5, 0.999])
def test_a_file_that_may_not_grow_is_an_error_and_no_endless_wait(runs, tmp_path, share):
    """Rerun's own writer waits for ever then; nothing half-written is left."""
    size = (runs[0].path / "run.rrd").stat().st_size
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(share * size), before[1]))
    try:
        with pytest.raises(OSError, match="too large"):
            write_rrd(tmp_path / "run.rrd", runs[:1])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert not list(tmp_path.iterdir())


def test_plots_name_columns_of_the_schema():
    """Every line of a chart is a recorded column or the error derived from it."""
    columns = [column for plot in PLOTS for _, column, _ in plot.lines]
    assert all(name in SAMPLE_NAMES or name.startswith("error_") for name in columns)


def test_several_runs_share_a_timeline_under_names_of_their_own(runs, tmp_path):
    """Two runs in one file stand under their law; two of one law are numbered."""
    path = tmp_path / "both.rrd"
    write_rrd(path, runs)
    text = rerun("rrd", "print", path)
    assert "/scenario-1/pid/error" in text
    assert "/scenario-1/asg-ism/error" in text
    assert "/scenario-1/asg-ism/sliding" in text
    assert entity_names([runs[0], runs[0]]) == ["scenario-1/pid-1", "scenario-1/pid-2"]


def test_viewer_without_a_display_says_how_to_look_elsewhere(runs, monkeypatch):
    """No display: one line with the file and the command for a browser; nothing is started."""
    monkeypatch.setattr(viewer, "has_display", lambda _environ: False)
    with monkeypatch.context() as patch:
        patch.setattr(viewer.subprocess, "Popen", None)
        line = viewer.open_viewer([runs[0].path])
    assert str(runs[0].path / "run.rrd") in line
    assert "--serve-web" in line
    several = viewer.viewable_file([run.path for run in runs])
    rerun("rrd", "verify", several)
    with pytest.raises(BadInput, match="not a run record"):
        viewer.open_viewer([runs[0].path.parent])


def test_display_is_told_by_the_environment():
    """X11 or Wayland on Linux; macOS and Windows always have one."""
    assert viewer.has_display({"DISPLAY": ":0"}, "linux")
    assert viewer.has_display({"WAYLAND_DISPLAY": "wayland-0"}, "linux")
    assert not viewer.has_display({}, "linux")
    assert viewer.has_display({}, "darwin")
