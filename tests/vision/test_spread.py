"""Several robots alike, and the search of a large frame spread over several frames."""

import math
from functools import cache
from itertools import pairwise

import pytest

from hil.config.camera import CameraConfig, ClutterConfig, MarkConfig, TagConfig
from hil.core.types import Pose
from hil.tools import vision_conditions as bench
from tests.vision.scenes import DEFAULT, errors, localiser, rendered
from vision.camera_setup import camera_model
from vision.localisers.tags import TagLocaliser
from vision.many_marks import ManyMarks
from vision.spread import SpreadSearch, spread, strips_of

HD = (1280, 720)
STILL = bench.CONDITIONS["clean"]
OTHER_M = (0.55, -0.2)


def look_alike(x_m, y_m):
    """Return a plate with two marks, the robot's equal, heading along x."""
    marks = CameraConfig().marks
    plate = ClutterConfig(
        shape="box", x_m=x_m, y_m=y_m, size_m=(0.26, 0.16), height_m=0.099, colour=(0.05,) * 3
    )
    discs = [
        ClutterConfig(
            x_m=x_m + mark.x_m, y_m=y_m, size_m=(0.06, 0.06), height_m=0.1, colour=mark.colour
        )
        for mark in marks.all
    ]
    return (plate, *discs)


@cache
def picture(x_m, y_m, rival=False):
    """Return a picture of a robot at a place, heading 0.3 rad, and its camera."""
    camera = bench.camera_of("ceiling", HD, STILL, clutter=look_alike(*OTHER_M) if rival else ())
    return camera, rendered(camera).make(0, [(x_m, y_m, 0.3)] * 2)


def with_which(camera, which_m):
    return camera.model_copy(update={"marks": camera.marks.model_copy(update={"which_m": which_m})})


def test_a_small_frame_is_searched_at_once():
    """640 x 480 takes one search; 1280 x 720 takes strips that cover it and overlap by a robot."""
    finder = localiser(DEFAULT)
    assert spread(finder) is finder
    camera, _ = picture(-0.5, 0.1)
    large = localiser(camera)
    strips = strips_of(large)
    assert len(strips) == 3
    assert strips[0][0] == 0
    assert strips[-1][2] == 1280
    for one, other in pairwise(strips):
        assert one[2] - other[0] >= large.span_px
    # 0.28 m of marks and their surroundings at 2.3 m with f = 1,100 px or so
    assert 100 < large.span_px < 200


@pytest.mark.parametrize("x_m", [-0.6, -0.2, 0.05, 0.4, 0.65])
def test_found_after_every_strip_was_searched(x_m):
    """The robot drives at 0.5 m/s; two frames say how far the search is, the third has the pose."""
    camera, _ = picture(x_m, 0.1)
    finder = spread(localiser(camera))
    assert isinstance(finder, SpreadSearch)
    told = []
    for k in range(3):
        at_m = x_m + k * 0.5 / 30.0
        told.append(finder.locate(picture(at_m, 0.1)[1], None, camera.search_radius_m))
    assert [seen.reason for seen in told[:2]] == [
        "1 of 3 parts of the frame searched",
        "2 of 3 parts of the frame searched",
    ]
    assert told[2].pose is not None, told[2].reason
    dx, dy, turn = errors(told[2].pose, Pose(at_m, 0.1, 0.3))
    assert math.hypot(dx, dy) < 2e-4
    assert abs(turn) < 2e-3
    # A prediction that holds is followed at once, and forgets what was searched.
    again = finder.locate(picture(at_m, 0.1)[1], told[2].pose, camera.search_radius_m)
    assert again.pose is not None
    assert finder.locate(picture(at_m, 0.1)[1], None, 0.06).reason.startswith("1 of 3")


