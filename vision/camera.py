"""Pinhole camera with lens distortion at a known pose over the floor.

Frames: world is right-handed, X right and Y up on the floor, z up, metres. Camera is OpenCV's: x
to the right of the image, y down, z along the optical axis. The pose, `R_world_cam` and
`t_world_cam_m`, takes camera coordinates to world coordinates, so the latter is the camera's
centre. Pixel (0, 0) is the centre of the first pixel. Distortion is OpenCV's model of five terms (k1,
k2, p1, p2, k3), or of eight: the radial factor of its rational model is
(1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6).

The maths is written out here and not taken from cv2: `cv2.undistortPoints` stops 0.1 px short of
the answer at image corners with its default criteria, and a call for one point costs more than
the sum itself.

A wide lens is `fisheye`: a ray at angle theta from the axis lies at theta (1 + k1 theta^2 +
k2 theta^4 + k3 theta^6) from the centre (Kannala and Brandt 2006; `cv2.fisheye` with k4 = 0), p1
and p2 as before. Rays at 90 degrees and more have no place here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Scalars = TypeVar("Scalars", float, Array)
Distortion = tuple[float, ...]  # k1, k2, p1, p2, k3, and for a rational lens k4, k5, k6

TERMS = 5
RATIONAL_TERMS = 8
NEWTON_STEPS_MAX = 20
NEWTON_TOLERANCE = 1e-13
# Below this squared radius a fisheye's factor is that at it: 1 to 1e-10.
R2_SMALL = 1e-10


def _fisheye_radial(r2: Scalars, dist: Distortion) -> tuple[Scalars, Scalars]:
    """Return the radial factor of a fisheye lens and its slope, (d factor / dr) / r."""
    k1, k2, _, _, k3 = dist[:5]
    r = np.sqrt(np.maximum(r2, R2_SMALL))
    theta = np.arctan(r)
    t2 = theta * theta
    factor = theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * k3))) / r
    rise = (1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * 7.0 * k3))) / (1.0 + r * r)
    return factor, (rise - factor) / (r * r)


def _radial(r2: Scalars, dist: Distortion, fisheye: bool) -> tuple[Scalars, Scalars]:
    """Return the radial factor of a lens and its slope, (d factor / dr) / r."""
    if fisheye:
        return _fisheye_radial(r2, dist)
    k1, k2, _, _, k3 = dist[:5]
    factor = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3))
    if len(dist) == TERMS:
        return factor, slope
    k4, k5, k6 = dist[TERMS:]
    below = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6))
    below_slope = 2.0 * (k4 + r2 * (2.0 * k5 + r2 * 3.0 * k6))
    factor = factor / below
    return factor, (slope - factor * below_slope) / below


def distort(
    x: Scalars, y: Scalars, dist: Distortion, *, fisheye: bool = False
) -> tuple[Scalars, Scalars]:
    """Return the distorted normalised coordinates of (x, y) (OpenCV's models)."""
    p1, p2 = dist[2:4]
    r2 = x * x + y * y
    radial, _ = _radial(r2, dist, fisheye)
    xy2 = 2.0 * x * y
    xd = x * radial + p1 * xy2 + p2 * (r2 + 2.0 * x * x)
    yd = y * radial + p1 * (r2 + 2.0 * y * y) + p2 * xy2
    return xd, yd


def distort_jacobian(
    x: Scalars, y: Scalars, dist: Distortion, *, fisheye: bool = False
) -> tuple[Scalars, Scalars, Scalars, Scalars]:
    """Return d(xd)/dx, d(xd)/dy, d(yd)/dx, d(yd)/dy of `distort`."""
    p1, p2 = dist[2:4]
    r2 = x * x + y * y
    radial, slope = _radial(r2, dist, fisheye)
    cross = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
    xx = radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
    yy = radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
    return xx, cross, cross, yy


def _newton_step(
    x: Scalars, y: Scalars, xd: Scalars, yd: Scalars, dist: Distortion, *, fisheye: bool
) -> tuple[Scalars, Scalars]:
    """Return the Newton correction (dx, dy) towards distort(x, y) == (xd, yd)."""
    ex, ey = distort(x, y, dist, fisheye=fisheye)
    ex = xd - ex
    ey = yd - ey
    xx, xy, yx, yy = distort_jacobian(x, y, dist, fisheye=fisheye)
    det = xx * yy - xy * yx
    return (yy * ex - xy * ey) / det, (xx * ey - yx * ex) / det


@dataclass(frozen=True, slots=True, eq=False)
class CameraModel:
    """Intrinsics, distortion and pose of one camera at one resolution.

    `R_world_cam` is (3, 3) and `t_world_cam_m` (3,): p_world = R_world_cam p_cam + t_world_cam_m.
    """

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    dist: Distortion
    R_world_cam: Array
    t_world_cam_m: Array
    fisheye: bool = field(default=False, kw_only=True)
    # The pose again as plain floats: the scalar path runs for every frame.
    _r: tuple[float, ...] = field(init=False, repr=False)
    _t: tuple[float, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if len(self.dist) not in {TERMS, TERMS if self.fisheye else RATIONAL_TERMS}:
            raise ValueError(
                f"dist has {len(self.dist)} terms: {TERMS} (k1, k2, p1, p2, k3) are needed, or"
                f" {RATIONAL_TERMS} with k4, k5, k6 for a lens that is no fisheye"
            )
        rotation = np.array(self.R_world_cam, dtype=np.float64).reshape(3, 3)
        centre = np.array(self.t_world_cam_m, dtype=np.float64).reshape(3)
        if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6):
            raise ValueError("R_world_cam is not a rotation: R R' differs from 1 by more than 1e-6")
        rotation.setflags(write=False)
        centre.setflags(write=False)
        object.__setattr__(self, "R_world_cam", rotation)
        object.__setattr__(self, "t_world_cam_m", centre)
        object.__setattr__(self, "_r", tuple(map(float, rotation.ravel())))
        object.__setattr__(self, "_t", tuple(map(float, centre)))

    @property
    def rational(self) -> bool:
        """Whether the radial terms are a quotient, with k4, k5 and k6 below."""
        return len(self.dist) == RATIONAL_TERMS

    @property
    def K(self) -> Array:  # noqa: N802 - the name of the matrix everywhere
        """The camera matrix, (3, 3), px."""
        return np.array(
            [[self.fx_px, 0.0, self.cx_px], [0.0, self.fy_px, self.cy_px], [0.0, 0.0, 1.0]]
        )

    def scaled(self, width_px: int, height_px: int) -> CameraModel:
        """Return the same lens and pose read out at another resolution, cropped about the centre.

        The scale is that of the width; rows are cut or added evenly, as most sensors do between
        4:3 and 16:9.
        """
        scale = width_px / self.width_px
        rows_cut = 0.5 * (self.height_px * scale - height_px)
        return replace(
            self,
            width_px=width_px,
            height_px=height_px,
            fx_px=self.fx_px * scale,
            fy_px=self.fy_px * scale,
            cx_px=(self.cx_px + 0.5) * scale - 0.5,
            cy_px=(self.cy_px + 0.5) * scale - 0.5 - rows_cut,
        )

    def project(self, points_world_m: ArrayLike) -> Array:
        """Return pixels, (N, 2), of world points, (N, 3); NaN for points behind the camera."""
        points = np.asarray(points_world_m, dtype=np.float64).reshape(-1, 3)
        cam = (points - self.t_world_cam_m) @ self.R_world_cam
        z = np.where(cam[:, 2] > 0.0, cam[:, 2], np.nan)
        xd, yd = distort(cam[:, 0] / z, cam[:, 1] / z, self.dist, fisheye=self.fisheye)
        return np.stack((self.fx_px * xd + self.cx_px, self.fy_px * yd + self.cy_px), axis=1)

    def project_point(self, x_m: float, y_m: float, z_m: float) -> tuple[float, float]:
        """Return the pixel (u, v) of one world point; NaN when it lies behind the camera."""
        r, t = self._r, self._t
        dx, dy, dz = x_m - t[0], y_m - t[1], z_m - t[2]
        zc = r[2] * dx + r[5] * dy + r[8] * dz
        if zc <= 0.0:
            return math.nan, math.nan
        xc = (r[0] * dx + r[3] * dy + r[6] * dz) / zc
        yc = (r[1] * dx + r[4] * dy + r[7] * dz) / zc
        xd, yd = distort(xc, yc, self.dist, fisheye=self.fisheye)
        return self.fx_px * xd + self.cx_px, self.fy_px * yd + self.cy_px

    def normalise(self, px: ArrayLike) -> Array:
        """Return undistorted normalised coordinates, (N, 2), of pixels, (N, 2).

        NaN where the lens model has no inverse (far outside the image of a strong lens).
        """
        uv = np.asarray(px, dtype=np.float64).reshape(-1, 2)
        xd = (uv[:, 0] - self.cx_px) / self.fx_px
        yd = (uv[:, 1] - self.cy_px) / self.fy_px
        x, y = xd.copy(), yd.copy()
        step = np.zeros_like(x)
        for _ in range(NEWTON_STEPS_MAX):
            dx, dy = _newton_step(x, y, xd, yd, self.dist, fisheye=self.fisheye)
            x += dx
            y += dy
            step = np.abs(dx) + np.abs(dy)
            if np.all(step < NEWTON_TOLERANCE):
                break
        lost = ~(step < 1e-9)
        x[lost] = np.nan
        y[lost] = np.nan
        return np.stack((x, y), axis=1)

    def normalise_point(self, u_px: float, v_px: float) -> tuple[float, float]:
        """Return undistorted normalised coordinates of one pixel; NaN where there is no inverse."""
        xd = (u_px - self.cx_px) / self.fx_px
        yd = (v_px - self.cy_px) / self.fy_px
        x, y, dist = xd, yd, self.dist
        for _ in range(NEWTON_STEPS_MAX):
            dx, dy = _newton_step(x, y, xd, yd, dist, fisheye=self.fisheye)
            x += dx
            y += dy
            if abs(dx) + abs(dy) < NEWTON_TOLERANCE:
                return x, y
        return math.nan, math.nan

    def floor_points(self, px: ArrayLike, height_m: float = 0.0) -> Array:
        """Return world (X, Y), (N, 2), where the rays of pixels (N, 2) meet the plane z = height.

        NaN where a ray does not go down to the plane.
        """
        xy = self.normalise(px)
        rays = np.column_stack((xy, np.ones(len(xy)))) @ self.R_world_cam.T
        reach = (height_m - self.t_world_cam_m[2]) / rays[:, 2]
        reach = np.where(reach > 0.0, reach, np.nan)
        return self.t_world_cam_m[:2] + reach[:, None] * rays[:, :2]

    def floor_point(self, u_px: float, v_px: float, height_m: float = 0.0) -> tuple[float, float]:
        """Return world (X, Y) where the ray of one pixel meets the plane z = height, else NaN."""
        qx, qy = self.lean(u_px, v_px)
        drop = height_m - self._t[2]
        return self._t[0] + drop * qx, self._t[1] + drop * qy

    def lean(self, u_px: float, v_px: float) -> tuple[float, float]:
        """Return d(X, Y)/dz along the ray of a pixel: the floor error per metre of height error."""
        x, y = self.normalise_point(u_px, v_px)
        r = self._r
        dz = r[6] * x + r[7] * y + r[8]
        if not dz < 0.0:
            return math.nan, math.nan
        return (r[0] * x + r[1] * y + r[2]) / dz, (r[3] * x + r[4] * y + r[5]) / dz

    def floor_jacobian(self, u_px: float, v_px: float, height_m: float = 0.0) -> Array:
        """Return d(X, Y)/d(u, v), (2, 2), m/px, at one pixel on the plane z = height."""
        x, y = self.normalise_point(u_px, v_px)
        r = self._r
        dx, dy, dz = (r[i] * x + r[i + 1] * y + r[i + 2] for i in (0, 3, 6))
        drop = (height_m - self._t[2]) / (dz * dz)
        plane = drop * np.array(
            [
                [r[0] * dz - r[6] * dx, r[1] * dz - r[7] * dx],
                [r[3] * dz - r[6] * dy, r[4] * dz - r[7] * dy],
            ]
        )
        xx, xy, yx, yy = distort_jacobian(x, y, self.dist, fisheye=self.fisheye)
        det = xx * yy - xy * yx
        undistort = np.array(
            [[yy / self.fx_px, -xy / self.fy_px], [-yx / self.fx_px, xx / self.fy_px]]
        )
        jacobian: Array = plane @ undistort / det
        return jacobian

    def floor_covariance(
        self, u_px: float, v_px: float, height_m: float, sigma_px: float, sigma_height_m: float
    ) -> Array:
        """Return the covariance of (X, Y), (2, 2), m^2, for pixel noise and an uncertain height."""
        jacobian = self.floor_jacobian(u_px, v_px, height_m)
        lean = np.array(self.lean(u_px, v_px))
        noise: Array = sigma_px**2 * jacobian @ jacobian.T
        return noise + sigma_height_m**2 * np.outer(lean, lean)


def look_at(eye_m: ArrayLike, target_m: ArrayLike, up: ArrayLike = (0.0, 0.0, 1.0)) -> Array:
    """Return R_world_cam, (3, 3), of a camera at `eye_m` that looks at `target_m`.

    `up` appears upwards in the image. For a camera that looks along `up` (straight down) world +Y
    takes its place, so a ceiling camera shows the floor plan as drawn: X right, Y up.
    """
    forward = np.asarray(target_m, dtype=np.float64) - np.asarray(eye_m, dtype=np.float64)
    length = float(np.linalg.norm(forward))
    if length == 0.0:
        raise ValueError("look_at: eye and target are the same point")
    forward = forward / length
    right = np.cross(forward, np.asarray(up, dtype=np.float64))
    if np.linalg.norm(right) < 1e-6:
        right = np.cross(forward, (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    return np.stack((right, np.cross(forward, right), forward), axis=1)


def longest_px(camera: CameraModel, height_m: float, length_m: float) -> int:
    """Return how long a thing that lies at a height over the floor is in the image, at most."""
    width, height = camera.width_px, camera.height_px
    scales = [0.0]
    for u in (0.0, 0.5 * width, float(width)):
        for v in (0.0, 0.5 * height, float(height)):
            slope = camera.floor_jacobian(u, v, height_m)
            if np.isfinite(slope).all():
                scales.append(1.0 / float(np.linalg.norm(slope, -2)))
    return math.ceil(max(scales) * length_m)
