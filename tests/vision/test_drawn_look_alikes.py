"""Look-alikes drawn flat: what is drawn, which are the robot's equals, and what is taken for the robot."""

import math

import numpy as np
import pytest

from hil.config.camera import CameraConfig, CameraPoseConfig, ClutterConfig, MarksConfig
from hil.core.types import Pose
from hil.tools import drawn_look_alikes as drawn
from hil.tools.flat_scenes import FlatScenes, apparent, robot
from hil.tools.look_alikes import GREEN, PLATE
from hil.tools.vision_conditions import CONDITIONS, develop
from vision import rivals
from vision.camera_setup import camera_model
from vision.localisers.marks import MarkLocaliser
from vision.rivals import THIRD_MARK

OBLIQUE = CameraConfig(pose=CameraPoseConfig(eye_m=(0.0, -1.6, 1.6), target_m=(0.0, 0.0, 0.0)))
HERE = Pose(0.1, 0.0, 0.4)


@pytest.fixture(scope="module")
def flat():
    """Return what draws for an oblique camera, and its localiser."""
    model = camera_model(OBLIQUE)
    return FlatScenes(model, OBLIQUE.marks.height_m), MarkLocaliser(model, OBLIQUE.marks)


def frame(flat, light, *things, index=0):
    """Return a frame of the robot and things, and what is seen in it."""
    sharp = flat[0].draw([*robot(HERE, MarksConfig()), *things], drawn.GREY)
    return flat[1].locate(
        develop(sharp, CONDITIONS[light], np.random.default_rng(index)), None, 0.0
    )


def test_a_robot_drawn_flat_is_where_it_was_drawn(flat):
    """Plate, board and marks in the marks' plane: found within 0.2 mm and 0.1 deg when nothing disturbs."""
    seen = frame(flat, "clean")
    assert seen.pose is not None, seen.reason
    assert math.hypot(seen.pose.x_m - HERE.x_m, seen.pose.y_m - HERE.y_m) < 0.2e-3
    assert abs(seen.pose.theta_rad - HERE.theta_rad) < math.radians(0.1)


def test_a_thing_on_the_floor_seems_smaller_in_the_plane_of_the_marks():
    """A camera 1.6 m up: what lies 0.1 m below the marks seems 1.5 / 1.6 as large and as far off."""
    model = camera_model(OBLIQUE)
    thing = ClutterConfig(x_m=0.4, y_m=0.0, size_m=(0.06, 0.06), height_m=0.0, colour=GREEN)
    seems = apparent(model, thing, 0.1)
    assert seems.size_m[0] == pytest.approx(0.06 * 1.5 / 1.6)
    assert (seems.x_m, seems.y_m + 1.6) == pytest.approx((0.4 * 1.5 / 1.6, 1.6 * 1.5 / 1.6))


def test_a_third_disc_counts_where_it_is_known_to_be_the_robots_distance_away(flat, monkeypatch):
    """A pale green disc at the robot's distance: one too many in a moderate frame, noise in an extreme one.

    Negative control: believed whatever it claims, it costs half of the extreme frames.
    """
    place = drawn.at(HERE, drawn.HALF_M, 0.158)
    pale = tuple(0.3 * value + 0.035 for value in GREEN)
    lie = {"x_m": place[0], "y_m": place[1], "height_m": drawn.TOP_M}
    things = (
        ClutterConfig(shape="box", size_m=(0.12, 0.12), colour=PLATE, **lie),
        ClutterConfig(size_m=(0.06, 0.06), colour=pale, **lie),
    )
    assert frame(flat, "moderate", *things).reason == THIRD_MARK
    hard = [frame(flat, "extreme", *things, index=k) for k in range(6)]
    assert all(seen.pose is not None for seen in hard)
    monkeypatch.setattr(rivals, "CLAIM_MAX", math.inf)
    believed = [frame(flat, "extreme", *things, index=k).reason for k in range(6)]
    assert THIRD_MARK in believed


def test_scenes_come_by_their_number_and_equals_are_left_out():
    """A scene is always the same; all kinds come in turn; a pair like the robot is an equal."""
    assert [drawn.scene(k).kind for k in range(len(drawn.KINDS))] == list(drawn.KINDS)
    assert drawn.scene(7) == drawn.scene(7) != drawn.scene(7 + len(drawn.KINDS))
    near = next(s for s in map(drawn.scene, range(9, 900, 15)) if not drawn.has_equal(s))
    assert near.kind == "distance"
    exact = tuple(robot(HERE, MarksConfig()))
    assert drawn.has_equal(drawn.Scene("distance", exact, (), *_seen(near)))
    assert not drawn.has_equal(drawn.Scene("ring", exact, (), *_seen(near)))


def _seen(scene):
    return scene.view, scene.size_px, scene.light, scene.floor


def test_hardly_anything_drawn_is_taken_for_the_robot_and_the_robot_is():
    """A round of all kinds: none of box ends, tails, rings and discs of another distance is the robot."""
    pieces = [drawn.drawn_scenes(0, 7), drawn.drawn_scenes(8, 14)]
    whole = drawn.together(pieces)
    assert whole.scenes + whole.equals == 15
    assert [kind for kind, _, _ in whole.kinds] == list(drawn.KINDS)
    taken = {kind: accepted for kind, _, accepted in whole.kinds}
    assert all(taken[kind] == 0 for kind in ("box end", "stripe", "tail", "ring", "distance"))
    # Negative control: were the robot itself a scene, it would be one too many.
    _, flat, finder = drawn._seen_from("boom", (640, 480))
    image = develop(
        flat.draw(list(robot(HERE, MarksConfig())), drawn.GREY), CONDITIONS["moderate"],
        np.random.default_rng(1),
    )  # fmt: skip
    assert finder.locate(image, None, 0.0).pose is not None
