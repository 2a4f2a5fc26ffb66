"""Boards and tags as a camera sees them: rays through a lens onto a flat print."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from hil.config.camera import CameraConfig
from vision.calibration.boards import Rect, tag_cells
from vision.camera import CameraModel, look_at
from vision.camera_setup import camera_model

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

SUPERSAMPLING = 2
TEXTURE_M_PX = 0.25e-3
PAPER_RIM_M = 0.012
GROUND_DN, PAPER_DN, INK_DN = 110.0, 215.0, 25.0

# The twin's lens, before a camera that looks along world z.
LENS = replace(camera_model(CameraConfig()), R_world_cam=np.eye(3), t_world_cam_m=np.zeros(3))


class Flat(Protocol):
    """What is printed: a checker or tags, columns x rows of squares."""

    @property
    def columns(self) -> int: ...  # noqa: D102 - as of a board
    @property
    def rows(self) -> int: ...  # noqa: D102
    @property
    def square_m(self) -> float: ...  # noqa: D102
    def black(self) -> list[Rect]: ...  # noqa: D102


@dataclass(frozen=True)
class TagFloor:
    """Tags flat on white paper: number -> lower left corner in m; the drawing's own corner is 0, 0."""

    places: dict[int, tuple[float, float]]
    side_m: float
    columns: int = 20
    rows: int = 15
    square_m: float = 0.1
    texture_m_px: float = 1e-3

    def black(self) -> list[Rect]:
        """Return the black cells of every tag."""
        tags = self.places.items()
        return [cell for k, at in tags for cell in tag_cells("DICT_4X4_50", k, at, self.side_m)]


@lru_cache(maxsize=4)
def _rays(lens: CameraModel) -> NDArray[np.float32]:
    """Return the directions, (M, 3), of a grid within each pixel."""
    n = SUPERSAMPLING
    offsets = (np.arange(n) + 0.5) / n - 0.5
    u = (np.arange(lens.width_px)[:, None] + offsets).ravel()
    v = (np.arange(lens.height_px)[:, None] + offsets).ravel()
    uu, vv = np.meshgrid(u, v)
    xy = lens.normalise(np.column_stack((uu.ravel(), vv.ravel())))
    return np.column_stack((xy, np.ones(len(xy)))).astype(np.float32)


def _texture(board: Flat) -> tuple[NDArray[np.bool_], float]:
    """Return the board's ink, True for black, row 0 at the bottom."""
    scale = 1.0 / getattr(board, "texture_m_px", TEXTURE_M_PX)
    size = (
        round(board.rows * board.square_m * scale),
        round(board.columns * board.square_m * scale),
    )
    ink = np.zeros(size, dtype=bool)
    for x, y, w, h in board.black():
        rows = slice(round(y * scale), round((y + h) * scale))
        ink[rows, round(x * scale) : round((x + w) * scale)] = True
    return ink, scale


def board_image(
    camera: CameraModel, board: Flat, R_world_board: Array, t_world_board: Array, seed: int = 0
) -> Image:
    """Return a BGR photograph of a board whose corner lies at t, turned by R, with sensor noise."""
    R_board_cam = R_world_board.T @ camera.R_world_cam
    eye = R_world_board.T @ (camera.t_world_cam_m - t_world_board)
    rays = _rays(LENS if same_lens(camera) else camera) @ R_board_cam.T.astype(np.float32)
    reach = -eye[2] / rays[:, 2]
    x, y = eye[0] + reach * rays[:, 0], eye[1] + reach * rays[:, 1]
    ink, scale = _texture(board)
    i = np.floor(y * scale).astype(np.int32)
    j = np.floor(x * scale).astype(np.int32)
    rim = round(PAPER_RIM_M * scale)
    paper = (reach > 0) & (i >= -rim) & (j >= -rim)
    paper &= (i < ink.shape[0] + rim) & (j < ink.shape[1] + rim)
    inside = paper & (i >= 0) & (j >= 0) & (i < ink.shape[0]) & (j < ink.shape[1])
    level = np.where(paper, PAPER_DN, GROUND_DN).astype(np.float32)
    level[inside] = np.where(ink[i[inside], j[inside]], INK_DN, PAPER_DN)
    n = SUPERSAMPLING
    level = level.reshape(camera.height_px, n, camera.width_px, n).mean(axis=(1, 3))
    level = cv2.GaussianBlur(level, (0, 0), 0.5)
    noisy = level + np.random.default_rng(seed).normal(0.0, 1.5, level.shape)
    grey = np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
    return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR), dtype=np.uint8)


def same_lens(camera: CameraModel) -> bool:
    """Return whether a camera has the lens whose rays are kept."""
    names = ("width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px", "dist")
    return all(getattr(camera, name) == getattr(LENS, name) for name in names)


def at_floor(eye_m: ArrayLike, target_m: ArrayLike = (0.0, 0.0, 0.0)) -> CameraModel:
    """Return the lens as a camera over the floor."""
    return replace(LENS, R_world_cam=look_at(eye_m, target_m), t_world_cam_m=np.array(eye_m, float))


def hand_held(board: Flat, count: int, seed: int = 1) -> Iterator[tuple[Array, Array]]:
    """Yield (R, t) of a board held before a camera at the origin, over image, tilts and distances."""
    rng = np.random.default_rng(seed)
    half = 0.5 * np.array([board.columns, board.rows, 0.0]) * board.square_m
    face_on = np.diag([1.0, -1.0, -1.0])  # x right, y up in the image, z towards the camera
    for k in range(count):
        tilt, azimuth = np.radians(rng.uniform(5, 40)), rng.uniform(0, 2 * np.pi)
        axis = np.array([np.cos(azimuth), np.sin(azimuth), 0.0]) * tilt
        R = (
            cv2.Rodrigues(axis)[0]
            @ face_on
            @ cv2.Rodrigues(np.array([0, 0, rng.uniform(-0.6, 0.6)]))[0]
        )
        z = rng.uniform(0.42, 0.62)
        across = ((k % 3) - 1) * 0.2 * z + rng.uniform(-0.03, 0.03)
        down = ((k // 3 % 3) - 1) * 0.13 * z + rng.uniform(-0.02, 0.02)
        yield R, np.array([across, down, z]) - R @ half
