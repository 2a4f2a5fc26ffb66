"""Calibration boards: what they look like, where their corners are, and how they are found.

A board lies on the floor face up: x right and y up along the print, z out of the paper, origin at
the outer lower left corner of the pattern (marked on the printed sheet), metres. A ChArUco board
is the default: parts of it are enough, and every corner is known by its number. A chessboard must
be seen whole, and one with an even-even or odd-odd number of squares looks the same upside down.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hil.core.errors import BadInput
from vision import cv_compat
from vision.calibration.checker import checker_fault
from vision.calibration.sharpness import blurred_hint

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Rect = tuple[float, float, float, float]  # x, y of the lower left corner, width, height, all m

POINTS_MIN = 6
# Both detectors want three inner corners each way.
CHESS_SQUARES_MIN = 4


@dataclass(frozen=True, slots=True)
class BoardView:
    """One sight of a board: (N, 3) board points in m and their (N, 2) pixels, row by row.

    `fault` says why these cannot be the corners of the board described, "" where they can.
    """

    name: str
    board_m: Array
    px: Array
    fault: str = ""


def inner_corners(columns: int, rows: int, square_m: float) -> Array:
    """Return the inner corners, (N, 3), row by row from the top left, in m."""
    x, y = np.meshgrid(np.arange(1, columns), np.arange(rows - 1, 0, -1))
    grid = np.column_stack((x.ravel(), y.ravel(), np.zeros(x.size)))
    return np.asarray(grid * square_m, dtype=np.float64)


def _black_squares(columns: int, rows: int, square_m: float, first: int = 0) -> list[Rect]:
    """Return the squares of the checker; the one at the top left is black when `first` is 0."""
    a = square_m
    return [
        (i * a, (rows - 1 - j) * a, a, a)
        for j in range(rows)
        for i in range(columns)
        if (i + j) % 2 == first
    ]


@dataclass(frozen=True)
class Chessboard:
    """A plain chessboard of columns x rows squares (one more than inner corners each way)."""

    columns: int
    rows: int
    square_m: float
    detector: str = "sector"

    @property
    def one_way_up(self) -> bool:
        """Whether the colours of the squares tell the board from itself turned by 180 degrees."""
        return (self.columns + self.rows) % 2 == 1

    def find(self, image: Image, name: str = "") -> BoardView | None:
        """Return all inner corners, or None: a chessboard is found whole or not at all.

        Corners of a checker of another size are returned with the view's `fault`.
        """
        corners = cv_compat.find_chessboard(image, self.columns - 1, self.rows - 1, self.detector)
        if corners is None:
            return None
        grid = corners.reshape(self.rows - 1, self.columns - 1, 2)
        if _mirrored(grid):
            grid = grid[:, ::-1]
        if self.one_way_up and not _black_between(image, grid[:2, :2]):
            grid = grid[::-1, ::-1]
        points = inner_corners(self.columns, self.rows, self.square_m)
        fault = checker_fault(cv_compat.grey(image), grid)
        return BoardView(name, points, grid.reshape(-1, 2), fault)

    def black(self) -> list[Rect]:
        """Return the black squares."""
        return _black_squares(self.columns, self.rows, self.square_m)


def _mirrored(grid: Array) -> bool:
    """Return whether columns and rows run counter-clockwise in the image (y down)."""
    along, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    return bool(along[0] * down[1] - along[1] * down[0] < 0.0)


def _black_between(image: Image, corners: Array) -> bool:
    """Return whether the square within 2 x 2 corners is darker than its right-hand neighbour."""
    level = cv_compat.grey(image)
    centre = corners.mean(axis=(0, 1))
    right = centre + corners[:, 1].mean(axis=0) - corners[:, 0].mean(axis=0)
    (u, v), (u_right, v_right) = np.rint(centre).astype(int), np.rint(right).astype(int)
    height, width = level.shape
    u_right, v_right = np.clip(u_right, 0, width - 1), np.clip(v_right, 0, height - 1)
    return bool(level[v, u] < level[v_right, u_right])


@dataclass(frozen=True)
class Charuco:
    """A chessboard with a numbered tag in each white square.

    `old` is the pattern printed before OpenCV 4.6: with an even number of rows its square at the top
    left is white.
    """

    columns: int
    rows: int
    square_m: float
    marker_m: float
    dictionary: str = "DICT_4X4_250"
    old: bool = False

    @property
    def _first_black(self) -> int:
        return int(self.old and self.rows % 2 == 0)

    def other_print(self) -> Charuco | None:
        """Return the board of the other OpenCV versions, None where both print the same."""
        return replace(self, old=not self.old) if self.rows % 2 == 0 else None

    @cached_property
    def _cv_board(self) -> cv_compat.CharucoBoard:
        return cv_compat.charuco_board(
            self.columns, self.rows, self.square_m, self.marker_m, self.dictionary, old=self.old
        )

    def find(self, image: Image, name: str = "") -> BoardView | None:
        """Return the inner corners seen; None for fewer than 6, or all of them in one line.

        A board too far away for its tags to be read is looked for in the enlarged image.
        """
        for enlarge in (1, 2):
            numbers, px = cv_compat.detect_charuco(self._cv_board, image, enlarge)
            points = inner_corners(self.columns, self.rows, self.square_m)[numbers]
            if len(points) >= POINTS_MIN and np.linalg.matrix_rank(points[1:] - points[0]) == 2:
                return BoardView(name, points, px, self._fault(image, points, px))
        return None

    def _fault(self, image: Image, points: Array, px: Array) -> str:
        """Return a fault where tags of higher numbers go on in step below the last row."""
        own = self.columns * self.rows // 2
        numbers, corners = cv_compat.detect_tags(cv_compat.tag_detector(self.dictionary), image)
        if not (numbers >= own).any():
            return ""
        to_image = cv_compat.plane_map(points[:, :2], px)
        places = _white_squares(self.columns, self.rows * 2, self._first_black)
        beyond = [k for k in np.flatnonzero(numbers >= own) if numbers[k] < len(places)]
        in_step = []
        for k in beyond:
            i, j = places[numbers[k]]
            centre_m = np.array([[i + 0.5, self.rows - 1 - j + 0.5]]) * self.square_m
            side_px = float(np.linalg.norm(corners[k][1] - corners[k][0]))
            off = cv_compat.mapped(to_image, centre_m)[0] - corners[k].mean(axis=0)
            if np.linalg.norm(off) < 0.4 * side_px:
                in_step.append(int(numbers[k]))
        listed = ", ".join(map(str, sorted(in_step)))
        return f"its tags go on below with {listed}" if in_step else ""

    def black(self) -> list[Rect]:
        """Return the black squares and the black cells of every tag."""
        first = self._first_black
        rects = _black_squares(self.columns, self.rows, self.square_m, first)
        white = _white_squares(self.columns, self.rows, first)
        margin = 0.5 * (self.square_m - self.marker_m)
        for number, (i, j) in enumerate(white):
            corner = (i * self.square_m + margin, (self.rows - 1 - j) * self.square_m + margin)
            rects += tag_cells(self.dictionary, number, corner, self.marker_m)
        return rects


def _white_squares(columns: int, rows: int, first: int = 0) -> list[tuple[int, int]]:
    """Return (column, row from the top) of the white squares in the order of their tags."""
    return [(i, j) for j in range(rows) for i in range(columns) if (i + j) % 2 != first]


def tag_cells(name: str, number: int, corner_m: tuple[float, float], side_m: float) -> list[Rect]:
    """Return the black cells of one tag, runs along a row joined, its lower left corner given."""
    bits = cv_compat.tag_bits(name, number)
    cells = len(bits)
    a = side_m / cells
    rects: list[Rect] = []
    for row, line in enumerate(bits):
        edges = np.flatnonzero(np.diff(np.r_[0, line.astype(int), 0]))
        for start, end in edges.reshape(-1, 2):
            y = corner_m[1] + (cells - 1 - row) * a
            rects.append((corner_m[0] + start * a, y, (end - start) * a, a))
    return rects


Board = Chessboard | Charuco


def not_seen_hint(board: Board, image: Image) -> str:
    """Return why a board may not be seen: its squares the other way round, or a blurred picture."""
    other = board.other_print() if isinstance(board, Charuco) else None
    if other is None or other.find(image) is None:
        return blurred_hint(cv_compat.grey(image))
    name = "charuco-old" if other.old else "charuco"
    sizes = f"{other.columns}x{other.rows}:{other.square_m * 1e3:g}:{other.marker_m * 1e3:g}"
    return (
        "; its tags are seen with black and white squares the other way round (printed by OpenCV"
        f" {'before' if other.old else 'from'} 4.6): describe it as {name}:{sizes}"
    )


def parse_board(text: str, detector: str = "sector") -> Board:
    """Return the board that a description names.

    `charuco:COLUMNSxROWS:SQUARE_MM:MARKER_MM[:DICTIONARY]` or `chess:COLUMNSxROWS:SQUARE_MM`, in
    squares and not in inner corners; `charuco-old:` for one printed before OpenCV 4.6. Raises
    BadInput.
    """
    kind, *rest = text.split(":")
    try:
        columns, rows = (int(n) for n in rest[0].lower().split("x"))
        sizes_m = [float(size) * 1e-3 for size in rest[1:3]]
        board: Board
        if kind == "chess" and len(rest) == 2:
            board = Chessboard(columns, rows, sizes_m[0], detector)
        elif kind in {"charuco", "charuco-old"} and len(rest) in {3, 4}:
            board = Charuco(columns, rows, sizes_m[0], sizes_m[1], old=kind == "charuco-old")
            if len(rest) == 4:
                board = replace(board, dictionary=rest[3])
        else:
            raise ValueError
    except (ValueError, IndexError):
        raise BadInput(
            f"board {text!r}: not understood; give charuco:COLUMNSxROWS:SQUARE_MM:MARKER_MM or"
            " chess:COLUMNSxROWS:SQUARE_MM, for example charuco:8x6:30:22 (squares, not corners)"
        ) from None
    _check(board, text)
    return board


def _check(board: Board, text: str) -> None:
    """Raise BadInput for a board that cannot be printed or found."""
    columns, rows, square_m = board.columns, board.rows, board.square_m
    if min(columns, rows) < 3 or max(columns, rows) > 60 or not 0.001 <= square_m <= 1.0:
        raise BadInput(f"board {text!r}: limits are 3 to 60 squares each way of 1 to 1000 mm")
    if isinstance(board, Chessboard):
        if min(columns, rows) < CHESS_SQUARES_MIN:
            raise BadInput(
                f"board {text!r}: a chessboard is found from {CHESS_SQUARES_MIN} squares each way"
                " (squares, not corners); take a larger one, or a ChArUco board"
            )
        return
    if (columns - 1) * (rows - 1) < POINTS_MIN:
        raise BadInput(
            f"board {text!r}: {(columns - 1) * (rows - 1)} corners between its squares, at least"
            f" {POINTS_MIN} are needed; take more squares"
        )
    if not 0.3 * square_m <= board.marker_m <= 0.95 * square_m:
        raise BadInput(
            f"board {text!r}: marker {board.marker_m * 1e3:g} mm on a square of"
            f" {square_m * 1e3:g} mm; limit is 0.3 to 0.95 of the square"
        )
    held = cv_compat.dictionary_size(board.dictionary)
    if columns * rows // 2 > held:
        raise BadInput(
            f"board {text!r}: {columns * rows // 2} tags wanted, {board.dictionary} holds {held}"
        )
