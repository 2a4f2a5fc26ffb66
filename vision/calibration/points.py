"""World-image point pairs: read from CSV, made from a board on the floor or from fiducials."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hil.core.errors import BadInput
from vision import cv_compat
from vision.calibration.boards import Board, BoardView, Chessboard
from vision.calibration.tables import read_numbers

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Place = tuple[float, float, float]  # x_m, y_m, theta_rad of a board's origin on the floor


@dataclass(frozen=True, slots=True)
class PointPairs:
    """Named points: world (N, 3) in m and pixels (N, 2)."""

    names: tuple[str, ...]
    world_m: Array
    px: Array

    def take(self, which: NDArray[np.intp]) -> PointPairs:
        """Return the points with these indices."""
        names = tuple(self.names[k] for k in which)
        return PointPairs(names, self.world_m[which], self.px[which])

    @staticmethod
    def joined(parts: Sequence[PointPairs]) -> PointPairs:
        """Return the points of all parts."""
        names = tuple(name for part in parts for name in part.names)
        world = np.vstack([part.world_m for part in parts])
        return PointPairs(names, world, np.vstack([part.px for part in parts]))


def read_pairs(path: Path) -> PointPairs:
    """Return the pairs of a CSV with columns x_m, y_m, u_px, v_px and, if wanted, z_m.

    Raises BadInput for a file without points.
    """
    rows = read_numbers(path, ("x_m", "y_m", "u_px", "v_px"), ("z_m",))
    if not rows:
        raise BadInput(f"{path}: no points in it")
    world = np.array([(row["x_m"], row["y_m"], row.get("z_m", 0.0)) for row in rows])
    px = np.array([(row["u_px"], row["v_px"]) for row in rows])
    names = tuple(f"{k} ({x:g}, {y:g} m)" for k, (x, y) in enumerate(world[:, :2].tolist(), 1))
    return PointPairs(names, world, px)


def pairs_of_board(board: Board, view: BoardView, place: Place) -> PointPairs:
    """Return a board's corners as floor points, the board lying flat at `place`.

    Raises BadInput for a board that looks the same upside down.
    """
    if isinstance(board, Chessboard) and not board.one_way_up:
        raise BadInput(
            f"floor: a chessboard of {board.columns} x {board.rows} squares looks the same upside"
            " down; use one with an odd sum of columns and rows, or a ChArUco board"
        )
    x_m, y_m, theta_rad = place
    c, s = math.cos(theta_rad), math.sin(theta_rad)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    world = view.board_m @ turn + np.array([x_m, y_m, 0.0])
    names = tuple(f"{view.name} corner {k}" for k in range(len(world)))
    return PointPairs(names, world, view.px)


def pairs_of_fiducials(image: Image, name: str, table: Path, dictionary: str) -> PointPairs:
    """Return the centres of tags seen, by a CSV with columns id, x_m, y_m and, if wanted, z_m.

    Raises BadInput that names the tags of the table which are not seen.
    """
    rows = read_numbers(table, ("id", "x_m", "y_m"), ("z_m",))
    places = {int(row["id"]): (row["x_m"], row["y_m"], row.get("z_m", 0.0)) for row in rows}
    found, corners = cv_compat.detect_tags(cv_compat.tag_detector(dictionary, refine=True), image)
    seen = {int(number): centre_of_tag(c) for number, c in zip(found, corners, strict=True)}
    known = [number for number in places if number in seen]
    if not known:
        listed = ", ".join(map(str, sorted(places)))
        have = ", ".join(map(str, sorted(seen))) or "none"
        raise BadInput(f"{name}: tags {listed} of {table} not seen ({dictionary}; seen: {have})")
    names = tuple(f"tag {number}" for number in known)
    world = np.array([places[number] for number in known])
    return PointPairs(names, world, np.array([seen[number] for number in known]))


def centre_of_tag(corners: Array) -> Array:
    """Return where the diagonals of a tag's corners, (4, 2), meet: its centre in perspective."""
    a, c, b, d = corners[0], corners[2], corners[1], corners[3]
    along, across = c - a, d - b
    start = b - a
    t = (start[0] * across[1] - start[1] * across[0]) / (
        along[0] * across[1] - along[1] * across[0]
    )
    centre: Array = a + t * along
    return centre