def test_gone_while_the_rest_was_searched():
    """Negative control: found in the first strip, then taken away: not seen, and said so."""
    camera, shown = picture(-0.6, 0.1)
    _, empty = picture(0.1, 5.0)
    finder = spread(localiser(camera))
    for image in (shown, empty):
        assert finder.locate(image, None, 0.06).pose is None
    last = finder.locate(empty, None, 0.06)
    assert last.pose is None
    assert last.reason == "gone from where it was found"


def test_two_alike_are_one_too_many_unless_ours_is_named():
    """Ours at (-0.5, 0.1), its equal 1.1 m beside it: none; with `which_m`, the nearer of the two."""
    camera, image = picture(-0.5, 0.1, rival=True)
    places = {(-0.6, 0.0): (-0.5, 0.1), (0.7, 0.0): OTHER_M}
    alone = localiser(camera)
    seen = alone.locate(image, None, 0.06)
    assert seen.pose is None
    assert seen.reason == "two places look like the robot"
    parted = spread(alone)
    told = [parted.locate(image, None, 0.06) for _ in range(3)]
    assert told[-1].reason == "two places look like the robot"
    for which_m, at_m in places.items():
        seen = localiser(with_which(camera, which_m)).locate(image, None, 0.06)
        assert seen.pose is not None
        assert math.dist((seen.pose.x_m, seen.pose.y_m), at_m) < 2e-3
        parted = spread(localiser(with_which(camera, which_m)))
        told = [parted.locate(image, None, 0.06) for _ in range(3)]
        assert math.dist((told[-1].pose.x_m, told[-1].pose.y_m), at_m) < 2e-3


def test_ours_is_the_one_near_the_prediction():
    """Expected 0.2 m off ours, out of the window: found again there, not at the one `which_m` names."""
    camera, image = picture(-0.5, 0.1, rival=True)
    finder = localiser(with_which(camera, (0.7, 0.0)))
    seen = finder.locate(image, Pose(-0.3, 0.1, 0.3), 0.06)
    assert math.dist((seen.pose.x_m, seen.pose.y_m), (-0.5, 0.1)) < 2e-3


def made(kind):
    """Return a localiser of three marks or of a tag, its camera, and pictures of places in 720p."""
    blue = MarkConfig(colour=bench.BLUE, x_m=0.0, y_m=-0.07)
    marks = CameraConfig().marks
    if kind == "three marks":
        camera = bench.camera_of("ceiling", HD, STILL, marks.model_copy(update={"more": (blue,)}))
        finder = ManyMarks(camera)
    else:
        tag = TagConfig()
        camera = bench.camera_of("ceiling", HD, STILL, tag=tag)
        finder = TagLocaliser(camera_model(camera), tag, camera.marks.height_m)
    return finder, camera, lambda x_m: rendered(camera).make(0, [(x_m, 0.1, 0.3)] * 2)


@pytest.mark.parametrize("kind", ["three marks", "tag"])
def test_other_localisers_search_a_large_frame_in_parts_too(kind):
    """Found when all parts were searched and not before; each part is small; then followed at once."""
    finder, camera, shown = made(kind)
    parted = spread(finder)
    assert isinstance(parted, SpreadSearch)
    strips = strips_of(finder)
    assert len(strips) > 3
    assert max((right - left) * HD[1] for left, _, right, _ in strips) < 0.3 * HD[0] * HD[1]
    told = [parted.locate(shown(0.45), None, camera.search_radius_m) for _ in strips]
    assert all(seen.pose is None and "parts of the frame" in seen.reason for seen in told[:-1])
    assert told[-1].pose is not None, told[-1].reason
    assert math.hypot(*errors(told[-1].pose, Pose(0.45, 0.1, 0.3))[:2]) < 1e-3
    again = parted.locate(shown(0.46), told[-1].pose, camera.search_radius_m)
    assert again.pose is not None
    # Negative control: with the robot away no part finds anything.
    assert all(parted.locate(shown(9.0), None, 0.06).pose is None for _ in strips)
