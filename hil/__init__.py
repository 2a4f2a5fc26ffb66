"""A hardware-in-the-loop test harness for a small wheeled robot; what users of its Python API need.

Names are loaded when they are first used, so that `import hil` costs next to nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

# name -> (module, name there)
_NAMES = {
    "Estimate": ("hil.core.types", "Estimate"),
    "Estimator": ("hil.core.types", "Estimator"),
    "OuterCommand": ("hil.core.types", "OuterCommand"),
    "OuterLaw": ("hil.core.types", "OuterLaw"),
    "Pose": ("hil.core.types", "Pose"),
    "PoseMeasurement": ("hil.core.types", "PoseMeasurement"),
    "ReferenceState": ("hil.core.types", "ReferenceState"),
    "WheelSample": ("hil.core.types", "WheelSample"),
    "BadInput": ("hil.core.errors", "BadInput"),
    "RigFault": ("hil.core.errors", "RigFault"),
    "Section": ("hil.config.base", "Section"),
    "Scenario": ("hil.config.scenario", "Scenario"),
    "OuterLimits": ("hil.config.control", "OuterLimits"),
    "ReferenceConfig": ("hil.config.control", "ReferenceConfig"),
    "Contacts": ("hil.control.vehicles.vehicle", "Contacts"),
    "TwoSided": ("hil.control.vehicles.vehicle", "TwoSided"),
    "VehicleConfig": ("hil.config.robot", "VehicleConfig"),
    "serve_plant": ("sim_twin.plant_server", "serve"),
}
# decorator -> registry of hil.core.registries
_DECORATORS = {
    "outer_law": "OUTER_LAWS",
    "estimator": "ESTIMATORS",
    "localiser": "LOCALISERS",
    "reference": "REFERENCES",
    "vehicle": "VEHICLES",
}

__all__ = [
    "BadInput",
    "Contacts",
    "Estimate",
    "Estimator",
    "OuterCommand",
    "OuterLaw",
    "OuterLimits",
    "Pose",
    "PoseMeasurement",
    "ReferenceConfig",
    "ReferenceState",
    "RigFault",
    "Scenario",
    "Section",
    "TwoSided",
    "VehicleConfig",
    "WheelSample",
    "__version__",
    "estimator",
    "localiser",
    "outer_law",
    "reference",
    "serve_plant",
    "vehicle",
]

if TYPE_CHECKING:
    from hil.config.base import Section as Section
    from hil.config.control import OuterLimits as OuterLimits
    from hil.config.control import ReferenceConfig as ReferenceConfig
    from hil.config.robot import VehicleConfig as VehicleConfig
    from hil.config.scenario import Scenario as Scenario
    from hil.control.vehicles.vehicle import Contacts as Contacts
    from hil.control.vehicles.vehicle import TwoSided as TwoSided
    from hil.core.errors import BadInput as BadInput
    from hil.core.errors import RigFault as RigFault
    from hil.core.registries import ESTIMATORS, LOCALISERS, OUTER_LAWS, REFERENCES, VEHICLES
    from hil.core.types import Estimate as Estimate
    from hil.core.types import Estimator as Estimator
    from hil.core.types import OuterCommand as OuterCommand
    from hil.core.types import OuterLaw as OuterLaw
    from hil.core.types import Pose as Pose
    from hil.core.types import PoseMeasurement as PoseMeasurement
    from hil.core.types import ReferenceState as ReferenceState
    from hil.core.types import WheelSample as WheelSample
    from sim_twin.plant_server import serve as serve_plant

    outer_law = OUTER_LAWS.register
    estimator = ESTIMATORS.register
    localiser = LOCALISERS.register
    reference = REFERENCES.register
    vehicle = VEHICLES.register


def __getattr__(name: str) -> Any:
    """Load a name of the API."""
    if name in _DECORATORS:
        registries = importlib.import_module("hil.core.registries")
        value: Any = getattr(registries, _DECORATORS[name]).register
    elif name in _NAMES:
        module, there = _NAMES[name]
        value = getattr(importlib.import_module(module), there)
    else:
        raise AttributeError(f"module 'hil' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the names of the API."""
    return sorted(__all__)
