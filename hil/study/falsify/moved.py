"""Requirements that tell where a task begins, moved along with a start or a point that was moved.

`turn_rad` and `start_offset_x_m` bound what the task's own geometry asks for: turned by half a radian at
the start a robot has half a radian less to turn, and no law is to blame for that. With its point beside it
a robot may turn the other way and arrive in reverse: both ways are then within the bounds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from hil.core.types import wrap_pi

Tree = Mapping[str, Any]
# A point further than this from straight ahead lies beside the robot.
BESIDE_RAD = 1.2


def turn_needed_rad(tree: Tree) -> float:
    """Return how far the task has the robot turn but for a constant: to face its point, or its path's end.

    Counter-clockwise is positive.
    """
    start, reference = tree["start"], tree["reference"]
    if reference["kind"] != "point":
        return -float(start["theta_rad"])
    bearing_rad = math.atan2(reference["y_m"] - start["y_m"], reference["x_m"] - start["x_m"])
    return bearing_rad - float(start["theta_rad"])


def start_offset_x_m(tree: Tree) -> float:
    """Return X of z1 - z1* before the robot moves, but for a constant where the reference is no point."""
    start, reference = tree["start"], tree["reference"]
    z1_m = start["x_m"] + tree["robot"]["d0_m"] * math.cos(start["theta_rad"])
    return float(z1_m - (reference["x_m"] if reference["kind"] == "point" else 0.0))


_MOVED: Mapping[str, tuple[Callable[[Tree], float], Callable[[float], float]]] = {
    "turn_rad": (turn_needed_rad, wrap_pi),
    "start_offset_x_m": (start_offset_x_m, float),
}


def moved_requirements(usual: Tree, changed: Tree) -> list[dict[str, Any]]:
    """Return the requirements of `usual` with their bounds moved as far as `changed` has moved its start."""
    return [_moved(dict(requirement), usual, changed) for requirement in usual["requirements"]]


def _moved(requirement: dict[str, Any], usual: Tree, changed: Tree) -> dict[str, Any]:
    if requirement["metric"] not in _MOVED:
        return requirement
    of, within = _MOVED[requirement["metric"]]
    away = within(of(changed) - of(usual))
    low, high = (away, away)
    if away and requirement["metric"] == "turn_rad" and changed["reference"]["kind"] == "point":
        ahead_rad = wrap_pi(turn_needed_rad(changed))
        if abs(ahead_rad) > BESIDE_RAD:  # half a turn less to the right is one to the left
            low, high = (low - math.pi, high) if ahead_rad > 0.0 else (low, high + math.pi)
    bounds = {
        side: round(requirement[side] + by, 4)
        for side, by in (("min", low), ("max", high))
        if by and requirement.get(side) is not None
    }
    return requirement | bounds
