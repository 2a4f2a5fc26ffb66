"""The bring-up itself: link, identity, battery, wiring, dead zone, top speed, counts a turn.

Order matters: wheels are driven only over a good link and on a good battery, each side alone before
both together, slowly before fast; a side that failed is not driven any further. The wheels are off
whenever a person is asked something or a line is printed, and at the end, whatever ends it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from hil.config.control import OuterLimits
from hil.core.errors import RigFault
from hil.tools.bringup import floor_turn, measure, verdicts, wiring
from hil.tools.bringup.drive import BoardStopped, OpenLoop
from hil.tools.bringup.link_check import check_link
from hil.tools.bringup.result import SIDES, Check, Measured, Report, Side
from hil.wire import handshake as board
from hil.wire.link import BoardLink

if TYPE_CHECKING:
    from hil.config.robot import RobotConfig
    from hil.core.rig import Rig


class Eye(Protocol):
    """Whoever looks at the wheels; asked only while they are off."""

    def watch(self, text: str) -> None:
        """Told what is about to be driven."""

    def seen(self, driven: Side) -> wiring.Seen | None:
        """Return which wheels turned and which way; None when nobody looked."""

    def turns(self, side: Side, believed: float) -> float | None:
        """Return how many turns the wheels of a side made; None when nobody counted."""


@dataclass(frozen=True, slots=True)
class Plan:
    """What is wanted of a bring-up; `robot` is the believed one."""

    robot: RobotConfig
    wheel_speed_needed_rad_s: float
    turns: float = 10.0
    # Turn rate that the laws may ask for, where the robot stands on its floor; None: it is on blocks.
    floor_turn_rad_s: float | None = None


def plan_for(robot: RobotConfig, turns: float, *, floor: bool) -> Plan:
    """Return the plan for a robot on blocks, or on its floor, that the laws' limits ask for."""
    limits = OuterLimits()
    rim_m_s = limits.eta1_max_m_s + limits.theta_dot_max_rad_s * robot.track_m / 2.0
    turn_rad_s = limits.theta_dot_max_rad_s if floor else None
    return Plan(robot, rim_m_s / robot.wheel_radius_m, turns, turn_rad_s)


class BringUp:
    """Runs once over a rig on blocks, or on its floor where the plan says so; `tell` gets each check."""

    def __init__(self, rig: Rig, eye: Eye, plan: Plan, tell: Callable[[Check], None]) -> None:
        self._link = BoardLink(rig.stream)
        self._rig = rig
        self._eye = eye
        self._plan = plan
        self._tell = tell
        self._loop = OpenLoop(rig, self._link)
        self._report = Report()
        self._over_rad_s = math.nan

    def run(self) -> Report:
        """Make every check that can be made; raises RigFault when the rig breaks on the way.

        Whatever happens, the wheels are off and the board's parameters as they were.
        """
        try:
            board.finish(self._link, self._rig, board.connect(self._link, {}))
        except RigFault as fault:
            self._add(Check("board", "fail", str(fault), "docs/debugging.md", "no_board"))
            return self._report
        self._add(verdicts.identity(self._link.info))
        for check in check_link(self._loop, self._link, self._measured):
            self._add(check)
        if not math.isnan(self._link.battery_v):
            self._measured.battery_v = self._link.battery_v
        self._add(verdicts.battery(self._link.battery_v, self._link.parameters))
        if not self._report.passed:
            self._add(Check("wheels", "skipped", "not driven before the above is mended"))
            return self._report
        self._over_rad_s = self._link.parameters["OVER_W"]
        self._drive_wheels(
            self._on_blocks if self._plan.floor_turn_rad_s is None else self._on_floor
        )
        return self._report

    @property
    def _measured(self) -> Measured:
        return self._report.measured

    def _add(self, *checks: Check) -> None:
        for check in checks:
            self._report.checks.append(check)
            self._tell(check)

    def _drive_wheels(self, checks: Callable[[], None]) -> None:
        try:
            self._loop.prepare()
            checks()
        except BoardStopped as stopped:
            self._add(Check("board", "fail", str(stopped), "docs/debugging.md", "board_stopped"))
        except BaseException:
            self._loop.emergency()
            with suppress(RigFault):
                self._loop.restore()
            raise
        self._loop.restore()

    def _on_blocks(self) -> None:
        sound = self._wiring()
        self._speeds(sound, self._over_rad_s)
        self._turns(sound)

    def _on_floor(self) -> None:
        """Turn on the spot either way."""
        needed_rad_s = self._plan.floor_turn_rad_s or 0.0
        for sign, name in floor_turn.NAMES.items():
            self._eye.watch(f"the robot makes a {name} on the spot, up to full duty")
            found = floor_turn.measure_turn(self._loop, self._plan.robot, sign)
            self._add(floor_turn.judge(sign, found, needed_rad_s))

    def _wiring(self) -> list[Side]:
        """Drive each side alone; return the sides whose motor and encoder are sound."""
        sound: list[Side] = []
        for side in SIDES:
            self._eye.watch(f"the {side.upper()} wheels are driven forward, slowly")
            moved = measure.look(self._loop, side)
            checks = wiring.judge(side, moved, self._eye.seen(side))
            self._add(*checks)
            if all(check.state in {"ok", "note"} for check in checks):
                sound.append(side)
        return sound

    def _speeds(self, sound: list[Side], over_rad_s: float) -> None:
        """Ramp both sound sides to full duty, forward and backward."""
        if not sound:
            self._add(Check("dead zone", "skipped", "no side is sound"))
            self._add(Check("top speed", "skipped", "no side is sound"))
            return
        counts = self._plan.robot.encoder_counts_per_turn
        names = " and ".join(sound).upper()
        self._eye.watch(f"the {names} wheels go up to FULL SPEED, forward, then backward")
        ahead = measure.sweep(self._loop, sound, 1, counts)
        back = measure.sweep(self._loop, sound, -1, counts)
        out = self._measured
        out.dead_duty_forward, out.dead_duty_backward = ahead.dead_duty, back.dead_duty
        out.top_speed_forward_rad_s = ahead.top_speed_rad_s
        out.top_speed_backward_rad_s = back.top_speed_rad_s
        out.top_speed_battery_v = ahead.battery_v
        self._add(*verdicts.dead_zone(sound, ahead, back))
        needed = self._plan.wheel_speed_needed_rad_s
        self._add(*verdicts.top_speed(sound, ahead, back, needed, over_rad_s))

    def _turns(self, sound: list[Side]) -> None:
        """Let a person count turns against the encoder's counts."""
        plan, found = self._plan, dict[Side, float]()
        believed = plan.robot.encoder_counts_per_turn
        for side in sound if plan.turns else []:
            self._eye.watch(
                f"count the turns of the {side.upper()} wheels (chalk mark), about {plan.turns:g}"
            )
            counts = measure.turn(self._loop, side, plan.turns, believed)
            turned = self._eye.turns(side, counts / believed)
            if turned:
                found[side] = counts / turned
                self._add(verdicts.counts_per_turn(side, counts, turned, believed))
        if not found:
            why = "nobody counted turns" if sound else "no side is sound"
            self._add(Check("counts per turn", "skipped", why))
            return
        self._measured.counts_per_turn = (found.get("left"), found.get("right"))
        self._measured.turns = plan.turns
