"""Limits of the figures, and what each check says of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hil.core.wording import past
from hil.tools.bringup.measure import SLOW_DUTY, Range
from hil.tools.bringup.result import SIDES, Check, Side

# A gear that needs more than this to start is stiff, or the battery is not connected to the bridge:
# the thesis's class of motor starts at 10 to 20 %.
DEAD_DUTY_MAX = 0.35
# Sides that differ by more than this are not two equal sides: a motor out of two, a dragging wheel.
TOP_SPEED_SPREAD_MAX = 0.15
# What a person counts over ten turns is good to a twentieth of a turn; the rest is a wrong file.
COUNTS_ERROR_MAX = 0.01
# A divider that is not connected reads next to nothing, and USB alone never above this.
_USB_V = 5.5


def identity(info: Any) -> Check:
    """Return the check of who the board is; that it speaks the dialect is known by now."""
    text = (
        f"firmware {info.build_id}, dialect {info.dialect_hash:08x}, "
        f"tick {info.tick_us} us, PWM to {info.pwm_top_counts}"
    )
    return Check("board", "ok", text)


def battery(volts: float, parameters: Mapping[str, float]) -> Check:
    """Return the check of the battery against the board's own limit and hysteresis."""
    low_v = parameters["BATT_LOW"]
    needed_v = low_v + parameters["BATT_HYST"]
    if low_v == 0.0:
        return Check("battery", "note", f"{volts:.1f} V; the board's check is off (BATT_LOW = 0)")
    text = f"{past(volts, needed_v, '.1f')} V (at least {needed_v:g} V; the board stops at {low_v:g} V)"
    if volts >= needed_v:
        return Check("battery", "ok", text)
    if not volts > _USB_V:
        remedy = "switch the battery on; see the divider at A0 (docs/wiring.md)"
        return Check("battery", "fail", text, remedy, "no_battery")
    return Check("battery", "fail", text, "charge or change it", "battery_low")


def dead_zone(sound: Sequence[Side], ahead: Range, back: Range) -> list[Check]:
    """Return a check a side: the duty at which its free wheels start, both ways."""
    checks = []
    for side in sound:
        forward, backward = (way.dead_duty[SIDES.index(side)] for way in (ahead, back))
        name = f"{side} dead zone"
        if forward is None or backward is None:
            text = f"does not start both ways up to {SLOW_DUTY:.0%} duty"
            checks.append(Check(name, "fail", text, "free the gear; check the leads", "stiff"))
            continue
        ahead_text, back_text = (past(duty, DEAD_DUTY_MAX, ".1%") for duty in (forward, backward))
        text = f"starts at {ahead_text} duty forward, {back_text} backward"
        text += f" (limit {DEAD_DUTY_MAX:.0%})"
        if max(forward, backward) > DEAD_DUTY_MAX:
            checks.append(Check(name, "fail", text, "free the gear; charge the battery", "stiff"))
        else:
            checks.append(Check(name, "ok", text))
    return checks


def top_speed(
    sound: Sequence[Side],
    ahead: Range,
    back: Range,
    needed_rad_s: float,
    over_rad_s: float,
) -> list[Check]:
    """Return a check a side, one of both sides together, and a note on the overspeed limit."""
    checks = []
    for side in sound:
        forward, backward = (way.top_speed_rad_s[SIDES.index(side)] or 0.0 for way in (ahead, back))
        ahead_text, back_text = (past(speed, needed_rad_s, ".1f") for speed in (forward, backward))
        text = f"{ahead_text} rad/s forward, {back_text} backward"
        text += f" (at least {needed_rad_s:.3g}, on the floor less)"
        if min(forward, backward) < needed_rad_s:
            remedy = "another gear, a fuller battery, or lower control.limits in the scenario"
            checks.append(Check(f"{side} top speed", "fail", text, remedy, "slow"))
        else:
            checks.append(Check(f"{side} top speed", "ok", text))
    both = [speed for way in (ahead, back) for speed in way.top_speed_rad_s]
    if all(both) and len(sound) == len(SIDES):
        checks += _balance([speed or 0.0 for speed in both], over_rad_s)
    return checks


def _balance(speeds: list[float], over_rad_s: float) -> list[Check]:
    checks = []
    spread = max(abs(speeds[i] - speeds[i + 1]) / max(speeds[i : i + 2]) for i in (0, 2))
    if spread > TOP_SPEED_SPREAD_MAX:
        shown = past(spread, TOP_SPEED_SPREAD_MAX, ".0%")
        text = f"left and right differ by {shown} (limit {TOP_SPEED_SPREAD_MAX:.0%})"
        remedy = "the slower side: a dragging wheel, one motor of two without current"
        checks.append(Check("balance", "fail", text, remedy, "uneven"))
    if max(speeds) > 0.9 * over_rad_s:
        text = f"free wheels come near OVER_W = {over_rad_s:g} rad/s, which stops the robot"
        checks.append(Check("overspeed", "note", text))
    return checks


def counts_per_turn(side: Side, counts: int, turned: float, believed: int) -> Check:
    """Return the check of a person's count of turns against the encoder's counts."""
    found = counts / turned
    text = f"{counts} counts in {turned:g} turns: {found:.0f} a turn (robot file {believed})"
    if abs(found / believed - 1.0) > COUNTS_ERROR_MAX:
        remedy = "use the measured robot file in the scenario"
        return Check(f"{side} counts per turn", "fail", text, remedy, "counts_per_turn")
    return Check(f"{side} counts per turn", "ok", text)
