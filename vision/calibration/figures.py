"""Pictures that show how far to believe a calibration."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from hil.core.types import Pose
from vision.calibration.advice import GRID_COLUMNS, GRID_ROWS, coverage
from vision.calibration.floor import FloorCalibration
from vision.calibration.intrinsics import LensCalibration
from vision.camera import CameraModel

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Bgr = tuple[int, int, int]

RED: Bgr = (40, 40, 230)
GREEN: Bgr = (60, 180, 40)
BLUE: Bgr = (220, 120, 30)
GREY: Bgr = (150, 150, 150)
WHITE: Bgr = (255, 255, 255)
BLACK: Bgr = (0, 0, 0)
# Drawing coordinates have 4 fractional bits, so lines lie where the model says to 1/16 px.
SHIFT = 4
LINE_POINTS = 60
GRID_STEPS_M = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0)
GRID_LINES_MAX = 24


def polyline(image: Image, px: ArrayLike, colour: Bgr, thickness: int = 1) -> None:
    """Draw a line through pixels, (N, 2), leaving out those that are NaN or far outside."""
    points = np.asarray(px, dtype=np.float64).reshape(-1, 2)
    reach = 2.0 * max(image.shape)
    good = np.isfinite(points).all(axis=1) & (np.abs(points) < reach).all(axis=1)
    whole = np.where(good[:, None], np.rint(np.nan_to_num(points) * (1 << SHIFT)), 0.0).astype(int)
    for k in np.flatnonzero(good[:-1] & good[1:]):
        a, b = (tuple(map(int, whole[i])) for i in (k, k + 1))
        cv2.line(image, a, b, colour, thickness, cv2.LINE_AA, SHIFT)


def dot(image: Image, px: ArrayLike, colour: Bgr, radius_px: float = 2.5) -> None:
    """Draw a filled dot at one pixel position; nothing for NaN."""
    u, v = np.asarray(px, dtype=np.float64)
    if math.isfinite(u) and math.isfinite(v):
        at = (round(u * (1 << SHIFT)), round(v * (1 << SHIFT)))
        cv2.circle(image, at, round(radius_px * (1 << SHIFT)), colour, -1, cv2.LINE_AA, SHIFT)


def label(image: Image, text: str, at: tuple[int, int], colour: Bgr = WHITE) -> None:
    """Write a line of text on a dark strip, readable on any ground."""
    scale = max(0.4, image.shape[1] / 1600.0)
    font = cv2.FONT_HERSHEY_SIMPLEX
    (width, height), below = cv2.getTextSize(text, font, scale, 1)
    corner = (at[0] + width + 2, at[1] + below)
    cv2.rectangle(image, (at[0] - 2, at[1] - height - 2), corner, BLACK, -1)
    cv2.putText(image, text, at, font, scale, colour, 1, cv2.LINE_AA)


def coverage_picture(calibration: LensCalibration) -> Image:
    """Return corners over the cells of the image, residuals drawn 100 times too long."""
    width, height = calibration.width_px, calibration.height_px
    image = np.full((height, width, 3), 255, dtype=np.uint8)
    counts = coverage([calibration.corners_px], (width, height))
    for row, column in np.argwhere(counts == 0):
        corner = (int(column * width / GRID_COLUMNS), int(row * height / GRID_ROWS))
        end = (int((column + 1) * width / GRID_COLUMNS), int((row + 1) * height / GRID_ROWS))
        cv2.rectangle(image, corner, end, (225, 225, 250), -1)
    for px, residual in zip(calibration.corners_px, calibration.residuals_px, strict=True):
        polyline(image, np.stack((px, px + 100.0 * residual)), RED)
        dot(image, px, BLUE, 1.5)
    label(image, "corners; residuals x 100; no corner in pink cells", (8, height - 10))
    return image


def floor_picture(image: Image, calibration: FloorCalibration, height_m: float) -> Image:
    """Return the image with the floor's grid, the world axes, the points and their residuals.

    `height_m` is that of the marks: the grid at it is drawn thin, to judge the height by eye.
    """
    camera, pairs = calibration.camera, calibration.pairs
    drawn = image.copy()
    step_m = draw_grid(drawn, camera, 0.0, GREEN)
    if height_m > 0.0:
        draw_grid(drawn, camera, height_m, GREY)
    draw_axes(drawn, camera, step_m)
    seen, ideal = pairs.px, camera.project(pairs.world_m)
    for px, model in zip(seen, ideal, strict=True):
        polyline(drawn, np.stack((px, px + 20.0 * (px - model))), RED)
        dot(drawn, px, BLUE, 2.0)
    text = f"grid {step_m:g} m; residuals x 20, held out {calibration.held_out_rms_mm:.2f} mm RMS"
    label(drawn, text, (8, drawn.shape[0] - 10))
    return drawn


def draw_grid(image: Image, camera: CameraModel, height_m: float, colour: Bgr) -> float:
    """Draw the lines of round X and Y that are in view, bent as the lens bends; returns the step."""
    u, v = np.meshgrid(np.linspace(0, camera.width_px, 9), np.linspace(0, camera.height_px, 7))
    seen = camera.floor_points(np.column_stack((u.ravel(), v.ravel())), height_m)
    seen = seen[np.isfinite(seen).all(axis=1)]
    if not len(seen):
        return GRID_STEPS_M[0]
    # Pixels near the horizon see kilometres: the grid ends at a few camera heights.
    reach = 4.0 * camera.t_world_cam_m[2]
    low = np.maximum(seen.min(axis=0), camera.t_world_cam_m[:2] - reach)
    high = np.minimum(seen.max(axis=0), camera.t_world_cam_m[:2] + reach)
    extent = float(np.max(high - low))
    step = next((s for s in GRID_STEPS_M if extent / s <= GRID_LINES_MAX), GRID_STEPS_M[-1])
    for axis in (0, 1):
        along = np.linspace(low[1 - axis], high[1 - axis], LINE_POINTS)
        for value in (
            np.arange(math.ceil(low[axis] / step), math.floor(high[axis] / step) + 1) * step
        ):
            line = np.empty((LINE_POINTS, 3))
            line[:, axis], line[:, 1 - axis], line[:, 2] = value, along, height_m
            polyline(image, camera.project(line), colour)
    return step


def draw_axes(image: Image, camera: CameraModel, length_m: float) -> None:
    """Draw world X in red and Y in green from the origin."""
    for axis, colour in ((0, RED), (1, GREEN)):
        line = np.zeros((LINE_POINTS, 3))
        line[:, axis] = np.linspace(0.0, length_m, LINE_POINTS)
        px = camera.project(line)
        polyline(image, px, colour, 2)
        if np.isfinite(px[-1]).all():
            label(image, "XY"[axis], (int(px[-1, 0]), int(px[-1, 1])), colour)


def draw_pose(image: Image, camera: CameraModel, pose: Pose, height_m: float) -> None:
    """Draw the pose as a cross of 0.1 m at the marks' height, forward in red."""
    c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
    for (x, y), colour in (((0.1, 0.0), RED), ((0.0, 0.05), GREEN)):
        end = (pose.x_m + c * x - s * y, pose.y_m + s * x + c * y, height_m)
        px = camera.project(np.array([(pose.x_m, pose.y_m, height_m), end]))
        polyline(image, px, colour, 2)
