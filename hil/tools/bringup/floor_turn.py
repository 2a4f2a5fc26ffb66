"""Whether this robot turns on this floor: on the spot, either way, and how much duty is in hand.

A skid-steered robot scrubs its tyres sideways to turn, which on a floor with grip takes most of what its
motors give. Counter-clockwise is positive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hil.tools.bringup.drive import BoardStopped, OpenLoop, duty_of, speed_rad_s
from hil.tools.bringup.result import Check

if TYPE_CHECKING:
    from hil.config.robot import RobotConfig
    from hil.wire.link import WheelReport

# From rest to full duty within what the board allows a wheel that stands (0.5 s above half duty).
_RAMP_S, _HOLD_S, _FALL_S, _WINDOW_S = 0.7, 0.7, 0.3, 0.15
# Both sides turn: more than play and tyres give.
_STARTED_RAD_S = 1.0
# A turn that wants more duty than this to begin fails when the battery sags or the floor varies.
START_DUTY_MAX = 0.75
NAMES = {1: "turn to the left", -1: "turn to the right"}


@dataclass(frozen=True, slots=True)
class FloorTurn:
    """One way: duty at which both sides turn (None: never), turn rate of the wheels at full duty."""

    start_duty: float | None
    rate_rad_s: float


def measure_turn(loop: OpenLoop, robot: RobotConfig, sign: int) -> FloorTurn:
    """Turn on the spot with a rising duty, then at full duty for a moment."""
    per_turn = robot.encoder_counts_per_turn
    start: list[float] = []

    def speeds(reports: list[WheelReport]) -> tuple[float, float]:
        left, right = (speed_rad_s(reports, i, per_turn, _WINDOW_S) for i in (0, 1))
        return -sign * left, sign * right

    def look(reports: list[WheelReport]) -> bool:
        if not start and len(reports) > 1 and min(speeds(reports)) >= _STARTED_RAD_S:
            start.append(max(abs(duty) for duty in duty_of(reports[-1], loop.pwm_top)))
        return False

    def duty(level: float) -> tuple[float, float]:
        return -sign * level, sign * level

    rate = 0.0
    try:
        with loop.armed():
            loop.drive(lambda t_s: duty(t_s / _RAMP_S), _RAMP_S, look)
            held = loop.drive(lambda _: duty(1.0), _HOLD_S, look)
            rate = sum(speeds(held)) * robot.wheel_radius_m / robot.track_m
            loop.drive(lambda t_s: duty(1.0 - t_s / _FALL_S), _FALL_S)
    except BoardStopped:
        return FloorTurn(None, 0.0)
    return FloorTurn(start[0] if start else None, rate)


def judge(sign: int, found: FloorTurn, needed_rad_s: float) -> Check:
    """Return the check of one way; `needed_rad_s` is the turn rate that the laws may ask for."""
    remedy = "a floor with less grip, a charged battery, stronger motors, less weight"
    if found.start_duty is None:
        text = "a side stands at full duty: this robot does not turn on this floor"
        return Check(NAMES[sign], "fail", text, remedy, "no_turn")
    text = (
        f"begins by {found.start_duty:.0%} duty (limit {START_DUTY_MAX:.0%}), "
        f"{math.degrees(found.rate_rad_s):.0f} deg/s at full duty (laws ask for up to "
        f"{math.degrees(needed_rad_s):.0f})"
    )
    if found.start_duty > START_DUTY_MAX or found.rate_rad_s < needed_rad_s:
        return Check(NAMES[sign], "fail", text, remedy, "weak_turn")
    return Check(NAMES[sign], "ok", text)
