"""What the localiser makes of pictures that hold no robot, half of one, or none at all."""

import math
from random import Random

import numpy as np
import pytest

from hil.config.camera import BarConfig, CameraConfig, ClutterConfig, MarksConfig, SceneConfig
from hil.core.errors import BadInput
from hil.core.types import Pose
from hil.tools.look_alikes import PLATE, look_alike
from sim_twin.camera_sim import RenderedCamera
from vision.camera_setup import camera_model
from vision.localisers.marks import MarkLocaliser
from vision.rivals import THIRD_MARK

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


@pytest.mark.parametrize("shape", [(480, 640), (480, 640, 4), (0, 640, 3)])
def test_a_picture_without_colours_is_refused_in_one_line(shape):
    """Grey, four channels, empty, and numbers that are no bytes: what it is, and what it must be."""
    localiser = MarkLocaliser(camera_model(CameraConfig()), CameraConfig().marks)
    for image in (np.zeros(shape, np.uint8), np.zeros((480, 640, 3), np.float32)):
        for guess in (None, Pose(*TRUTH)):
            with pytest.raises(BadInput, match=r"^image: .*must be \(H, W, 3\) uint8"):
                localiser.locate(image, guess, 0.06)


def sheet_and_disc(x_m, y_m, colour, height_m):
    """Return a disc of a mark's size on a dark sheet."""
    sheet = ClutterConfig(
        shape="box", x_m=x_m, y_m=y_m, size_m=(0.12, 0.12), height_m=height_m, colour=PLATE
    )
    top = height_m + 0.001
    return sheet, ClutterConfig(x_m=x_m, y_m=y_m, size_m=(0.06, 0.06), height_m=top, colour=colour)


def beside_a_green_mark(kind, height_m, seed=7, away_m=0.158):
    """Return a look-alike at rest with a red disc beside its green mark, off its plate."""
    place = Pose(-0.1, 0.1, 0.3)
    things = list(look_alike(Random(seed), place, kind))
    green = [thing for thing in things[1:] if thing.colour[1] > thing.colour[2]][-1]
    x_m, y_m = green.x_m + away_m * math.sin(1.2), green.y_m - away_m * math.cos(1.2)
    return things, green, sheet_and_disc(x_m, y_m, RED, height_m)


def test_a_red_disc_beside_a_plate_of_two_green_marks_is_not_told_from_the_robot():
    """It has the robot's two colours, distance and ground: not believed for the second green mark.

    Without that one it is the robot, as far as two marks can say; and so it is where somebody says that
    ours stands there.
    """
    seed = next(
        s
        for s in range(20)
        if list(look_alike(Random(s), Pose(0.0, 0.0, 0.0), "colour"))[1].colour[1] > 0.2
    )
    things, green, disc = beside_a_green_mark("colour", 0.099, seed)
    seen = look(SceneConfig(clutter=(*things, *disc)), pose=None)
    assert seen.pose is None
    assert seen.reason == THIRD_MARK
    alone = tuple(
        thing for thing in (*things, *disc) if thing.shape == "box" or thing.colour == RED
    )
    assert look(SceneConfig(clutter=(*alone, green)), pose=None).pose is not None
    told = MarksConfig(which_m=(green.x_m, green.y_m))
    assert look(SceneConfig(clutter=(*things, *disc)), pose=None, marks=told).pose is not None


def test_a_reflection_with_a_red_disc_beside_it_is_not_the_robot():
    """The robot's image in a shining floor, and a red disc on a dark sheet, as far off as marks seem there.

    A localiser of a robot with further marks, which asks for no third one, takes it.
    """
    things, _, disc = beside_a_green_mark("reflection", 0.001, away_m=0.166)
    camera = CameraConfig(scene=SceneConfig(clutter=(*things, *disc)))
    image = RenderedCamera(camera, 1).make(0, [])
    finders = [
        MarkLocaliser(camera_model(camera), camera.marks, alone=alone) for alone in (True, False)
    ]
    alone, among_more = (finder.locate(image, None, 0.06) for finder in finders)
    assert alone.pose is None
    assert alone.reason == THIRD_MARK
    assert among_more.pose is not None


def test_the_robot_is_found_beside_discs_that_lie_its_distance_away():
    """Discs of both colours 160 mm from either mark, on the bright floor, cost no pose."""
    c, s = math.cos(TRUTH[2]), math.sin(TRUTH[2])
    marks = [(TRUTH[0] + way * 0.08 * c, TRUTH[1] + way * 0.08 * s) for way in (1.0, -1.0)]
    things = [
        ClutterConfig(x_m=x - side * 0.16 * s, y_m=y + side * 0.16 * c, colour=colour)
        for (x, y), side, colour in zip(marks, (1.0, -1.0), (GREEN, RED), strict=True)
    ]
    seen = look(SceneConfig(clutter=tuple(things)))
    assert seen.pose is not None
    assert math.dist((seen.pose.x_m, seen.pose.y_m), TRUTH[:2]) < 0.001


@pytest.mark.parametrize(("away_m", "seen"), [(0.1664, False), (0.160, True)])
def test_discs_too_small_for_their_distance_are_not_the_robot(away_m, seen):
    """Discs of 57 mm on dark sheets, 4 % too far apart, are not one thing from a wrong height.

    At the robot's distance they are its marks, cut small.
    """
    half = 0.5 * away_m
    things = [
        part
        for x_m, colour in ((-half, GREEN), (half, RED))
        for part in sheet_and_disc(x_m, 0.0, colour, 0.099)
    ]
    small = [
        t.model_copy(update={"size_m": (0.057, 0.057)}) if t.shape == "disc" else t for t in things
    ]
    found = look(SceneConfig(clutter=tuple(small)), pose=None)
    assert (found.pose is not None) == seen
