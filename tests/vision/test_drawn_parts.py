"""Frames drawn only where they are looked at: the same pixels, and so the same poses and runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hil.config.load import load_scenario
from hil.core.rig import Frame
from hil.core.types import Pose
from hil.runs.execute import RunSpec, execute_in_memory
from sim_twin.camera_sim import RenderedCamera
from vision.disc_fit import RimFitter
from vision.localisers.making import make_localiser

SCENES = {
    "plain": (),
    "bars and things": (
        "camera.scene.bars=[{frame='world', start_m=[-0.4,0.0], end_m=[0.4,0.1], width_m=0.02,"
        " height_m=0.3, colour=[0.1,0.1,0.1]}]",
        "camera.scene.clutter=[{shape='disc', x_m=0.1, y_m=0.1, theta_rad=0.0, size_m=[0.1,0.1],"
        " height_m=0.0, colour=[0.9,0.1,0.1]}]",
    ),
    "wide": ("camera.width_px=1280", "camera.height_px=720"),
}


def camera_of(*overrides):
    """Return the camera of scenario-1."""
    return load_scenario("scenario-1", overrides).camera


def moving(rng, speed=0.01):
    """Return poses over an exposure, somewhere in view or partly out of it."""
    x, y, theta = rng.uniform(-0.9, 0.9), rng.uniform(-0.7, 0.7), rng.uniform(-3, 3)
    dx, dy, turn = speed * rng.uniform(-1, 1, 3)
    return tuple((x + k * dx / 4, y + k * dy / 4, theta + k * turn / 4) for k in range(5))


def window_of(rng, width, height):
    """Return a part of the frame, small or large, at its edges too."""
    left, right = sorted(rng.integers(0, width + 1, 2))
    top, bottom = sorted(rng.integers(0, height + 1, 2))
    return int(left), int(top), int(right), int(bottom)


@pytest.mark.parametrize("scene", SCENES)
def test_a_window_has_the_pixels_of_the_whole_frame(scene):
    """Whatever was drawn before, at rest and moving, with the robot in the window, beside it or none."""
    config = camera_of(*SCENES[scene])
    drawn, other = RenderedCamera(config, 5), RenderedCamera(config, 5)
    rng = np.random.default_rng(3)
    for index in range(12):
        poses = () if index == 4 else moving(rng, 0.0 if index % 3 == 0 else 0.02)
        frame, whole = drawn.draw(index, poses), other.make(index, poses)
        for _ in range(4):
            left, top, right, bottom = window_of(rng, config.width_px, config.height_px)
            part = frame.part((left, top, right, bottom))[top:bottom, left:right]
            np.testing.assert_array_equal(part, whole[top:bottom, left:right])
        np.testing.assert_array_equal(frame.whole(), whole)
        np.testing.assert_array_equal(Frame(index, 0.0, frame).image, whole)


def test_only_the_window_is_drawn():
    """The rest of the memory is not touched: that is what is saved."""
    renderer = RenderedCamera(camera_of(), 1)._renderer
    image = np.full((480, 640, 3), 77, np.uint8)
    renderer.draw(0, [(0.0, 0.0, 0.0)], (100, 50, 164, 90), image)
    assert (image[50:90, 100:164] != 77).mean() > 0.9
    image[50:90, 100:164] = 77
    assert (image == 77).all()
    with pytest.raises(ValueError, match="window must lie in the view"):
        renderer.draw(0, [], (0, 0, 641, 480), image)


def test_a_pose_is_the_same_from_a_drawing():
    """Near the prediction, far off it, without any, and where no robot is."""
    config = camera_of()
    camera, localiser = RenderedCamera(config, 2), make_localiser(config)
    rng = np.random.default_rng(8)
    found = 0
    for index in range(30):
        poses = () if index % 10 == 9 else moving(rng)
        middle = np.array(poses[2] if poses else (0.0, 0.0, 0.0))
        off = rng.uniform(-1, 1, 3) * (0.002, 0.02, 0.05)[index % 3] * (1.0, 1.0, 4.0)
        predicted = None if index % 7 == 6 else Pose(*(middle + off).tolist())
        seen = localiser.locate(camera.draw(index, poses), predicted, 0.06)
        assert seen == localiser.locate(camera.make(index, poses), predicted, 0.06)
        found += seen.pose is not None
    assert 10 < found < 28


def test_a_fit_that_looks_beside_its_windows_is_found_out():
    """Negative control: a window too small for the rims is told, one that is large enough is not."""
    config = camera_of()
    image = RenderedCamera(config, 2).make(0, [(0.1, 0.05, 0.4)] * 5)
    localiser = make_localiser(config)
    centres = localiser._marks_of(Pose(0.1, 0.05, 0.4))
    rims: RimFitter = localiser._rims
    windows = [rims._fitter.window(centre, 640, 480) for centre in centres]
    marks, missed = rims._fitter.fit_within(image, centres, windows)
    assert not missed
    whole = rims.fit(image, centres)
    assert [disc.u_px for disc in marks] == [disc.u_px for disc in whole]
    for k in range(4):
        smaller = list(windows[1])
        smaller[k] += 9 if k < 2 else -9
        assert rims._fitter.fit_within(image, centres, [windows[0], tuple(smaller)])[1]


def test_a_run_is_the_same_with_whole_frames(monkeypatch):
    """Samples and frames, bit for bit, at the size that is searched in parts too."""
    scenario = load_scenario("scenario-1", ["duration_s=2", *SCENES["wide"]])
    spec = RunSpec(scenario, "twin", "rendered", "asg-ism", "asg-ism", 4, Path())
    parts = execute_in_memory(spec)
    monkeypatch.setattr(RenderedCamera, "draw", RenderedCamera.make)
    whole = execute_in_memory(spec)
    assert parts.manifest.outcome == "complete"
    for table in ("samples", "frames"):
        for name, values in getattr(whole, table).items():
            assert getattr(parts, table)[name].tobytes() == values.tobytes(), name
