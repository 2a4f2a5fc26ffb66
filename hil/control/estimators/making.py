"""An estimator made ready for a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.config.control import ControlConfig, EstimatorConfig
from hil.control.estimators.completed import completed
from hil.core.registries import ESTIMATORS

if TYPE_CHECKING:
    from hil.control.estimators.geometry import BelievedGeometry
    from hil.core.types import Estimator


def make_estimator(
    name: str, config: ControlConfig | EstimatorConfig, geometry: BelievedGeometry
) -> Estimator:
    """Return the estimator `name` for a robot of the believed geometry; raises BadInput.

    It is given what every estimator assumes and the geometry; one with settings of its own gets them
    too: those of the outer loop where that is given, else their defaults.
    """
    entry = ESTIMATORS.get(name)
    fusion = config if isinstance(config, EstimatorConfig) else config.fusion
    own = config.own_settings_of(entry) if isinstance(config, ControlConfig) else None
    if entry.settings is not None and own is None:
        own = entry.settings()
    given = (fusion, geometry) if own is None else (fusion, geometry, own)
    made: Estimator = completed(entry.factory(*given))
    return made
