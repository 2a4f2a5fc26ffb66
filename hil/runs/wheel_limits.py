"""Which side of the robot stands at the board's limit, from what the board reports, and what that cost.

A side is at its limit when the duty it reports is the most that PWM_MAX lets it give, in the direction of the
speed it lacks. (left, right); positive is forward.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hil.core.types import Vec2
    from hil.wire.link import WheelReport

SIDES = ("left", "right")
# Of the most duty; the rest is rounding to counts.
_AT_LIMIT_RATIO = 0.98
# A turn that is wanted and not made: said of a run where it held for so long, and for this share of it.
_ASKED_RAD_S, _MADE_RATIO, _TOLD_S, _TOLD_RATIO = 0.5, 0.5, 0.4, 0.2


class WheelLimits:
    """Judges every tick's report; `verdict` says at the end what the motors did not give."""

    def __init__(self) -> None:
        self._ran_s = 0.0
        self._short_s = 0.0
        self._side_s = [0.0, 0.0]
        self._asked_rad = self._made_rad = 0.0

    @staticmethod
    def sides(report: WheelReport | None, asked_rad_s: Vec2, most_counts: float) -> tuple[int, int]:
        """Return 1 (forward) or -1 (backward) for a side at its limit that lacks speed, else 0."""
        if report is None or most_counts <= 0.0:
            return (0, 0)
        wire = report.wire
        left = _side(wire.pwm_left_counts, asked_rad_s[0] - wire.omega_left_rad_s, most_counts)
        right = _side(wire.pwm_right_counts, asked_rad_s[1] - wire.omega_right_rad_s, most_counts)
        return (left, right)

    @staticmethod
    def driven_hard(report: WheelReport | None, stall_counts: float) -> bool:
        """Say whether a side is driven with what the board would call a stall if its wheel stood."""
        if report is None:
            return False
        wire = report.wire
        most = max(abs(wire.pwm_left_counts), abs(wire.pwm_right_counts))
        return bool(most >= stall_counts > 0.0)

    def take(
        self, sides: tuple[int, int], asked_rad_s: float, made_rad_s: float, dt_s: float
    ) -> None:
        """Take one tick: sides at their limit, turn rate asked and made."""
        self._ran_s += dt_s
        for index, side in enumerate(sides):
            self._side_s[index] += dt_s * abs(side)
        made = made_rad_s if asked_rad_s > 0.0 else -made_rad_s
        if (
            sides != (0, 0)
            and abs(asked_rad_s) >= _ASKED_RAD_S
            and made < _MADE_RATIO * abs(asked_rad_s)
        ):
            self._short_s += dt_s
            self._asked_rad += abs(asked_rad_s) * dt_s
            self._made_rad += made * dt_s

    def verdict(self) -> str:
        """Return what a reader must know, "" where the motors gave what the turns needed."""
        if self._short_s < max(_TOLD_S, _TOLD_RATIO * self._ran_s):
            return ""
        worst = 0 if self._side_s[0] > self._side_s[1] else 1
        return (
            f"the turn needs more torque than the motors give: {SIDES[worst]} side at its limit "
            f"{self._side_s[worst] / self._ran_s:.0%} of the run, {self._made_rad / self._short_s:.2g} of "
            f"{self._asked_rad / self._short_s:.2g} rad/s made for {self._short_s:.1f} s; a floor with less "
            "grip, stronger motors, a charged battery, or less weight"
        )


def _side(pwm_counts: float, lacks_rad_s: float, most_counts: float) -> int:
    if abs(pwm_counts) < _AT_LIMIT_RATIO * most_counts or pwm_counts * lacks_rad_s <= 0.0:
        return 0
    return 1 if pwm_counts > 0.0 else -1
