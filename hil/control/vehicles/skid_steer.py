"""Skid steer: two driven wheels a side, which scrub over the floor in a turn."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.config.robot import SkidSteerConfig
from hil.control.vehicles.vehicle import Contacts, TwoSided
from hil.core.registries import VEHICLES

if TYPE_CHECKING:
    from hil.config.robot import RobotConfig


@VEHICLES.register(
    "skid-steer", settings=SkidSteerConfig, summary="two driven wheels a side (thesis 2.30)"
)
class SkidSteer(TwoSided):
    """The thesis's robot; d0 is where the scrub of front and rear wheels balances (2.31)."""

    def __init__(self, robot: RobotConfig) -> None:
        super().__init__(robot)
        assert robot.front_axle_m is not None  # the robot's section has seen to it
        assert robot.rear_axle_m is not None
        self.contacts = Contacts(robot.front_axle_m, robot.rear_axle_m)
