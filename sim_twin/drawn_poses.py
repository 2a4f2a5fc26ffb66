"""`--camera pose`: the true pose with the rendered localiser's error statistics, and no image."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from random import Random
from typing import TYPE_CHECKING

from pydantic import Field

from hil.config.base import Section
from hil.core.files import parse_toml
from hil.core.types import Pose, PoseMeasurement
from sim_twin import _native
from sim_twin.link_model import state_of

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


@cache
def load_localiser_error() -> LocaliserError:
    """Return the statistics that ship with the twin."""
    text = (files("hil") / "data" / "localiser_error.toml").read_text(encoding="utf-8")
    return LocaliserError.model_validate(parse_toml(text, "localiser_error.toml"))


class DrawnPoses:
    """Draws one measurement per frame; the same for the same rng and poses (native/eye.hpp).

    `place_ratio` of the variance stands as long as the robot does (where the marks lie on the
    pixels): waves over floor and heading that are drawn first. The rest is new with each frame.
    """

    def __init__(self, error: LocaliserError, camera: CameraConfig, rng: Random) -> None:
        self.quality = error.quality_ratio
        # The localiser's claim never falls to zero: estimators weigh poses by it.
        self.sigma_xy_m = max(error.sigma_xy_m, 1e-5)
        self.sigma_theta_rad = max(error.sigma_theta_rad, 1e-5)
        marks = camera.marks
        self.native = _native.DrawnPoses(
            error=[getattr(error, name) for name in _native.LOCALISER_ERROR],
            # With the colours exchanged the localiser takes the rear mark for the front one: it sees
            # the robot turned round, displaced by the marks' offset from the centre of mass.
            swapped=marks.swapped_marks,
            shift_m=marks.front.x_m + marks.rear.x_m,
            chance=state_of(rng),
        )

    def measure(self, true_pose: PoseTuple | None) -> PoseMeasurement:
        """Return what the localiser might say; `true_pose` is (X, Y, theta), None when hidden."""
        if true_pose is None:
            return self.said(None, "hidden from the camera")
        return self.said(self.native.measure(*true_pose), "not seen (drawn)")

    def said(self, pose: PoseTuple | None, reason: str) -> PoseMeasurement:
        """Return a pose drawn as the localiser gives it, or that there is none for this reason."""
        if pose is None:
            return PoseMeasurement(None, 0.0, reason)
        return PoseMeasurement(
            Pose(*pose),
            self.quality,
            sigma_xy_m=self.sigma_xy_m,
            sigma_theta_rad=self.sigma_theta_rad,
        )
