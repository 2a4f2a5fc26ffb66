"""`--camera pose`: the true pose with the rendered localiser's error statistics, and no image."""

from __future__ import annotations

import math
import tomllib
from importlib.resources import files
from random import Random
from typing import TYPE_CHECKING

from pydantic import Field

from hil.config.base import Section
from hil.core.types import Pose, PoseMeasurement, wrap_pi

if TYPE_CHECKING:
    from hil.config.camera import CameraConfig

PoseTuple = tuple[float, float, float]


class LocaliserError(Section):
    """Statistics kept in `hil/data/localiser_error.toml`."""

    sigma_xy_m: float = Field(ge=0, le=0.1)
    sigma_theta_rad: float = Field(ge=0, le=1)
    not_seen_ratio: float = Field(ge=0, le=1)
    place_ratio: float = Field(ge=0, le=1)
    outlier_ratio: float = Field(ge=0, le=1)
    outlier_xy_m: float = Field(ge=0, le=1)
    outlier_theta_rad: float = Field(ge=0, le=3.2)
    quality_ratio: float = Field(ge=0, le=1)


def load_localiser_error() -> LocaliserError:
    """Return the statistics that ship with the twin."""
    text = (files("hil") / "data" / "localiser_error.toml").read_text(encoding="utf-8")
    return LocaliserError.model_validate(tomllib.loads(text))


# A bias that stands with the place: waves over the floor and the heading, so short that places a few
# pixels apart have each their own, so long that a robot at rest keeps its.
_WAVES = 12
_WAVE_LENGTHS_M = (0.01, 0.05)
_WAVES_PER_TURN = 12


class PlaceBias:
    """One number of mean 0 and deviation 1 over all poses, the same whenever the robot is there."""

    def __init__(self, rng: Random) -> None:
        self._waves = [self._draw(rng) for _ in range(_WAVES)]

    @staticmethod
    def _draw(rng: Random) -> tuple[float, float, int, float]:
        number = 2.0 * math.pi / rng.uniform(*_WAVE_LENGTHS_M)
        way = rng.uniform(-math.pi, math.pi)
        turns = rng.randint(-_WAVES_PER_TURN, _WAVES_PER_TURN)
        phase = rng.uniform(-math.pi, math.pi)
        return number * math.cos(way), number * math.sin(way), turns, phase

    def at(self, pose: PoseTuple) -> float:
        """Return the bias at a pose (X, Y in m, theta in rad)."""
        x_m, y_m, theta_rad = pose
        total = sum(math.sin(a * x_m + b * y_m + n * theta_rad + c) for a, b, n, c in self._waves)
        return total * math.sqrt(2.0 / _WAVES)


class DrawnPoses:
    """Draws one measurement per frame; the same for the same rng and poses.

    `place_ratio` of the variance stands as long as the robot does (where the marks lie on the
    pixels); the rest is new with each frame.
    """

    def __init__(self, error: LocaliserError, camera: CameraConfig, rng: Random) -> None:
        self._error = error
        self._rng = rng
        self._places = [PlaceBias(rng) for _ in range(3)]  # of X, Y and theta
        marks = camera.marks
        # With the colours exchanged the localiser takes the rear mark for the front one: it sees
        # the robot turned round, displaced by the marks' offset from the centre of mass.
        self._swapped = marks.swapped_marks
        self._shift_m = marks.front.x_m + marks.rear.x_m

    def measure(self, true_pose: PoseTuple | None) -> PoseMeasurement:
        """Return what the localiser might say; `true_pose` is (X, Y, theta), None when hidden."""
        error, rng = self._error, self._rng
        if true_pose is None:
            return PoseMeasurement(None, 0.0, "hidden from the camera")
        draw = rng.random()
        if draw < error.not_seen_ratio:
            return PoseMeasurement(None, 0.0, "not seen (drawn)")
        outlier = draw > 1.0 - error.outlier_ratio
        xy_m = error.outlier_xy_m if outlier else error.sigma_xy_m
        turn_rad = error.outlier_theta_rad if outlier else error.sigma_theta_rad
        x_m, y_m, theta_rad = self._as_marked(true_pose)
        stands, fresh = math.sqrt(error.place_ratio), math.sqrt(1.0 - error.place_ratio)
        x_off, y_off, turn_off = (
            stands * place.at(true_pose) + fresh * rng.gauss(0.0, 1.0) for place in self._places
        )
        pose = Pose(
            x_m + xy_m * x_off, y_m + xy_m * y_off, wrap_pi(theta_rad + turn_rad * turn_off)
        )
        # The localiser's claim never falls to zero: estimators weigh poses by it.
        return PoseMeasurement(
            pose,
            error.quality_ratio,
            sigma_xy_m=max(error.sigma_xy_m, 1e-5),
            sigma_theta_rad=max(error.sigma_theta_rad, 1e-5),
        )

    def _as_marked(self, pose: PoseTuple) -> PoseTuple:
        if not self._swapped:
            return pose
        x_m, y_m, theta_rad = pose
        return (
            x_m + self._shift_m * math.cos(theta_rad),
            y_m + self._shift_m * math.sin(theta_rad),
            theta_rad + math.pi,
        )
