"""Measuring and searching of colour marks, compiled from vision/native.

World axes and metres; pixels with (0, 0) at the centre of the first; images (H, W, 3) uint8 BGR.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Point = tuple[float, float]
Place = Sequence[float]
"""A place of one mark: x_m, y_m on the marks' plane, and what it loses in score."""

class Camera:
    """What vision.camera.CameraModel says: fx, fy, cx, cy; k1, k2, p1, p2, k3; R_world_cam row by row.

    `below` is k4, k5, k6 of a rational lens, zeros for another.
    """

    def __init__(
        self,
        lens: Sequence[float],
        distortion: Sequence[float],
        rotation: Sequence[float],
        centre_m: Sequence[float],
        fisheye: bool = False,
        below: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None: ...

class Disc:
    """One fitted disc, seen in the image."""

    @property
    def u_px(self) -> float:
        """Image of its centre, to the right."""

    @property
    def v_px(self) -> float:
        """Image of its centre, down."""

    @property
    def radius_px(self) -> float:
        """Radius that a disc of the known size has there."""

    @property
    def growth(self) -> float:
        """Its radius over the known one, less 1."""

    @property
    def share(self) -> float:
        """The part of its rim that was seen."""

    @property
    def residual_px(self) -> float:
        """RMS of the edges off the fit."""

    @property
    def covariance_px2(self) -> tuple[float, float, float]:
        """Claimed covariance of (u, v): uu, uv, vv."""

    @property
    def contrast_dn(self) -> float:
        """Colour response inside its rim."""

    @property
    def square(self) -> float:
        """How much of what its rim is off varies four times round, 0 to 1; a square has 0.7 and more."""

    @property
    def beyond(self) -> float:
        """The part of its rim over which its own colour goes on."""

    @property
    def hollow(self) -> float:
        """The part of its rim inside which its colour is not, though it is at the rim."""

    @property
    def ground_ratio(self) -> float:
        """Brightness beside it over its own."""

class RimFitter:
    """Fits both marks at their rims; `middle_px` is where a mark has its typical size."""

    def __init__(
        self,
        camera: Camera,
        radius_m: float,
        height_m: float,
        weights: Sequence[Sequence[float]],
        middle_px: Point,
    ) -> None: ...
    def fit(self, image: Image, centres_m: Sequence[Point]) -> tuple[Disc, Disc] | None:
        """Return both discs from guesses of their centres; None where one is not there."""
    def window(self, centre_m: Point, width: int, height: int) -> tuple[int, int, int, int] | None:
        """Return where in a picture a fit from such a guess mostly looks: left, top, right, bottom."""
    def fit_within(
        self,
        image: Image,
        centres_m: Sequence[Point],
        windows: Sequence[tuple[int, int, int, int]],
    ) -> tuple[tuple[Disc, Disc] | None, bool]:
        """Return what `fit` does, and whether it looked at a pixel outside of both windows."""

class Spot:
    """Where a mark is on its plane, and the covariance of that: xx, xy, yx, yy, m^2."""

    def __init__(self, at_m: Point, spread_m2: Sequence[float]) -> None: ...
    @property
    def at_m(self) -> Point:
        """Place on the plane of the marks, world axes."""

    @property
    def spread_m2(self) -> tuple[float, float, float, float]:
        """Covariance, row by row."""

def spot(camera: Camera, disc: Disc, height_m: float) -> Spot:
    """Return where a disc of that height is, with what it claims; NaN where no ray meets the plane."""

def gap_variance(one: Spot, other: Spot, length_m: float) -> float:
    """Return the variance of the distance of two spots `length_m` apart, m^2."""

def weighted_pose(
    body_m: tuple[Point, Point], one: Spot, other: Spot
) -> tuple[float, float, float, tuple[float, float, float, float, float, float], float]:
    """Return x_m, y_m, theta_rad, covariance (upper triangle) and weighted squares of `vision.pose_fit`."""

class MarkSearch:
    """Looks for marks in shrunk pictures; `hues` are their directions among the two chromas."""

    def __init__(
        self,
        camera: Camera,
        radius_m: float,
        height_m: float,
        distance_m: float,
        hues: Sequence[Sequence[float]],
    ) -> None: ...
    def places(
        self, image: Image, origin_px: Point, shrink: int
    ) -> tuple[list[Place], list[Place]]:
        """Return the places of both marks, least loss first.

        `origin_px` is where the picture's first pixel has its centre in the full one.
        """

    def pairs(self, front: Sequence[Place], rear: Sequence[Place]) -> list[tuple[Point, Point]]:
        """Return the likeliest pairs of centres about the robot's distance apart, best first."""
