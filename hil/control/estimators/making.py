"""An estimator made ready for a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.core.registries import ESTIMATORS

if TYPE_CHECKING:
    from hil.config.control import EstimatorConfig
    from hil.control.estimators.geometry import BelievedGeometry
    from hil.core.types import Estimator


def make_estimator(name: str, config: EstimatorConfig, geometry: BelievedGeometry) -> Estimator:
    """Return the estimator `name` for a robot of the believed geometry; raises BadInput."""
    made: Estimator = ESTIMATORS.get(name).factory(config, geometry)
    return made
