"""The robot as it really is on a simulated target: the believed one with the scenario's mismatch."""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING, Any

from hil.config.load import build
from hil.config.robot import RobotConfig
from hil.core.errors import BadInput
from hil.core.newest import of_newest

if TYPE_CHECKING:
    from hil.config.scenario import Scenario


@of_newest
def true_robot(scenario: Scenario) -> RobotConfig:
    """Return the robot as it really is: the believed one with the scenario's mismatch applied.

    Raises BadInput for a key that is no number of the robot.
    """
    if not scenario.mismatch:
        return scenario.robot
    tree = scenario.robot.model_dump()
    for key, ratio in scenario.mismatch.items():
        *path, leaf = key.split(".")
        try:
            table: dict[str, Any] = reduce(lambda node, part: node[part], path, tree)
            table[leaf] = float(table[leaf]) * ratio
        except (KeyError, TypeError, ValueError):
            raise BadInput(f"mismatch.{key}: not a number of the robot's file") from None
    return build(RobotConfig, tree, "mismatch")
