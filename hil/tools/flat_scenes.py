"""Scenes drawn flat on the plane of the marks, in milliseconds: for look-alikes by the ten thousand.

The twin's renderer takes a second to prepare a scene and milliseconds a frame. What a localiser makes of
coloured things hangs on the scene and hardly on the noise, so here a scene is what is cheap: every thing is
painted over those before it where it seems to lie on the plane of the marks, each pixel covered by as much
as nine points of it say. No sides, no shade; light, blur, noise and JPEG are those of `vision_conditions`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from hil.config.camera import ClutterConfig, MarksConfig, RobotLookConfig
from hil.core.types import Pose
from vision.camera import CameraModel

Floats = NDArray[np.float32]
Colour = tuple[float, float, float]

WHITE_DN = 225.0
TEXTURE_RATIO = 0.08
PATCH_PX = 6
SUBPIXELS = (-1 / 3, 0.0, 1 / 3)


def apparent(model: CameraModel, thing: ClutterConfig, height_m: float) -> ClutterConfig:
    """Return a thing as it seems to lie at a height: moved and grown about the point below the camera."""
    x_m, y_m, eye_m = (float(value) for value in model.t_world_cam_m)
    grown = (eye_m - height_m) / (eye_m - thing.height_m)
    return thing.model_copy(update={
        "x_m": x_m + (thing.x_m - x_m) * grown, "y_m": y_m + (thing.y_m - y_m) * grown,
        "size_m": (thing.size_m[0] * grown, thing.size_m[1] * grown), "height_m": height_m,
    })  # fmt: skip


class FlatScenes:
    """Draws scenes for one camera, without noise; holds where each pixel looks, and a floor's texture."""

    def __init__(self, model: CameraModel, height_m: float, seed: int = 1) -> None:
        self._model, self._height_m = model, height_m
        v, u = np.mgrid[0 : model.height_px, 0 : model.width_px]
        px = np.column_stack((u.ravel(), v.ravel())).astype(np.float64)
        at_m = model.floor_points(px, height_m).reshape(*u.shape, 2)
        self._at_m = at_m.astype(np.float32)
        down, across = np.gradient(at_m, axis=(0, 1))
        self._across_m: Floats = np.asarray(across, np.float32)
        self._down_m: Floats = np.asarray(down, np.float32)
        rng = np.random.default_rng(seed)
        patches = (model.height_px // PATCH_PX + 1, model.width_px // PATCH_PX + 1)
        coarse = 1.0 + TEXTURE_RATIO * rng.standard_normal(patches)
        whole = np.kron(coarse, np.ones((PATCH_PX, PATCH_PX)))
        self._texture = whole[: model.height_px, : model.width_px].astype(np.float32)

    def draw(self, things: Sequence[ClutterConfig], floor: Colour) -> Floats:
        """Return the linear picture, (H, W, 3) DN, of things painted one over the other in their order."""
        image = WHITE_DN * self._texture[..., None] * np.asarray(floor, np.float32)
        for thing in things:
            self._paint(image, apparent(self._model, thing, self._height_m))
        return np.asarray(image, np.float32)

    def _paint(self, image: Floats, thing: ClutterConfig) -> None:
        window = self._window(thing)
        if window is None:
            return
        covered = self._covered(thing, window)[..., None]
        part = image[window]
        part += covered * (WHITE_DN * np.asarray(thing.colour, np.float32) - part)

    def _window(self, thing: ClutterConfig) -> tuple[slice, slice] | None:
        """Return the rows and columns that hold a thing; None where it is out of view."""
        reach_m = 0.5 * math.hypot(*thing.size_m)
        turns = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
        rim = np.column_stack((
            thing.x_m + reach_m * np.cos(turns), thing.y_m + reach_m * np.sin(turns),
            np.full(len(turns), thing.height_m),
        ))  # fmt: skip
        px = self._model.project(rim)
        if not np.isfinite(px).all():
            return None
        left, top = np.maximum(np.floor(px.min(axis=0)).astype(int) - 2, 0).tolist()
        right, bottom = (np.ceil(px.max(axis=0)).astype(int) + 3).tolist()
        height, width = self._texture.shape
        right, bottom = min(right, width), min(bottom, height)
        return (slice(top, bottom), slice(left, right)) if left < right and top < bottom else None

    def _covered(self, thing: ClutterConfig, window: tuple[slice, slice]) -> Floats:
        """Return how much of each pixel of a window a thing covers, 0 to 1."""
        off: Floats = self._at_m[window] - np.array((thing.x_m, thing.y_m), np.float32)
        across, down = self._across_m[window], self._down_m[window]
        c, s = math.cos(thing.theta_rad), math.sin(thing.theta_rad)
        turn = np.array(((c, -s), (s, c)), np.float32)
        off, across, down = off @ turn, across @ turn, down @ turn
        half_x, half_y = (0.5 * size_m for size_m in thing.size_m)
        half = np.array((half_x, half_y), np.float32)
        total = np.zeros(off.shape[:2], np.float32)
        for right in SUBPIXELS:
            for below in SUBPIXELS:
                at = off + np.float32(right) * across + np.float32(below) * down
                if thing.shape == "disc":
                    total += np.einsum("ijk,ijk->ij", at, at) < np.float32(half_x) ** 2
                else:
                    total += (np.abs(at) < half).all(axis=2)
        return np.asarray(total / len(SUBPIXELS) ** 2, np.float32)


def robot(pose: Pose, marks: MarksConfig) -> Iterator[ClutterConfig]:
    """Yield the robot's plate, circuit board and marks."""
    look = RobotLookConfig()
    top_m = marks.height_m
    plate = (look.plate_length_m, look.plate_width_m)
    for size_m, colour in ((plate, look.plate_colour), (look.board_size_m, look.board_colour)):
        yield ClutterConfig(
            shape="box", x_m=pose.x_m, y_m=pose.y_m, theta_rad=pose.theta_rad, size_m=size_m,
            height_m=top_m, colour=colour,
        )  # fmt: skip
    c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
    for mark in marks.all:
        yield ClutterConfig(
            x_m=pose.x_m + c * mark.x_m - s * mark.y_m, y_m=pose.y_m + s * mark.x_m + c * mark.y_m,
            size_m=(marks.diameter_m,) * 2, height_m=top_m, colour=mark.colour,
        )  # fmt: skip
