"""`--camera pose`: the true pose with the rendered localiser's error statistics, and no image."""

from __future__ import annotations

import math
from importlib.resources import files
from random import Random
from typing import TYPE_CHECKING

from pydantic import Field

from hil.config.base import Section
from hil.core.files import parse_toml
from hil.core.types import Pose, PoseMeasurement, wrap_pi

if TYPE_CHECKING:
    from hil.config.camera import CameraConfig

PoseTuple = tuple[float, float, float]


class LocaliserError(Section):
    """Statistics kept in `hil/data/localiser_error.toml`."""

    sigma_xy_m: float = Field(ge=0, le=0.1)
    sigma_theta_rad: float = Field(ge=0, le=1)
    not_seen_ratio: float = Field(ge=0, le=1)
    outlier_ratio: float = Field(ge=0, le=1)
    outlier_xy_m: float = Field(ge=0, le=1)
    outlier_theta_rad: float = Field(ge=0, le=3.2)
    quality_ratio: float = Field(ge=0, le=1)


def load_localiser_error() -> LocaliserError:
    """Return the statistics that ship with the twin."""
    text = (files("hil") / "data" / "localiser_error.toml").read_text(encoding="utf-8")
    return LocaliserError.model_validate(parse_toml(text, "localiser_error.toml"))


class DrawnPoses:
    """Draws one measurement per frame; the same for the same rng and poses."""

    def __init__(self, error: LocaliserError, camera: CameraConfig, rng: Random) -> None:
        self._error = error
        self._rng = rng
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
        pose = Pose(
            x_m + rng.gauss(0.0, xy_m), y_m + rng.gauss(0.0, xy_m),
            wrap_pi(theta_rad + rng.gauss(0.0, turn_rad)),
        )  # fmt: skip
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
