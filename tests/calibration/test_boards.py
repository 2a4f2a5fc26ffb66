"""Boards: their description, their print at true scale, and where their corners are."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import cv2
import numpy as np
import pytest

from hil.core.errors import BadInput
from tests.calibration.render import at_floor, board_image
from vision.calibration.boards import Charuco, Chessboard, not_seen_hint, parse_board
from vision.calibration.printing import lay_out, to_pdf, to_svg, write_sheet
from vision.calibration.views import views_of_folder

SVG = "{http://www.w3.org/2000/svg}"
PX_PER_MM = 4


def raster(sheet):
    """Return the sheet as grey levels, 4 px a millimetre."""
    size = (round(sheet.height_mm * PX_PER_MM), round(sheet.width_mm * PX_PER_MM), 3)
    image = np.full(size, 255, dtype=np.uint8)
    for x, y, w, h in sheet.rects:
        rows = slice(
            round((sheet.height_mm - y - h) * PX_PER_MM), round((sheet.height_mm - y) * PX_PER_MM)
        )
        image[rows, round(x * PX_PER_MM) : round((x + w) * PX_PER_MM)] = 0
    return image


@pytest.mark.parametrize("text", ["charuco:8x6:30:22", "charuco-old:8x6:30:22", "chess:10x7:25"])
def test_what_is_printed_is_what_is_found(text):
    """Corners found on the sheet lie at their board coordinates in mm, measured on the paper."""
    board = parse_board(text)
    sheet = lay_out(board, "a4", text)
    view = board.find(raster(sheet))
    assert len(view.px) == (board.columns - 1) * (board.rows - 1)
    left = 0.5 * (297.0 - board.columns * board.square_m * 1e3)
    bottom = 14.0 + 0.5 * (210.0 - 14.0 - board.rows * board.square_m * 1e3)
    paper_mm = (left, bottom) + view.board_m[:, :2] * 1e3
    expected = np.column_stack((paper_mm[:, 0], 210.0 - paper_mm[:, 1])) * PX_PER_MM - 0.5
    assert np.abs(view.px - expected).max() < 0.3


def test_svg_and_pdf_are_at_true_scale():
    """The SVG's unit is a millimetre of an A4 page; the PDF's page is A4 in points of 1/72 inch."""
    sheet = lay_out(parse_board("charuco:8x6:30:22"), "a4", "board")
    root = ET.fromstring(to_svg(sheet))
    assert (root.get("width"), root.get("height")) == ("297mm", "210mm")
    assert root.get("viewBox") == "0 0 297 210"
    widths = [float(rect.get("width")) for rect in root.find(f"{SVG}g")]
    assert widths.count(30.0) == 24  # black squares of an 8 x 6 board
    assert widths.count(100.0) == 1  # the ruler
    pdf = to_pdf(sheet)
    box = re.search(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", pdf)
    assert float(box[1]) == pytest.approx(297.0 / 25.4 * 72.0, abs=1e-3)
    assert float(box[2]) == pytest.approx(210.0 / 25.4 * 72.0, abs=1e-3)
    assert b"/PrintScaling /None" in pdf
    scale = re.search(rb"([\d.]+) 0 0 ([\d.]+) 0 0 cm", pdf)
    assert float(scale[1]) == float(scale[2]) == pytest.approx(72.0 / 25.4, abs=1e-7)
    table = int(re.search(rb"startxref\n(\d+)", pdf)[1])
    assert pdf[table:].startswith(b"xref\n0 6")


@pytest.mark.parametrize("turn_deg", [0, 90, 180, 270])
def test_a_chessboard_keeps_its_origin_however_it_lies(turn_deg):
    """Turned by quarter turns on the floor, each corner is still found as itself."""
    board, c, s = (
        Chessboard(10, 7, 0.05),
        np.cos(np.radians(turn_deg)),
        np.sin(np.radians(turn_deg)),
    )
    R, camera = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]), at_floor((0.1, -0.6, 1.4))
    t = -R @ np.array([0.25, 0.175, 0.0])
    view = board.find(board_image(camera, board, R, t))
    ideal = camera.project(view.board_m @ R.T + t)
    assert np.sqrt(np.mean(np.sum((view.px - ideal) ** 2, axis=1))) < 0.25


def test_a_part_of_a_charuco_board_is_enough():
    """With a third of the board outside the image the rest is found, numbered rightly."""
    board, camera = Charuco(8, 6, 0.06, 0.045), at_floor((0.0, 0.0, 1.4))
    t = np.array([0.35, -0.2, 0.0])
    view = board.find(board_image(camera, board, np.eye(3), t))
    assert 10 <= len(view.px) < 35
    error = view.px - camera.project(view.board_m + t)
    assert np.sqrt(np.mean(np.sum(error**2, axis=1))) < 0.35


def test_another_board_is_not_found():
    """A chessboard of 9 x 7 squares does not pass for one of 10 x 7, nor an empty wall for any."""
    camera = at_floor((0.0, 0.0, 1.2))
    image = board_image(camera, Chessboard(9, 7, 0.05), np.eye(3), np.array([-0.2, -0.15, 0.0]))
    assert Chessboard(10, 7, 0.05).find(image) is None
    assert parse_board("charuco:8x6:30:22").find(image) is None


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("chess:10x7", "not understood"),
        ("charuco:8x6:30", "not understood"),
        ("circles:8x6:30", "not understood"),
        ("chess:2x7:25", "3 to 60 squares"),
        ("charuco:8x6:30:29", "0.3 to 0.95"),
        ("charuco:20x20:30:22:DICT_4X4_50", "200 tags wanted"),
        ("charuco:8x6:30:22:DICT_9X9", "unknown"),
    ],
)
def test_a_board_that_cannot_be_is_refused(text, says):
    """Each wrong description is one line that says what is wrong."""
    with pytest.raises(BadInput, match=says) as error:
        parse_board(text)
    assert "\n" not in str(error.value)


def test_paper_too_small_and_wrong_ending(tmp_path):
    """A board larger than its paper is refused, and so is a format that is not drawn."""
    with pytest.raises(BadInput, match="larger paper"):
        lay_out(parse_board("charuco:8x6:60:45"), "a4", "")
    sheet = lay_out(parse_board("charuco:8x6:60:45"), "fit", "")
    assert sheet.width_mm == pytest.approx(8 * 60 + 2 * 7)
    with pytest.raises(BadInput, match=r"\.svg or \.pdf"):
        write_sheet(tmp_path / "board.docx", sheet)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("printed", "described"), [(True, "charuco"), (False, "charuco-old")])
def test_a_board_of_the_other_opencv_is_named(tmp_path, printed, described):
    """OpenCV's own picture of a board with even rows, described as the other: named; then found."""
    pattern = cv2.aruco.CharucoBoard(
        (8, 6), 0.03, 0.022, cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
    )
    pattern.setLegacyPattern(printed)
    (tmp_path / "views").mkdir()
    picture = cv2.cvtColor(pattern.generateImage((880, 680), None, 40), cv2.COLOR_GRAY2BGR)
    cv2.imwrite(str(tmp_path / "views" / "board.png"), picture)
    wrong = parse_board(f"{described}:8x6:30:22")
    assert wrong.find(picture) is None
    right = f"{'charuco-old' if printed else 'charuco'}:8x6:30:22"
    with pytest.raises(BadInput, match=f"the other way round .* {right}"):
        views_of_folder(wrong, tmp_path / "views", lambda _: None)
    assert len(parse_board(right).find(picture).px) == 35


def test_a_picture_without_a_board_has_no_hint():
    """Grey, and a board of odd rows, which all versions print alike."""
    assert (
        not_seen_hint(parse_board("charuco:8x6:30:22"), np.full((600, 800, 3), 99, np.uint8)) == ""
    )
    assert parse_board("charuco:8x5:30:22").other_print() is None


@pytest.mark.parametrize("kernel", [(1, 15), (15, 1), (9, 9)])
def test_a_blurred_picture_is_named(kernel):
    """A photograph blurred by 15 px along rows, along columns, or all round: said, with how much."""
    photo = cv2.imread(str(Path(__file__).parents[1] / "data/chessboard/left01.jpg"))
    board = parse_board("charuco:8x6:30:22")
    assert not_seen_hint(board, photo) == ""
    blurred = cv2.blur(photo, kernel) if 1 in kernel else cv2.GaussianBlur(photo, (0, 0), 4.0)
    hint = not_seen_hint(board, blurred)
    assert re.search(r"the pictures are blurred \(edges 1\d px wide", hint), hint
