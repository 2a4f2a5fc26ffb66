"""A hardware-in-the-loop test harness for a small wheeled robot; what users of its Python API need.

Names are loaded when they are first used, so that `import hil` costs next to nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

# name -> (module, name there)
_NAMES = {
    "CommandBatch": ("hil.core.batch", "CommandBatch"),
    "Estimate": ("hil.core.types", "Estimate"),
    "EstimateBatch": ("hil.core.batch", "EstimateBatch"),
    "Estimator": ("hil.core.types", "Estimator"),
    "Localiser": ("vision.tracker", "Localiser"),
    "OuterCommand": ("hil.core.types", "OuterCommand"),
    "OuterLaw": ("hil.core.types", "OuterLaw"),
    "Pose": ("hil.core.types", "Pose"),
    "PoseMeasurement": ("hil.core.types", "PoseMeasurement"),
    "Reference": ("hil.control.references", "Reference"),
    "ReferenceBatch": ("hil.core.batch", "ReferenceBatch"),
    "ReferenceState": ("hil.core.types", "ReferenceState"),
    "WheelSample": ("hil.core.types", "WheelSample"),
    "BadInput": ("hil.core.errors", "BadInput"),
    "RigFault": ("hil.core.errors", "RigFault"),
    "Section": ("hil.config.base", "Section"),
    "quantity": ("hil.config.base", "quantity"),
    "check_estimator": ("hil.tools.conformance", "check_estimator"),
    "check_law": ("hil.tools.conformance", "check_law"),
    "check_localiser": ("hil.tools.conformance", "check_localiser"),
    "check_robot": ("hil.tools.conformance", "check_robot"),
    "Scenario": ("hil.config.scenario", "Scenario"),
    "BelievedGeometry": ("hil.control.estimators.geometry", "BelievedGeometry"),
    "CameraConfig": ("hil.config.camera", "CameraConfig"),
    "EstimatorConfig": ("hil.config.control", "EstimatorConfig"),
    "camera_model": ("vision.camera_setup", "camera_model"),
    "OuterLimits": ("hil.config.control", "OuterLimits"),
    "ReferenceConfig": ("hil.config.control", "ReferenceConfig"),
    "Comparison": ("hil.api", "Comparison"),
    "Experiment": ("hil.api", "Experiment"),
    "Run": ("hil.api", "Run"),
    "compare": ("hil.api", "compare"),
    "experiment": ("hil.api", "experiment"),
    "load_scenario": ("hil.api", "load_scenario"),
    "make_env": ("hil.api", "make_env"),
    "open_record": ("hil.api", "open_record"),
    "replay": ("hil.api", "replay"),
    "run": ("hil.api", "run"),
    "Contacts": ("hil.control.vehicles.vehicle", "Contacts"),
    "TwoSided": ("hil.control.vehicles.vehicle", "TwoSided"),
    "VehicleConfig": ("hil.config.robot", "VehicleConfig"),
    "RunData": ("hil.analysis.metrics", "RunData"),
    "check_cost": ("hil.tools.conformance", "check_cost"),
    "check_figure": ("hil.tools.conformance", "check_figure"),
    "figure": ("hil.core.figures", "figure"),
    "tuning_cost": ("hil.core.figures", "tuning_cost"),
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
    "BelievedGeometry",
    "CameraConfig",
    "CommandBatch",
    "Comparison",
    "Contacts",
    "Estimate",
    "EstimateBatch",
    "Estimator",
    "EstimatorConfig",
    "Experiment",
    "Localiser",
    "OuterCommand",
    "OuterLaw",
    "OuterLimits",
    "Pose",
    "PoseMeasurement",
    "Reference",
    "ReferenceBatch",
    "ReferenceConfig",
    "ReferenceState",
    "RigFault",
    "Run",
    "RunData",
    "Scenario",
    "Section",
    "TwoSided",
    "VehicleConfig",
    "WheelSample",
    "__version__",
    "camera_model",
    "check_cost",
    "check_estimator",
    "check_figure",
    "check_law",
    "check_localiser",
    "check_robot",
    "compare",
    "estimator",
    "experiment",
    "figure",
    "load_scenario",
    "localiser",
    "make_env",
    "open_record",
    "outer_law",
    "quantity",
    "reference",
    "replay",
    "run",
    "serve_plant",
    "tuning_cost",
    "vehicle",
]

if TYPE_CHECKING:
    from hil.analysis.metrics import RunData as RunData
    from hil.api import Comparison as Comparison
    from hil.api import Experiment as Experiment
    from hil.api import Run as Run
    from hil.api import compare as compare
    from hil.api import experiment as experiment
    from hil.api import load_scenario as load_scenario
    from hil.api import make_env as make_env
    from hil.api import open_record as open_record
    from hil.api import replay as replay
    from hil.api import run as run
    from hil.config.base import Section as Section
    from hil.config.base import quantity as quantity
    from hil.config.camera import CameraConfig as CameraConfig
    from hil.config.control import EstimatorConfig as EstimatorConfig
    from hil.config.control import OuterLimits as OuterLimits
    from hil.config.control import ReferenceConfig as ReferenceConfig
    from hil.config.robot import VehicleConfig as VehicleConfig
    from hil.config.scenario import Scenario as Scenario
    from hil.control.estimators.geometry import BelievedGeometry as BelievedGeometry
    from hil.control.references import Reference as Reference
    from hil.control.vehicles.vehicle import Contacts as Contacts
    from hil.control.vehicles.vehicle import TwoSided as TwoSided
    from hil.core.batch import CommandBatch as CommandBatch
    from hil.core.batch import EstimateBatch as EstimateBatch
    from hil.core.batch import ReferenceBatch as ReferenceBatch
    from hil.core.errors import BadInput as BadInput
    from hil.core.errors import RigFault as RigFault
    from hil.core.figures import figure as figure
    from hil.core.figures import tuning_cost as tuning_cost
    from hil.core.registries import ESTIMATORS, LOCALISERS, OUTER_LAWS, REFERENCES, VEHICLES
    from hil.core.types import Estimate as Estimate
    from hil.core.types import Estimator as Estimator
    from hil.core.types import OuterCommand as OuterCommand
    from hil.core.types import OuterLaw as OuterLaw
    from hil.core.types import Pose as Pose
    from hil.core.types import PoseMeasurement as PoseMeasurement
    from hil.core.types import ReferenceState as ReferenceState
    from hil.core.types import WheelSample as WheelSample
    from hil.tools.conformance import check_cost as check_cost
    from hil.tools.conformance import check_estimator as check_estimator
    from hil.tools.conformance import check_figure as check_figure
    from hil.tools.conformance import check_law as check_law
    from hil.tools.conformance import check_localiser as check_localiser
    from hil.tools.conformance import check_robot as check_robot
    from sim_twin.plant_server import serve as serve_plant
    from vision.camera_setup import camera_model as camera_model
    from vision.tracker import Localiser as Localiser

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
