"""The renderer's marks against rays: each pixel cut into 20 x 20, each piece followed to the plane.

Lens by OpenCV, geometry written here; nothing of the renderer's code is used.
"""

import math

import cv2
import numpy as np
import pytest

from hil.tools import vision_conditions as bench
from tests.vision.scenes import rendered

PIECES = 20
POSES = [(0.1, 0.05, 0.3), (-0.62, 0.28, 2.0), (0.55, -0.3, -1.1)]


def look(eye, target):
    """Return the axes of a camera, rows in the world: right, down, forward."""
    forward = (np.array(target) - eye) / np.linalg.norm(np.array(target) - eye)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    if np.linalg.norm(right) < 1e-6:
        right = np.cross(forward, (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    return np.stack((right, np.cross(forward, right), forward))


def floor_of(config, px, height_m):
    """Return where the rays of pixels (N, 2) meet the plane at a height, (N, 2) m."""
    lens = config.lens
    matrix = np.array([[lens.fx_px, 0, lens.cx_px], [0, lens.fy_px, lens.cy_px], [0, 0, 1.0]])
    scale = config.width_px / lens.at_width_px
    rows_cut = 0.5 * (lens.at_height_px * scale - config.height_px)
    matrix[:2] *= scale
    matrix[:2, 2] += 0.5 * scale - 0.5
    matrix[1, 2] -= rows_cut
    dist = np.array([lens.k1, lens.k2, lens.p1, lens.p2, lens.k3])
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-12)
    xy = cv2.undistortPoints(px.reshape(-1, 1, 2), matrix, dist, criteria=stop)[:, 0]
    eye = np.array(config.pose.eye_m)
    rays = np.column_stack((xy, np.ones(len(xy)))) @ look(eye, config.pose.target_m)
    return eye[:2] + rays[:, :2] * ((height_m - eye[2]) / rays[:, 2])[:, None]


def covered(config, centre_m, corner_px, size_px):
    """Return the share of each pixel of a part of the image that a mark covers, (H, W)."""
    step = (np.arange(PIECES) + 0.5) / PIECES - 0.5
    u = (corner_px[0] + np.arange(size_px)[:, None] + step).ravel()
    v = (corner_px[1] + np.arange(size_px)[:, None] + step).ravel()
    at = floor_of(
        config, np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2), config.marks.height_m
    )
    inside = np.hypot(*(at - centre_m).T) < 0.5 * config.marks.diameter_m
    return inside.reshape(size_px, PIECES, size_px, PIECES).mean(axis=(1, 3))


def drawn(config, pose, corner_px, size_px, peak):
    """Return the same share from the rendered picture: red less what the plate has, over the mark's."""
    picture = rendered(config).make(0, [pose] * 2).astype(float)
    part = picture[corner_px[1] :, corner_px[0] :][:size_px, :size_px]
    chroma = part[..., 2] - part[..., 0]
    inside, outside = np.median(chroma[peak > 0.999]), np.median(chroma[peak == 0.0])
    return (chroma - outside) / (inside - outside)


def centroid(share):
    v, u = np.indices(share.shape)
    return np.array([(share * u).sum(), (share * v).sum()]) / share.sum()


def compared(view, pose, shift_m=0.0):
    """Return the distance of the centroids, px, and the RMS difference of shares at the rim."""
    config = bench.camera_of(view, (1280, 720), bench.CONDITIONS["clean"])
    x, y, theta = pose
    centre_m = np.array((x + 0.08 * math.cos(theta) + shift_m, y + 0.08 * math.sin(theta)))
    grid = np.stack(np.meshgrid(np.arange(0, 1280, 8.0), np.arange(0, 720, 8.0)), -1).reshape(-1, 2)
    nearest = grid[np.argmin(np.hypot(*(floor_of(config, grid, 0.1) - centre_m).T))].astype(int)
    size_px = 64
    corner = nearest - size_px // 2
    traced = covered(config, centre_m, corner, size_px)
    shown = drawn(config, pose, corner, size_px, traced)
    near = np.abs(shown) < 1.5
    shown = np.where(cv2.dilate(traced, np.ones((5, 5))) > 0, shown, 0.0) * near
    rim = (traced > 0.0) & (traced < 1.0)
    apart = centroid(np.clip(shown, 0.0, 1.0)) - centroid(traced)
    return float(np.hypot(*apart)), float(np.sqrt(np.mean((shown - traced)[rim] ** 2)))


@pytest.mark.parametrize("view", list(bench.VIEWS))
@pytest.mark.parametrize("pose", POSES)
def test_marks_are_where_rays_put_them(view, pose):
    """Centroids within 0.015 px (0.03 mm), each pixel of the rim covered as the rays say, to 5 % RMS.

    A level of 60 DN between mark and plate is rounded to 1.7 %, and the renderer's own pieces of a
    pixel are fewer.
    """
    apart_px, rms = compared(view, pose)
    assert apart_px < 0.015
    assert rms < 0.05


def test_a_mark_half_a_millimetre_off_is_another_one():
    """Negative control: rays to a mark 0.5 mm beside it: a quarter of a pixel."""
    apart_px, rms = compared("ceiling", POSES[0], shift_m=0.5e-3)
    assert apart_px > 0.1
    assert rms > 0.06
