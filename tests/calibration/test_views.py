"""Which views are taken from a video or a live camera, and the floor command's other ways in."""

import json
import math
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from hil.cli.calibrate import command as calibrate
from hil.core.errors import BadInput
from hil.core.rig import Frame
from tests.calibration.render import at_floor, board_image
from vision.calibration.boards import BoardView, inner_corners, parse_board
from vision.calibration.files import read_camera
from vision.calibration.points import read_pairs
from vision.calibration.views import Picker, views_of_camera, views_of_video
from vision.camera_setup import camera_model
from vision.correction import CorrectedCamera
from vision.cv_compat import write_image

SIZE = (640, 480)
ARENA = Path(__file__).parent.parent / "data" / "arena_points.csv"
BOARD_M = inner_corners(8, 6, 0.03)


def view(u_px, v_px, tilt=1.0):
    """Return a board of 35 corners, 20 px apart, at a place in the image."""
    px = BOARD_M[:, :2] / 0.03 * [20.0 * tilt, 20.0] + (u_px, v_px)
    return BoardView(f"{u_px}", BOARD_M, px)


class Drawn:
    """A board that is where the picture's first two pixels say, in units of 4 px."""

    def find(self, image, name=""):
        u, v = 4.0 * image[0, 0, 0], 4.0 * image[0, 1, 0]
        found = view(u, v)
        return None if u == 0.0 else BoardView(name, found.board_m, found.px)


def picture(u_px, v_px):
    image = np.zeros((480, 640, 3), np.uint8)
    image[0, 0, 0], image[0, 1, 0] = u_px // 4, v_px // 4
    return image


def test_only_still_views_in_new_places_are_taken():
    """A moving board is blurred, a board at the same place says nothing new."""
    picker = Picker(SIZE)
    assert picker.offer(view(100, 100)) is None  # nothing to compare with yet
    assert picker.offer(view(101, 100)) is not None  # still, and the first
    assert picker.offer(view(140, 100)) is None  # moving
    assert picker.offer(view(101, 100)) is None  # moving back
    assert picker.offer(view(101, 100)) is None  # still, but known
    assert picker.offer(None) is None
    picker.offer(view(300, 200))
    assert picker.offer(view(300.5, 200)) is not None


def test_a_live_camera_is_watched_until_enough_views_are_taken():
    """Each place is held for two looks; the hints name what is missing; known places do not count."""
    places = [(u, v) for v in (40, 200, 320) for u in (40, 240, 440)]
    shown = [(0, 0), *(place for place in places for _ in range(3))]
    queue = (Frame(k, 0.25 * k, picture(*place)) for k, place in enumerate(shown))
    camera = SimpleNamespace(width_px=640, height_px=480, read=lambda: next(queue))
    said = []
    found = views_of_camera(Drawn(), camera, 9, said.append)
    assert [tuple(v.px.min(axis=0) - 20.0) for v in found.views] == places
    assert "hold the board to the" in said[0]
    assert "tilt" in said[-1]


def test_views_are_picked_from_a_video(tmp_path):
    """Two places held still give two views; a film without a board is refused."""
    board, camera = parse_board("charuco:5x4:60:45"), at_floor((0.0, 0.0, 0.9))
    images = [board_image(camera, board, np.eye(3), np.array([x, -0.1, 0.0])) for x in (-0.3, 0.02)]
    for name, shown in (("film.avi", [0] * 13 + [1] * 13), ("empty.avi", [None] * 8)):
        code = cv2.VideoWriter.fourcc(*"MJPG")
        writer = cv2.VideoWriter(str(tmp_path / name), code, 30.0, SIZE)
        for k in shown:
            writer.write(np.zeros((480, 640, 3), np.uint8) if k is None else images[k])
        writer.release()
    found = views_of_video(board, tmp_path / "film.avi", [].append)
    assert len(found.views) == 2
    assert "at 0.2" in found.views[0].name
    with pytest.raises(BadInput, match="board not seen in any of 2 frames"):
        views_of_video(board, tmp_path / "empty.avi", [].append)


def floor(*arguments):
    result = CliRunner().invoke(calibrate, ["floor", *map(str, arguments), "--json"])
    if result.exception is not None:
        raise result.exception
    return json.loads(result.stdout)


def test_listed_points_fit_lens_pose_and_correction(tmp_path):
    """What is written reproduces the arena; without a measured height a warning says what is open."""
    file = tmp_path / "arena.toml"
    options = ["--points", ARENA, "--fit-lens", "640x480", "--camera-file", file]
    said = floor(*options, "--correct", "2", "--picture", tmp_path / "grid.png")
    assert said["points"] == 69
    assert any("--camera-height" in advice for advice in said["advice"])
    model = camera_model(read_camera(file))
    assert isinstance(model, CorrectedCamera)
    pairs = read_pairs(ARENA)
    off = model.floor_points(pairs.px) - pairs.world_m[:, :2]
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < 0.6e-3
    assert np.abs(model.project(pairs.world_m) - pairs.px).max() < 1.0
    assert floor(*options, "--camera-height", "1.2")["advice"] == []
    assert read_camera(file).pose.eye_m[2] == pytest.approx(1.2, abs=0.01)
    assert read_camera(file).lens.shift_degree == 0


def test_a_board_at_two_known_places(tmp_path):
    """Two photographs with a place each are joined into one fit."""
    camera, board = at_floor((0.1, -0.6, 1.8), (0, 0, 0)), parse_board("charuco:6x4:90:66")
    file = tmp_path / "lab.toml"
    file.write_text("width_px = 640\nheight_px = 480\n")
    (tmp_path / "photos").mkdir()
    for k, (x, y, degrees) in enumerate([(-0.6, -0.3, 0.0), (0.5, -0.2, 90.0)]):
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
        image = board_image(camera, board, R, np.array([x, y, 0.0]))
        write_image(tmp_path / "photos" / f"{k}.png", image)
    options = [tmp_path / "photos", "--board", "charuco:6x4:90:66", "--camera-file", file]
    said = floor(*options, "--at", "-0.6,-0.3,0", "--at", "0.5,-0.2,90")
    assert said["eye_m"] == pytest.approx((0.1, -0.6, 1.8), abs=0.01)
    assert said["held_out_rms_mm"] < 1.5
    with pytest.raises(BadInput, match=r"do not fit one plane|limit 20 mm"):
        floor(*options, "--at", "-0.6,-0.3,0", "--at", "0.5,-0.2,0")
    with pytest.raises(BadInput, match="3 --at for 2 images"):
        floor(*options, *["--at", "0,0,0"] * 3)
    with pytest.raises(BadInput, match=r"for example 0\.5,-0\.25,90"):
        floor(*options, "--at", "0,0")
