"""Pose over the floor from listed points, boards and tags; what cannot be right is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hil.core.errors import BadInput
from tests.calibration.render import TagFloor, at_floor, board_image
from vision.calibration.boards import parse_board
from vision.calibration.floor import FloorOptions, calibrate_floor, error_budget
from vision.calibration.points import (
    PointPairs,
    centre_of_tag,
    pairs_of_board,
    pairs_of_fiducials,
    read_pairs,
)
from vision.camera import CameraModel, look_at
from vision.correction import CorrectedCamera, corrected

DATA = Path(__file__).parent.parent / "data"
SIZE = (640, 480)
EYE = (0.2, -0.8, 2.1)
RNG_SEED = 5


def floor_pairs(camera, noise_px=0.0, z_m=0.0):
    x, y = np.meshgrid(np.linspace(-0.7, 0.7, 6), np.linspace(-0.5, 0.5, 5))
    world = np.column_stack((x.ravel(), y.ravel(), np.full(x.size, z_m)))
    noise = np.random.default_rng(RNG_SEED).normal(0.0, noise_px, (len(world), 2))
    return PointPairs(tuple(map(str, range(len(world)))), world, camera.project(world) + noise)


def test_exact_points_give_the_exact_pose():
    """Without noise eye and turn come back to a micrometre and a microradian."""
    camera = at_floor(EYE)
    pairs = floor_pairs(camera)
    result = calibrate_floor(pairs, SIZE, FloorOptions(camera))
    assert np.allclose(result.camera.t_world_cam_m, EYE, atol=1e-6)
    assert np.allclose(result.camera.R_world_cam, camera.R_world_cam, atol=1e-6)
    assert result.held_out_rms_mm < 1e-3


def test_pixel_noise_shows_up_as_held_out_millimetres():
    """0.2 px of noise at some 3.5 mm a pixel: held-out residual near 0.2 * sqrt 2 * 3.5 = 1 mm."""
    camera = at_floor(EYE)
    result = calibrate_floor(floor_pairs(camera, 0.2), SIZE, FloorOptions(camera))
    assert 0.7 < result.held_out_rms_mm < 1.5
    assert result.rms_mm < result.held_out_rms_mm
    assert np.linalg.norm(result.camera.t_world_cam_m - EYE) < 0.01


def test_points_above_the_floor_count_at_their_height():
    """Half of the points on boxes of 0.1 m: the pose is still exact; taken for floor it is not."""
    camera = at_floor(EYE)
    pairs = PointPairs.joined([floor_pairs(camera), floor_pairs(camera, z_m=0.1)])
    good = calibrate_floor(pairs, SIZE, FloorOptions(camera))
    assert np.allclose(good.camera.t_world_cam_m, EYE, atol=1e-5)
    flat = replace(pairs, world_m=pairs.world_m * (1, 1, 0))
    wrong = calibrate_floor(flat, SIZE, FloorOptions(camera))
    assert wrong.held_out_rms_mm > 10.0


def test_a_mistyped_point_is_named_and_left_out():
    """One pair 40 px off is dropped by its name with its error; the pose stays exact."""
    camera = at_floor(EYE)
    pairs = floor_pairs(camera)
    pairs.px[7] += (40.0, 0.0)
    result = calibrate_floor(pairs, SIZE, FloorOptions(camera))
    assert [name for name, _ in result.dropped] == ["7"]
    assert result.dropped[0][1] == pytest.approx(40 * 3.5, rel=0.3)
    assert np.allclose(result.camera.t_world_cam_m, EYE, atol=1e-4)


def test_the_arena_is_reproduced_on_held_out_points():
    """69 points of a real overhead camera, lens unknown: at most 0.6 mm RMS on the held-out half.

    A homography alone leaves 4.1 mm, which is the negative control: no lens, no accuracy.
    """
    pairs = read_pairs(DATA / "arena_points.csv")
    assert len(pairs.names) == 69
    result = calibrate_floor(pairs, SIZE, FloorOptions())
    assert result.held_out_rms_mm <= 0.6
    assert result.held_out_mm.max() < 2.0
    assert not result.dropped
    straight = CameraModel(640, 480, 500.0, 500.0, 319.5, 239.5, (0.0,) * 5, np.eye(3), np.zeros(3))
    assert calibrate_floor(pairs, SIZE, FloorOptions(straight)).held_out_rms_mm > 3.0


def test_a_mirrored_frame_is_refused():
    """World axes that run clockwise in the image would put z into the floor."""
    pairs = read_pairs(DATA / "arena_points.csv")
    mirrored = replace(pairs, world_m=pairs.world_m * (1, -1, 1))
    with pytest.raises(BadInput, match="clockwise"):
        calibrate_floor(mirrored, SIZE, FloorOptions())


def test_a_measured_height_settles_the_focal_length():
    """Seen straight down, height and focal length grow together; a tape measure tells which."""
    camera = at_floor((0.0, 0.0, 2.5))
    pairs = floor_pairs(camera, 0.05)
    result = calibrate_floor(pairs, SIZE, FloorOptions(None, camera_height_m=2.5))
    assert result.camera.t_world_cam_m[2] == pytest.approx(2.5, abs=0.01)
    assert result.camera.fx_px == pytest.approx(camera.fx_px, rel=0.01)


@pytest.mark.parametrize("text", ["charuco:6x4:90:66", "chess:8x5:60"])
def test_a_board_on_the_floor_gives_the_pose(text):
    """A board at a known place, photographed: the eye within 15 mm, floor points within 2 mm."""
    camera, board = at_floor(EYE, (0, 0.03, 0)), parse_board(text)
    place = (-0.25, -0.15, 0.1)
    c, s = np.cos(place[2]), np.sin(place[2])
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    view = board.find(board_image(camera, board, R, np.array([place[0], place[1], 0.0])), text)
    pairs = pairs_of_board(board, view, place)
    result = calibrate_floor(pairs, SIZE, FloorOptions(camera))
    assert np.linalg.norm(result.camera.t_world_cam_m - EYE) < 0.015
    px = camera.project([(0.3, 0.2, 0.0), (-0.3, -0.2, 0.0)])
    error = result.camera.floor_points(px) - [(0.3, 0.2), (-0.3, -0.2)]
    assert np.abs(error).max() < 2e-3


def test_tags_at_known_points_give_the_pose(tmp_path):
    """Six tags over the floor: the eye within 10 mm; a tag listed but not there is no harm."""
    camera, corner = at_floor(EYE, (0, 0.03, 0)), np.array([-1.0, -0.75, 0.0])
    at = {1: (0.2, 0.2), 3: (0.9, 0.2), 5: (1.6, 0.2), 7: (0.2, 1.2), 9: (0.9, 1.1), 11: (1.6, 1.2)}
    image = board_image(camera, TagFloor(at, 0.096), np.eye(3), corner)
    table = tmp_path / "tags.csv"
    rows = [f"{k},{x - 1.0 + 0.048},{y - 0.75 + 0.048}" for k, (x, y) in at.items()]
    table.write_text("\n".join(["id,x_m,y_m", *rows, "40,0,0"]))
    pairs = pairs_of_fiducials(image, "floor.png", table, "DICT_4X4_50")
    assert pairs.names == tuple(f"tag {k}" for k in at)
    result = calibrate_floor(pairs, SIZE, FloorOptions(camera))
    assert np.linalg.norm(result.camera.t_world_cam_m - EYE) < 0.010
    with pytest.raises(BadInput, match="not seen"):
        pairs_of_fiducials(np.zeros((480, 640, 3), np.uint8), "dark.png", table, "DICT_4X4_50")


def test_the_centre_of_a_tag_is_where_its_diagonals_meet():
    """In perspective that is not the mean of the corners: by hand for a trapezium."""
    corners = np.array([[-1.0, 0.0], [1.0, 0.0], [3.0, 4.0], [-3.0, 4.0]])
    assert centre_of_tag(corners) == pytest.approx((0.0, 1.0))


def test_a_chessboard_that_has_no_right_way_up_is_refused():
    """8 x 6 squares look the same turned by 180 degrees."""
    board, camera = parse_board("chess:8x6:60"), at_floor(EYE)
    view = board.find(board_image(camera, board, np.eye(3), np.array([-0.24, -0.18, 0.0])), "")
    with pytest.raises(BadInput, match="upside"):
        pairs_of_board(board, view, (0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda p: p.take(np.arange(4)), "at least 5"),
        (lambda p: replace(p, world_m=p.world_m * (1, 0, 0)), "one line"),
        (lambda p: replace(p, px=p.px * 2.0), "another resolution"),
        (lambda p: replace(p, px=p.px[np.random.default_rng(0).permutation(len(p.px))]), "floor: "),
    ],
)
def test_points_that_cannot_be_are_refused(change, says):
    """Too few, in a line, outside the image, or shuffled against each other: one line each."""
    camera = at_floor(EYE)
    with pytest.raises(BadInput, match=says):
        calibrate_floor(change(floor_pairs(camera)), SIZE, FloorOptions(camera))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x_m,y_m,u_px\n0,0,1\n", "column v_px is missing"),
        ("x_m,y_m,u_px,v_px\n0,0,1,two\n", "line 2, v_px = 'two'"),
        ("x_m,y_m,u_px,v_px\n0,0,1\n", "line 2, v_px = ''"),
        ("x_m,y_m,u_px,v_px\n", "no rows"),
        ("", "missing"),
    ],
)
def test_a_points_file_at_fault_names_the_line(tmp_path, text, says):
    """The line, the column and the text found are said."""
    file = tmp_path / "points.csv"
    file.write_text(text)
    with pytest.raises(BadInput, match=says):
        read_pairs(file)


def test_millimetres_and_semicolons_are_read(tmp_path):
    """x_mm stands for x_m; columns may come in any order."""
    file = tmp_path / "points.csv"
    file.write_text("# surveyed\nu_px;v_px;y_mm;x_mm\n10;20;250;-500\n")
    pairs = read_pairs(file)
    assert pairs.world_m.tolist() == [[-0.5, 0.25, 0.0]]
    assert pairs.px.tolist() == [[10.0, 20.0]]


def test_the_error_budget_by_hand():
    """From 3 m with 620 px, a plate 0.1 m up is 2.9 / 620 = 4.68 mm a pixel at the foot."""
    camera = CameraModel(
        640, 480, 620, 620, 319.5, 239.5, (0.0,) * 5, look_at((0, 0, 3), (0, 0, 0)), (0, 0, 3)
    )
    budget = error_budget(camera, 0.1)
    assert budget["pixel_centre_mm"] == pytest.approx(0.1 * 2.9e3 / 620, rel=1e-6)
    assert budget["height_centre_mm"] == pytest.approx(0.0, abs=1e-9)
    # The corner ray leans by hypot(319.5, 239.5) / 620.
    lean = np.hypot(319.5, 239.5) / 620
    assert budget["height_corner_mm"] == pytest.approx(3.0 * lean, rel=1e-6)


def test_a_correction_bends_pixels_and_keeps_heights():
    """A camera 1 px off in a smooth way is put right, on the floor and 0.1 m above it."""
    camera = at_floor(EYE)
    pairs = PointPairs.joined([floor_pairs(camera), floor_pairs(at_floor(EYE), z_m=0.0)])
    x = (pairs.px - 320.0) / 320.0
    bent = pairs.px + np.column_stack((x[:, 0] * x[:, 1], x[:, 0] ** 2))
    fixed = corrected(camera, pairs.world_m, bent, 3)
    assert isinstance(fixed, CorrectedCamera)
    assert np.abs(fixed.project(pairs.world_m) - bent).max() < 0.02
    point = (0.31, -0.17, 0.1)
    assert fixed.floor_point(*fixed.project_point(*point), 0.1) == pytest.approx(
        point[:2], abs=1e-9
    )
    big = fixed.scaled(1280, 960)
    assert (big.project([point])[0] + 0.5) / 2 - 0.5 == pytest.approx(fixed.project([point])[0])
    with pytest.raises(BadInput, match="needs 84 points"):
        corrected(camera, pairs.world_m, bent, 6)
