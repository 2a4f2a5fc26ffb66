"""What the localiser makes of pictures that hold no robot, half of one, or none at all."""

import math

import numpy as np
import pytest

from hil.config.camera import BarConfig, CameraConfig, ClutterConfig, MarksConfig, SceneConfig
from hil.core.types import Pose
from sim_twin.camera_sim import RenderedCamera
from vision.camera_setup import camera_model
from vision.localisers.marks import MarkLocaliser

RED, GREEN = (0.07, 0.06, 0.62), (0.12, 0.42, 0.08)
TRUTH = (0.2, 0.1, 0.5)


def look(scene=None, pose=TRUTH, predicted=None, marks=None):
    """Return what is seen in one frame of the default camera; `marks` are those believed."""
    config = CameraConfig(scene=scene or SceneConfig())
    image = RenderedCamera(config, 1).make(0, [pose] * 2 if pose else [])
    return MarkLocaliser(camera_model(config), marks or config.marks).locate(image, predicted, 0.06)


@pytest.mark.parametrize("value", [0, 255, None])
def test_a_picture_of_nothing_is_not_the_robot(value):
    """Black, white and random frames give no pose but a reason, near a prediction or not."""
    shape = (480, 640, 3)
    image = (
        np.random.default_rng(1).integers(0, 256, shape, dtype=np.uint8)
        if value is None
        else np.full(shape, value, dtype=np.uint8)
    )
    localiser = MarkLocaliser(camera_model(CameraConfig()), CameraConfig().marks)
    for guess in (None, Pose(0.1, 0.1, 0.1), Pose(30.0, 0.0, 0.0)):
        seen = localiser.locate(image, guess, 0.06)
        assert (seen.pose, seen.quality) == (None, 0.0)
        assert seen.reason


def test_marks_too_far_apart_are_not_the_robot():
    """Discs of the marks' sizes and colours 0.4 m apart are refused for their distance."""
    things = (
        ClutterConfig(x_m=-0.2, y_m=0.0, colour=RED),
        ClutterConfig(x_m=0.2, y_m=0.0, colour=GREEN),
    )
    seen = look(SceneConfig(clutter=things), pose=None)
    assert seen.pose is None
    assert "apart" in seen.reason


@pytest.mark.parametrize("x_m", [0.08, -0.08])
def test_one_mark_alone_is_not_the_robot(x_m):
    """With either mark covered there is no pose, near the true prediction or without one."""
    sheet = BarConfig(
        frame="body", start_m=(x_m, -0.03), end_m=(x_m, 0.03), width_m=0.08, height_m=0.101
    )
    for guess in (None, Pose(*TRUTH)):
        seen = look(SceneConfig(bars=(sheet,)), predicted=guess)
        assert seen.pose is None
        assert seen.reason


def test_marks_of_another_size_are_not_the_robot():
    """Believed a quarter larger than they are, the same marks are refused."""
    assert look().pose is not None
    assert look(marks=MarksConfig(diameter_m=0.075)).pose is None


def test_a_prediction_out_of_the_picture_costs_no_pose():
    """A prediction behind the camera or far away falls back to the whole frame."""
    for guess in (Pose(30.0, 0.0, 0.0), Pose(0.0, -40.0, 0.0)):
        seen = look(predicted=guess)
        assert seen.pose is not None
        assert math.hypot(seen.pose.x_m - TRUTH[0], seen.pose.y_m - TRUTH[1]) < 1e-3


def test_a_cable_that_rides_on_the_robot_costs_a_millimetre_and_no_pose():
    """A cable over one side of the front mark: every heading gives a pose, 1.5 mm off at most."""
    cable = BarConfig(
        frame="body", start_m=(0.060, -0.16), end_m=(0.078, 0.16), width_m=0.008, height_m=0.12
    )
    config = CameraConfig(scene=SceneConfig(bars=(cable,)))
    camera, localiser = RenderedCamera(config, 1), MarkLocaliser(camera_model(config), config.marks)
    for index in range(16):
        x, y, theta = 0.5 * math.cos(index), 0.3 * math.sin(index), 0.4 * index
        image = camera.make(index, [(x, y, theta)] * 2)
        seen = localiser.locate(image, Pose(x + 0.003, y, theta), 0.06)
        assert seen.pose is not None
        assert math.hypot(seen.pose.x_m - x, seen.pose.y_m - y) < 1.5e-3
