"""What goes on beyond a mark's rim, and what is in its middle: look-alikes refused, covered marks kept."""

import math

import numpy as np
import pytest

from hil.config.camera import BarConfig, ClutterConfig
from hil.core.types import Pose
from hil.tools.look_alikes import GREEN, PLATE, RED
from tests.vision.scenes import DEFAULT, at_rest, errors, localiser, rendered
from vision.localisers import marks
from vision.mark_limits import doubts

HERE = Pose(0.2, 0.1, 0.4)
TOP_M = 0.1


def scene(*things, **changes):
    """Return the default camera over things, with what else changes in its scene."""
    look = DEFAULT.scene.model_copy(update={"clutter": things, **changes})
    return DEFAULT.model_copy(update={"scene": look})


def along(x_m, y_m=0.0):
    """Return the place (x, y) of a point of a robot that stands here."""
    c, s = math.cos(HERE.theta_rad), math.sin(HERE.theta_rad)
    return HERE.x_m + c * x_m - s * y_m, HERE.y_m + s * x_m + c * y_m


def box(x_m, y_m, size_m, colour, top_m, turn_rad=0.0):
    """Return a box of the robot's frame."""
    x, y = along(x_m, y_m)
    return ClutterConfig(
        shape="box", x_m=x, y_m=y, size_m=size_m, height_m=top_m, colour=colour,
        theta_rad=HERE.theta_rad + turn_rad,
    )  # fmt: skip


def disc(x_m, colour, size_m=0.06, top_m=TOP_M):
    """Return a disc on the robot's middle line."""
    x, y = along(x_m)
    return ClutterConfig(x_m=x, y_m=y, size_m=(size_m, size_m), height_m=top_m, colour=colour)


def plate_and(*things):
    """Return a plate with things on it, and the frame of it without the robot."""
    camera = scene(box(0.0, 0.0, (0.3, 0.16), PLATE, TOP_M - 0.001), *things)
    return camera, rendered(camera).make(0, ())


def seen_without(rule, camera, frame, monkeypatch):
    """Return what is seen with one of the doubts, or all, taken away."""

    def fewer(discs):
        return {what: 0.0 if rule in what else off for what, off in doubts(discs).items()}

    with monkeypatch.context() as without:
        without.setattr(marks, "doubts", fewer)
        return localiser(camera).locate(frame, None, 0.06)


@pytest.mark.parametrize("turn_rad", [0.5 * math.pi, 1.1])
@pytest.mark.parametrize("front", [True, False])
def test_a_disc_that_goes_on_as_a_tape_of_its_colour_is_no_mark(turn_rad, front, monkeypatch):
    """A round end of a tape 54 mm wide where a mark would be: its rim is a mark's but for where it goes on.

    Negative control: without that doubt it is the robot, as it was before.
    """
    x_m, colour = (0.08, RED) if front else (-0.08, GREEN)
    tape = box(
        x_m + 0.1 * math.cos(turn_rad),
        0.1 * math.sin(turn_rad),
        (0.2, 0.054),
        colour,
        TOP_M,
        turn_rad,
    )
    camera, frame = plate_and(disc(0.08, RED), disc(-0.08, GREEN), tape)
    seen = localiser(camera).locate(frame, None, 0.06)
    assert seen.pose is None
    assert "colour goes on over" in seen.reason
    assert seen_without("goes on", camera, frame, monkeypatch).pose is not None


def test_how_far_round_a_colour_goes_on_is_what_geometry_says():
    """Over a tape of 0.9 diameters a rim shows no edge for asin(0.9 / 1.6) either side: 0.19 of it."""
    tape = box(0.08, 0.1, (0.2, 0.054), RED, TOP_M, 0.5 * math.pi)
    camera, frame = plate_and(disc(0.08, RED), disc(-0.08, GREEN), tape)
    front, rear = localiser(camera)._rims.fit(frame, (along(0.08), along(-0.08)))
    assert front.beyond == pytest.approx(2.0 * math.asin(0.9 / 1.6) / (2.0 * math.pi), abs=0.03)
    assert (rear.beyond, rear.hollow, front.hollow) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("width_m", [0.008, 0.014])
@pytest.mark.parametrize("off_m", [0.0, 0.012])
def test_a_cable_over_a_mark_is_no_such_doubt(width_m, off_m):
    """Cables across the front mark, off its middle or over it: nothing goes on beyond, and it is found."""
    cable = BarConfig(
        start_m=along(0.08 + off_m, -0.2),
        end_m=along(0.08 + off_m, 0.2),
        width_m=width_m,
        height_m=0.101,
    )
    camera = scene(bars=(cable,))
    frame = at_rest(HERE, camera)
    discs = localiser(camera)._rims.fit(frame, (along(0.08), along(-0.08)))
    assert discs is not None
    assert max(d.beyond for d in discs) == 0.0
    assert max(doubts(discs).values()) < 1.0
    seen = localiser(camera).locate(frame, None, 0.06)
    assert seen.pose is not None, seen.reason
    assert math.hypot(*errors(seen.pose, HERE)[:2]) < 1.5e-3


def test_the_robot_on_tape_of_its_marks_colours_is_found():
    """Tapes of both colours under both marks, wider than them: the plate about the marks ends them."""
    tapes = [
        box(x_m, 0.0, (1.0, 0.09), colour, 1e-4, turn)
        for x_m, colour in ((0.08, RED), (-0.08, GREEN))
        for turn in (0.5 * math.pi, 1.0)
    ]
    camera = scene(*tapes)
    for index in range(3):
        frame = at_rest(HERE, camera, index)
        for guess in (None, HERE):
            seen = localiser(camera).locate(frame, guess, 0.06)
            assert seen.pose is not None, seen.reason
            assert math.hypot(*errors(seen.pose, HERE)[:2]) < 0.5e-3


@pytest.mark.parametrize("hole", [0.5, 0.75])
def test_a_ring_is_no_mark(hole, monkeypatch):
    """Letters O of the marks' colours and width: their outer rims are marks'.

    Negative control: those whose paper is wide are the robot without that doubt.
    """
    rings = [
        thing
        for x_m, colour in ((0.08, RED), (-0.08, GREEN))
        for thing in (disc(x_m, colour), disc(x_m, PLATE, hole * 0.06, TOP_M + 5e-4))
    ]
    camera, frame = plate_and(*rings)
    assert localiser(camera).locate(frame, None, 0.06).pose is None
    if hole == 0.5:
        assert "middle" in localiser(camera).locate(frame, None, 0.06).reason
        assert seen_without("middle", camera, frame, monkeypatch).pose is not None


def test_a_lamp_that_blinds_the_middle_of_a_mark_is_no_hole():
    """White pixels of 255 in the middle of a mark show no colour, and say nothing of it."""
    frame = at_rest(HERE).copy()
    finder = localiser()
    u, v = finder._model.project(np.array([[*along(0.08), TOP_M]]))[0]
    rows, columns = np.mgrid[0 : frame.shape[0], 0 : frame.shape[1]]
    spot = np.hypot(columns - u, rows - v) < 4.0
    blind, dark = frame.copy(), frame.copy()
    blind[spot], dark[spot] = 255, 20
    holes = [
        finder._rims.fit(image, (along(0.08), along(-0.08)))[0].hollow for image in (blind, dark)
    ]
    assert holes[0] < 0.2
    assert holes[1] > 0.8
