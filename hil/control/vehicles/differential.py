"""Differential drive: one driven wheel a side on one axle, and a castor behind it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.config.robot import DifferentialConfig
from hil.control.vehicles.vehicle import Contacts, TwoSided
from hil.core.registries import VEHICLES

if TYPE_CHECKING:
    from hil.config.robot import RobotConfig


@VEHICLES.register(
    "differential", settings=DifferentialConfig, summary="two driven wheels and a castor"
)
class Differential(TwoSided):
    """d0 is the distance of the axle from the centre of mass: its middle has no lateral speed."""

    def __init__(self, robot: RobotConfig) -> None:
        super().__init__(robot)
        vehicle = robot.vehicle
        assert isinstance(vehicle, DifferentialConfig)  # the registry gave this class for its kind
        self.contacts = Contacts(
            robot.d0_m, vehicle.castor_behind_m - robot.d0_m, vehicle.castor_friction_ratio
        )
