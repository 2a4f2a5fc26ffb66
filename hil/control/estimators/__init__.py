"""Estimators: delayed poses and wheel reports to the state at the actuation time; one registry."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.control.estimators.geometry import BelievedGeometry
from hil.core.errors import BadInput

if TYPE_CHECKING:
    from hil.config.control import EstimatorConfig
    from hil.core.types import Estimator

__all__ = ["ESTIMATORS", "BelievedGeometry", "make_estimator"]

ESTIMATORS = ("fused", "camera-only")


def make_estimator(name: str, config: EstimatorConfig, geometry: BelievedGeometry) -> Estimator:
    """Return the estimator `name` for a robot of the believed geometry."""
    if name == "fused":
        from hil.control.estimators.fused import Fused  # noqa: PLC0415 - load only the one in use

        return Fused(config, geometry)
    if name == "camera-only":
        from hil.control.estimators.camera_only import CameraOnly  # noqa: PLC0415 - needs the native core

        return CameraOnly(config, geometry)
    raise BadInput(f"estimator {name!r} is unknown; choose one of {', '.join(ESTIMATORS)}")
