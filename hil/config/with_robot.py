"""What a robot's file may hold although it is the scenario's: board parameters and gains, as tuned."""

from __future__ import annotations

from typing import Any

from hil.core.errors import BadInput

_TABLES = ("board", "control")


def lifted(robot: dict[str, Any]) -> dict[str, Any]:
    """Take these tables out of a robot's tree and return them, to lie under the scenario's own."""
    return {name: robot.pop(name) for name in _TABLES if name in robot}


def refuse_all_but_gains(robot: dict[str, Any], where: str) -> None:
    """Raise BadInput where a robot's file says more of the control than its gains."""
    control = robot.get("control", {})
    other = [key for key in control if key != "gains"] if isinstance(control, dict) else ["?"]
    if other:
        raise BadInput(
            f"{where}: control.{other[0]}: a robot's file has gains (control.gains) and nothing else of "
            "the control; put it into the scenario"
        )
