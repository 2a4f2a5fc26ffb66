"""Lens, floor and board that are not to be believed, through the commands: one line, nothing written."""

import re
import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from hil.cli.calibrate import command as calibrate
from hil.core.errors import BadInput
from hil.core.wording import past
from tests.calibration.render import LENS, at_floor, board_image, hand_held
from vision.calibration.boards import BoardView, parse_board
from vision.calibration.intrinsics import calibrate_lens
from vision.calibration.marks_sheet import marks_sheet
from vision.calibration.plausible import check_lens
from vision.cv_compat import read_image, write_image
from vision.sources import ImageFolder

PHOTOS = sorted((Path(__file__).parents[1] / "data" / "chessboard").glob("left*.jpg"))
SIZE = (640, 480)


def refused(*arguments):
    """Return the line with which a command refuses."""
    result = CliRunner().invoke(calibrate, list(map(str, arguments)))
    assert isinstance(result.exception, BadInput), (result.output, result.exception)
    assert "\n" not in str(result.exception)
    return str(result.exception)


@pytest.fixture(scope="module")
def photo_views():
    board = parse_board("chess:10x7:25", "classic")
    return [board.find(read_image(path), path.name) for path in PHOTOS]


def test_copies_of_one_picture_are_one_view(tmp_path):
    """Ten copies, the pixels of some changed by noise: refused, whatever their residual."""
    for k in range(10):
        image = read_image(PHOTOS[k // 9]).astype(float)
        noisy = image + np.random.default_rng(k).normal(0.0, 2.0 * (k % 2), image.shape)
        write_image(tmp_path / f"{k}.png", np.clip(noisy, 0, 255).astype(np.uint8))
    file = tmp_path / "lab.toml"
    said = refused("camera", tmp_path, "--board", "chess:10x7:25", "--detector", "classic",
                   "--camera-file", file)  # fmt: skip
    assert "2 usable views of the board that differ (8 more" in said
    assert not file.exists()


def test_copies_among_views_change_nothing(photo_views):
    """Every view three times over: the same lens and the same sigma, and the copies named."""
    once = calibrate_lens(photo_views, SIZE)
    copies = [replace(v, name=f"copy {k} of {v.name}") for k in (1, 2) for v in photo_views]
    thrice = calibrate_lens([*photo_views, *copies], SIZE)
    assert thrice.lens == pytest.approx(once.lens, rel=1e-4)
    assert thrice.sigma == pytest.approx(once.sigma, rel=1e-3)
    assert len(thrice.alike) == 2 * len(photo_views)
    assert ("copy 2 of left05.jpg", "left05.jpg") in thrice.alike
    assert once.alike == ()


def test_an_uncertain_focal_length_is_refused():
    """A sigma of 2.004 % of f is past 2 % and reads so; 1.9 % is believed."""
    lens = np.array([500.0, 500.0, 320.0, 240.0, -0.2, 0.0, 0.0, 0.0, 0.0])
    sigma = np.array([10.02, 9.0, 1.0, 1.0, 0.1, 0.1, 0.1, 0.1, 0.1])
    with pytest.raises(
        BadInput, match=r"uncertain by 2\.004% \(1 sigma\), limit 2%; tilt the board"
    ):
        check_lens(lens, sigma, SIZE, [5.0] * 8)
    check_lens(lens, sigma * 0.95, SIZE, [5.0] * 8)


def test_views_that_face_the_camera_are_refused():
    """Boards parallel to the image, near and far: the focal length is left open."""
    board = parse_board("charuco:8x6:30:22").find(np.zeros((8, 8, 3), np.uint8), "")
    assert board is None
    grid = np.array([(x, y, 0.0) for y in range(6) for x in range(8)]) * 0.03
    rng = np.random.default_rng(2)
    views = []
    for k in range(9):
        at = np.array([-0.1 + 0.08 * (k % 3 - 1), -0.08 + 0.05 * (k // 3 - 1), 0.5 + 0.03 * k])
        px = LENS.project(grid + at)
        views.append(BoardView(str(k), grid, px + rng.normal(0.0, 0.15, px.shape)))
    with pytest.raises(BadInput, match=r"^lens: .*tilt the board by 20 to 40 deg"):
        calibrate_lens(views, SIZE)


def test_a_lens_outside_the_camera_files_bounds_is_said_by_the_views():
    """Not "lens.k2 = -2.93: input should be greater", but that the views leave it open."""
    lens = np.array([500.0, 500.0, 320.0, 240.0, -0.2, -2.0001, 0.0, 0.0, 0.0])
    with pytest.raises(BadInput, match=r"the views give k2 = -2\.0001, the limits are -2 to 2"):
        check_lens(lens, np.ones(9), SIZE, [30.0] * 8)


def test_one_view_that_reaches_further_is_named_and_the_lens_kept(photo_views):
    """Its outer corners are off: 4 px there, nothing elsewhere. A view off all over is refused by name."""
    result = calibrate_lens(photo_views, SIZE)
    model = result.model()
    views = []
    for k, (R, t) in enumerate(hand_held(parse_board("charuco:8x6:30:22"), 12)):
        grid = np.array([(x, y, 0.0) for y in range(1, 6) for x in range(1, 8)]) * 0.03
        px = model.project(grid @ R.T + [0.3 * t[0], 0.3 * t[1], t[2]])
        px += np.random.default_rng(k).normal(0.0, 0.1, px.shape)
        views.append(BoardView(f"view {k}", grid, px))
    R, t = next(iter(hand_held(parse_board("charuco:8x6:30:22"), 1)))
    far = model.project(grid @ R.T + [-0.35, -0.25, 0.5])
    wide = [*views, BoardView("far", grid, far)]
    assert "far" not in " ".join(calibrate_lens(views, SIZE).advice)
    out = np.linalg.norm(far - result.lens[2:4], axis=1)
    bent = far + np.where(out > np.sort(out)[-6], 9.0, 0.0)[:, None]
    accepted = calibrate_lens([*wide[:-1], BoardView("far", grid, bent)], SIZE)
    assert any(v.name == "far" and (v.dropped or np.isfinite(v.alone_px)) for v in accepted.views)
    assert accepted.held_out_px <= 1.0


@pytest.mark.parametrize("size", ["5x4", "7x6", "8x5"])
def test_another_board_than_described_is_said_so(tmp_path, size):
    """Parts and every second corner of a 10 x 7 board: told by its size, for lens and floor."""
    folder = tmp_path / "views"
    folder.mkdir()
    for photo in PHOTOS[2:4]:
        shutil.copy(photo, folder)
    file = tmp_path / "lab.toml"
    said = refused("camera", folder, "--board", f"chess:{size}:25", "--camera-file", file)
    assert "another board than described" in said
    assert "count its squares, not its corners" in said
    file.write_text("width_px = 640\nheight_px = 480\n")
    before = file.read_text()
    said = refused("floor", PHOTOS[3], "--board", f"chess:{size}:25", "--camera-file", file)
    assert re.search("another board than chess|upside down", said)
    assert file.read_text() == before


def test_the_right_board_is_no_other_board():
    """Sharp or blurred, seen by both detectors: no fault."""
    for detector in ("sector", "classic"):
        board = parse_board("chess:10x7:25", detector)
        for photo in PHOTOS[::6]:
            image = read_image(photo)
            for shown in (image, cv2.GaussianBlur(image, (0, 0), 3.0)):
                view = board.find(shown, photo.name)
                assert view is None or view.fault == ""


def test_a_charuco_board_with_a_row_more_than_said():
    """Tags of higher numbers in step below the last row are told; tags elsewhere are not."""
    true, camera = parse_board("charuco:6x5:90:66"), at_floor((0.1, -0.5, 1.4))
    image = board_image(camera, true, np.eye(3), np.array([-0.27, -0.22, 0.0]))
    assert true.find(image).fault == ""
    assert "go on below with 12, 13, 14" in parse_board("charuco:6x4:90:66").find(image).fault


def test_a_floors_residual_is_judged_by_its_extent(tmp_path):
    """6 mm RMS over 0.2 m is refused, over 1.5 m it is a tape measure's."""
    camera = at_floor((0.2, -0.8, 2.1))
    file = tmp_path / "lab.toml"
    file.write_text("width_px = 640\nheight_px = 480\n")
    rng = np.random.default_rng(4)
    for size_m, holds in ((0.2, False), (1.2, True)):
        x, y = (w.ravel() for w in np.meshgrid(*[np.linspace(-0.5, 0.5, 6) * size_m] * 2))
        px = camera.project(np.column_stack((x, y, np.zeros(36))))
        wrong = np.column_stack((x, y)) + rng.normal(0.0, 0.005, (36, 2))
        rows = [",".join(map(str, (*w, *p))) for w, p in zip(wrong, px, strict=True)]
        (tmp_path / "p.csv").write_text("\n".join(["x_m,y_m,u_px,v_px", *rows]))
        arguments = ["floor", "--points", tmp_path / "p.csv", "--camera-file", file]
        if holds:
            result = CliRunner().invoke(calibrate, list(map(str, arguments)))
            assert result.exception is None, result.exception
        else:
            assert re.search(
                r"mm RMS.*limit 5\.\d+ mm for points over 2\d\d mm", refused(*arguments)
            )


@pytest.mark.parametrize(
    "text", ["chess:4x3:24", "chess:3x3:24", "chess:3x8:24", "charuco:3x3:30:22"]
)
@pytest.mark.parametrize("detector", ["sector", "classic"])
def test_boards_too_small_to_be_found_are_refused_at_once(tmp_path, text, detector):
    """One line with the limit, for lens and floor, and no traceback out of OpenCV."""
    file = tmp_path / "lab.toml"
    camera = [
        "camera",
        PHOTOS[0].parent,
        "--board",
        text,
        "--detector",
        detector,
        "--camera-file",
        file,
    ]
    assert re.search("from 4 squares|at least 6", refused(*camera))
    assert not file.exists()
    file.write_text("width_px = 640\nheight_px = 480\n")
    floor = refused("floor", PHOTOS[0], "--board", text, "--camera-file", file)
    assert re.search("from 4 squares|at least 6", floor)


@pytest.mark.parametrize(
    ("value", "limit", "spec", "reads"),
    [(1.0004, 1.0, ".2f", "1.0004"), (1.15, 1.0, ".2f", "1.15"), (0.02004, 0.02, ".0%", "2.004%"),
     (0.9999, 1.0, ".1f", "0.9999"), (5.96, 6.0, ".1f", "5.96"), (1.0, 1.0, ".2f", "1.00"),
     (float("nan"), 1.0, ".2f", "nan"), (1e12, 1.0, ".2f", "1000000000000.00")],
)  # fmt: skip
def test_a_figure_is_never_rounded_onto_its_limit(value, limit, spec, reads):
    """As many digits as it takes, and no more."""
    assert past(value, limit, spec) == reads


def test_the_marks_are_drawn_at_true_size(tmp_path):
    """Discs of 60 mm, 160 mm apart on a plate of 260 x 160 mm, in a page of millimetres; PDF alike."""
    for name in ("marks.svg", "marks.pdf"):
        result = CliRunner().invoke(calibrate, ["marks", "--out", str(tmp_path / name)])
        assert result.exception is None, result.exception
        assert "diameter 60 mm, 160 mm apart, face up 100 mm over the floor" in result.output
    text = (tmp_path / "marks.svg").read_text()
    assert 'width="297mm" height="210mm" viewBox="0 0 297 210"' in text
    discs = re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)" r="([\d.]+)" fill="#(\w+)"', text)
    (xf, yf, rf, front), (xr, yr, rr, rear) = discs
    assert (float(xf) - float(xr), yf, rf, rr) == (pytest.approx(160.0), yr, "30.0000", "30.0000")
    assert int(front[:2], 16) > 2 * int(front[2:4], 16)  # red
    assert int(rear[2:4], 16) > 1.5 * int(rear[:2], 16)  # green
    assert re.search(r'width="260\.0000" height="160\.0000"', text)
    assert b"260.0000 160.0000 re" in (tmp_path / "marks.pdf").read_bytes()


def test_marks_follow_the_camera_file_and_must_lie_on_the_plate(tmp_path):
    """Other sizes are drawn as said; a mark over the edge, or a plate over the paper, is refused."""
    file = tmp_path / "lab.toml"
    file.write_text("[marks]\ndiameter_m = 0.04\nheight_m = 0.12\n")
    out = tmp_path / "marks.svg"
    result = CliRunner().invoke(calibrate, ["marks", "--camera-file", str(file), "--out", str(out)])
    assert "diameter 40 mm, 160 mm apart, face up 120 mm" in result.output
    file.write_text("[robot_look]\nplate_length_m = 0.2\n")
    out.unlink()
    said = refused("marks", "--camera-file", file, "--out", out)
    assert "the front mark of 60 mm at (80, 0) mm reaches over the plate of 200 x 160 mm" in said
    file.write_text("[robot_look]\nplate_length_m = 0.4\n")
    assert "a4 is 297 x 210 mm" in refused("marks", "--camera-file", file, "--out", out)
    assert not out.exists()
    assert marks_sheet(type(read_config(file))(), "fit").width_mm == pytest.approx(274.0)


def read_config(file):
    from vision.calibration.files import read_camera  # noqa: PLC0415

    return read_camera(file)


def test_folders_are_read_as_stored(tmp_path):
    """One folder, one resolution: a picture above the limit is refused before the first is decoded."""
    write_image(tmp_path / "a.png", np.zeros((64, 4100, 3), np.uint8))
    with pytest.raises(BadInput, match="4100 x 64 px"):
        ImageFolder(tmp_path)
