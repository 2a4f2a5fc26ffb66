"""What a log does not tell, and which manoeuvre would."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hil.study.log_fit.estimate import Estimate

_STRAIGHT = "drive straight, 1 m or more, forward and back, at two speeds, with poses logged"
_SPIN = "turn on the spot, two whole turns to each side, at two rates, with poses logged"
_STEPS = "eight steps of forward speed from rest and back to 0, 1.5 s each, commands logged as sent"
_TURN_STEPS = "eight steps of turn rate from rest and back to 0, 1.5 s each, to both sides"
_RAMP = (
    "a slow ramp of the command from 0 until it moves and back, or `hil bringup`, dead zone step"
)
_BOTH = "an eight: arcs to both sides at a speed and rate that are both well above the dead zone"

MANOEUVRES = {
    "distance_scale_ratio": _STRAIGHT,
    "turn_scale_ratio": _SPIN,
    "veer_rad_m": _STRAIGHT,
    "forward_lag_s": _STEPS,
    "turn_lag_s": _TURN_STEPS,
    "dead_time_s": _STEPS,
    "forward_dead_zone_m_s": _RAMP,
    "turn_dead_zone_rad_s": _RAMP,
    "pose_ahead_m": _SPIN,
    "pose_left_m": _SPIN,
    "heading_offset_rad": _STRAIGHT,
    "pose_delay_s": _BOTH,
    "wheel_scale_left_ratio": "log wheel speeds during steps of either side, or `hil bringup`",
    "wheel_scale_right_ratio": "log wheel speeds during steps of either side, or `hil bringup`",
    "wheel_lag_s": "steps of wheel speed from rest, 1 s each, both sides",
    "wheel_dead_time_s": "steps of wheel speed from rest, 1 s each, both sides",
    "wheel_dead_zone_rad_s": _RAMP,
    "motor_constant_ratio": "`hil bringup`, top speed step, or full voltage on the floor for 1 s",
    "motor_friction_ratio": "a slow ramp of duty from 0 until it drives, or `hil bringup`, dead zone",
    "floor_friction_ratio": "turn on the spot at several duties, PWM and wheel speeds logged",
    "mass_ratio": "steps of duty from rest, straight, 1 s each, PWM and wheel speeds at 50 Hz",
    "inertia_ratio": "steps of duty from rest, on the spot, 1 s each, PWM and wheel speeds at 50 Hz",
    "wheel_speed_delay_s": "steps of duty from rest, PWM and wheel speeds on one clock",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Advice:
    """A manoeuvre, and what it would tell that the log does not."""

    manoeuvre: str
    tells: tuple[str, ...]

    def text(self) -> str:
        """Return the advice in one line."""
        return f"{', '.join(self.tells)}: {self.manoeuvre}"


def advise(estimates: Iterable[tuple[str, Estimate]], missing: Iterable[str]) -> list[Advice]:
    """Return a manoeuvre for each thing that is not told, those that share one together.

    `estimates` are (layer, estimate); `missing` are signals that the log does not have at all.
    """
    wanted: dict[str, list[str]] = {}
    for layer, item in estimates:
        if not item.told:
            wanted.setdefault(MANOEUVRES.get(item.name, _BOTH), []).append(f"{layer} {item.name}")
    found = [Advice(manoeuvre, tuple(names)) for manoeuvre, names in wanted.items()]
    return [*found, *(Advice(_LOGGED[name][1], (_LOGGED[name][0],)) for name in missing)]


_LOGGED = {
    "poses": ("scales of distance and turn", "log poses of a camera or of motion capture beside it"),
    "wheel speeds": ("wheel radius, track, lag of the wheels",
                     "log wheel speeds (encoders) on the same clock"),
    "voltages": ("motor constants, mass and inertia",
                 "log PWM and battery voltage, or motor voltages, beside wheel speeds"),
    "commands": ("lag, dead time, dead zones", "log the commands as they are sent"),
}  # fmt: skip
