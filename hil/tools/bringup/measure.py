"""Figures of free wheels: which counters move, dead zone, top speed, counts a turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from hil.tools.bringup.drive import STALL_DUTY, OpenLoop, counts, duty_of, speed_rad_s
from hil.tools.bringup.result import SIDES, Side
from hil.tools.bringup.wiring import Moved
from hil.wire.link import WheelReport

# Slow drives end here: a wheel that does not turn by now is stuck, and the board's stall check
# (STALL_DUTY) is not to be the one that finds it.
SLOW_DUTY = 0.9 * STALL_DUTY
# An eighth of a turn of the thesis's encoder: enough to be seen, and no noise.
_LOOK_COUNTS = 240
_LOOK_RATE_1_S = 0.25
_LOOK_S = 3.5
_LOOK_HOLD_S = 1.0
# The dead zone is read off a slow ramp: 0.1 s of it is half a percent of duty.
_RAMP_1_S = 0.05
_START_RAD_S = 0.3
_START_WINDOW_S = 0.1
_RISE_S, _HOLD_S, _FALL_S = 0.5, 1.8, 0.4
_TOP_WINDOW_S = 1.0
_TURN_DUTY = 0.4
_TURN_TIMEOUT_S = 60.0


def look(loop: OpenLoop, side: Side) -> Moved:
    """Drive one side slowly forward until its counts move, or to SLOW_DUTY; return what moved."""
    index = SIDES.index(side)

    def duty(level: float) -> tuple[float, float]:
        return (level, 0.0) if index == 0 else (0.0, level)

    start = [loop.fresh()]

    def moves(reports: list[WheelReport]) -> bool:
        return max(_spread(start + reports, i)[0] for i in (0, 1)) >= _LOOK_COUNTS

    with loop.armed():
        ramp = loop.drive(lambda t_s: duty(min(_LOOK_RATE_1_S * t_s, SLOW_DUTY)), _LOOK_S, moves)
        level = duty_of(ramp[-1], loop.pwm_top)[index]
        ramp += loop.drive(lambda _: duty(level), _LOOK_HOLD_S)
    reports = start + ramp
    own, across = _spread(reports, index), _spread(reports, 1 - index)
    return Moved(own[1], across[1], own[2], across[2])


def _spread(reports: list[WheelReport], side: int) -> tuple[int, int, int]:
    """Return (range, net, flickers) of a counter; flickers are changes that led nowhere."""
    values = [counts(report)[side] for report in reports]
    spread = max(values) - min(values)
    changes = sum(a != b for a, b in pairwise(values))
    return spread, values[-1] - values[0], changes if spread <= 2 else 0


@dataclass(frozen=True, slots=True)
class Range:
    """Magnitudes one way, (left, right), None for a side that was left out or never started."""

    dead_duty: tuple[float | None, float | None]
    top_speed_rad_s: tuple[float | None, float | None]
    battery_v: float


def sweep(loop: OpenLoop, sides: Sequence[Side], sign: int, counts_per_turn: float) -> Range:
    """Ramp the sides up until each has started, then hold full duty; `sign` -1 is backward."""
    use = [i for i, name in enumerate(SIDES) if name in sides]
    started: dict[int, float] = {}

    def duty(level: float) -> tuple[float, float]:
        return tuple(sign * level if i in use else 0.0 for i in (0, 1))  # type: ignore[return-value]

    def all_started(reports: list[WheelReport]) -> bool:
        for i in use:
            if i not in started and _has_started(reports, i, counts_per_turn):
                started[i] = abs(_duty_before(reports, loop.pwm_top)[i])
        return len(started) == len(use)

    top: list[float | None] = [None, None]
    with loop.armed():
        ramp = loop.drive(lambda t_s: duty(_RAMP_1_S * t_s), SLOW_DUTY / _RAMP_1_S, all_started)
        use = [i for i in use if i in started]  # a wheel that stands is not pushed any harder
        low = abs(max(duty_of(ramp[-1], loop.pwm_top), key=abs))
        loop.drive(lambda t_s: duty(low + (1.0 - low) * t_s / _RISE_S), _RISE_S)
        hold = loop.drive(lambda _: duty(1.0), _HOLD_S)
        for i in use:
            top[i] = abs(speed_rad_s(hold, i, counts_per_turn, _TOP_WINDOW_S))
        battery_v = loop.battery_v
        loop.drive(lambda t_s: duty(1.0 - t_s / _FALL_S), _FALL_S)
    return Range((started.get(0), started.get(1)), (top[0], top[1]), battery_v)


def _has_started(reports: list[WheelReport], side: int, counts_per_turn: float) -> bool:
    if len(reports) < 2:
        return False
    return abs(speed_rad_s(reports, side, counts_per_turn, _START_WINDOW_S)) >= _START_RAD_S


def _duty_before(reports: list[WheelReport], pwm_top: int) -> tuple[float, float]:
    """Return the duty at the begin of the window over which the speed was taken."""
    last = reports[-1].wire.t_mcu_us
    for report in reversed(reports):
        if ((last - report.wire.t_mcu_us) & 0xFFFF_FFFF) * 1e-6 >= _START_WINDOW_S:
            return duty_of(report, pwm_top)
    return duty_of(reports[0], pwm_top)


def turn(loop: OpenLoop, side: Side, turns: float, counts_per_turn: float) -> int:
    """Drive one side forward for `turns` as believed; return the counts from rest to rest."""
    index = SIDES.index(side)
    duty = (_TURN_DUTY, 0.0) if index == 0 else (0.0, _TURN_DUTY)
    begin = counts(loop.fresh())[index]

    def there(reports: list[WheelReport]) -> bool:
        return bool(reports) and abs(counts(reports[-1])[index] - begin) >= turns * counts_per_turn

    with loop.armed():
        loop.drive(lambda _: duty, _TURN_TIMEOUT_S, there)
    return counts(loop.fresh())[index] - begin
