"""Residuals between commands, wheels, PWM and camera, each a named fault with its evidence.

What the board judges by itself (stall, runaway, overspeed, silence) stays with it and comes first; the
host sees what needs the command, the camera or more time: a side that only creeps, frames that repeat,
sides exchanged, an encoder that comes and goes, a robot that gets nowhere. A side that is weak is told
and stops nothing. False-alarm and detection figures: docs/faults.md.

Nothing here reads a clock. SI units and radians; sides are (left, right).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from hil.core.errors import RigFault
from hil.core.rig import whole

if TYPE_CHECKING:
    from hil.config.scenario import ReactionsConfig
    from hil.core.rig import Frame
    from hil.core.types import Vec2
    from hil.wire.link import WheelReport

Note = Callable[[str, str], None]
SIDES = ("left", "right")
DIAGNOSIS = "diagnosis"  # kind of the record's events that the verdict repeats

# A side is asked to move from here on, and is stuck below this share of it over so long; the board's
# own limit for a wheel without any count is 0.5 s, so that one speaks first. A robot that wriggles about
# its stuck wheel turns that to and fro, by less than the last share.
_ASKED_RAD_S = 2.0
_STUCK_RATIO, _STUCK_PWM_RATIO, _STUCK_S, _WRIGGLE_RATIO = 0.03, 0.5, 0.6, 0.1
# What has turned at least so much of what was asked, at full PWM, is weak and not stuck.
_TURNS_RATIO = 0.1
# A wheel that turns as asked (above the first share) cannot stand (below the second) and turn again
# this fast: so many dips within the window.
_TURNED_RATIO, _DIP_RATIO = 0.6, 0.05
_DIPS, _DIP_WINDOW_S, _DIP_LEAST_S, _DIP_MOST_S = 2, 4.0, 0.08, 0.5
# At full PWM for longer than the run-up takes, a side that gives less than this share is weak.
_FULL_PWM_RATIO, _RUN_UP_S, _WEAK_S, _WEAK_RATIO = 0.98, 0.4, 1.0, 0.75
# The same picture while the wheels turn so far; the last is enough where the camera is doubted anyhow.
_REPEATED_FRAMES, _REPEATED_TURN_RAD, _REPEATED_LEAST_RAD = 5, 1.0, 0.3
# Each side asked for something else, and each giving what the other is asked for.
_SWAPPED_ASKED_RAD_S, _SWAPPED_RATIO, _SWAPPED_S = 2.0, 0.5, 0.4
# No progress: the error has not come down by this for so long, and is not small.
_NO_PROGRESS_S, _PROGRESS_M, _FAR_M = 8.0, 0.02, 0.15


@dataclass(slots=True)
class Held:
    """How long a condition has held without a break."""

    since_s: float = math.inf

    def after(self, now_s: float, holds: bool) -> float:
        """Return for how long it has held by now, s; 0 while it does not."""
        if not holds:
            self.since_s = math.inf
            return 0.0
        self.since_s = min(self.since_s, now_s)
        return now_s - self.since_s


@dataclass(slots=True)
class _Side:
    """What is known of one side."""

    stuck: Held = field(default_factory=Held)
    stuck_asked_rad: float = 0.0
    stuck_given_rad: float = 0.0
    full: Held = field(default_factory=Held)
    dip: Held = field(default_factory=Held)
    turned: bool = False
    dips_s: deque[float] = field(default_factory=deque)
    asked_rad_s: float = 0.0
    asked_rad: float = 0.0
    given_rad: float = 0.0
    weak_s: float = 0.0


class Plausibility:
    """Judges each tick; raises RigFault for a fault whose reaction is to stop, notes the others once."""

    def __init__(self, reactions: ReactionsConfig, note: Note) -> None:
        self._reactions = reactions
        self._note = note
        self._told: set[str] = set()
        self._sides = (_Side(), _Side())
        self._swapped = Held()
        self._asked: Vec2 = (0.0, 0.0)
        self._last_s = math.nan
        self._picture: object = None
        self._repeats = 0
        self._counts_at_picture: tuple[int, int] | None = None
        self._turned_rad = 0.0  # since the picture last changed
        self._least_m = math.inf
        self._least_s = math.nan

    def saw(self, frame: Frame, report: WheelReport | None, rad_per_count: float) -> None:
        """Take one frame; the same one again while the wheels turn is a fault."""
        picture = _picture_of(frame)
        counts = (report.sample.counts_left, report.sample.counts_right) if report else None
        if picture is None or picture != self._picture or self._counts_at_picture is None:
            self._picture, self._repeats, self._counts_at_picture = picture, 0, counts
            self._turned_rad = 0.0
            return
        self._repeats += 1
        if counts is None or self._repeats < _REPEATED_FRAMES:
            return
        self._turned_rad = rad_per_count * max(
            abs(now - then) for now, then in zip(counts, self._counts_at_picture, strict=True)
        )
        if self._turned_rad >= _REPEATED_TURN_RAD:
            self._react("frames_repeated", self._repeated())

    def narrowed(self, fault: RigFault) -> RigFault:
        """Return what is wrong where camera and wheels disagree: frames that repeat, if they do."""
        if self._reactions.frames_repeated != "stop" or self._repeats < _REPEATED_FRAMES:
            return fault
        stuck = self._turned_rad >= _REPEATED_LEAST_RAD
        return RigFault(f"{self._repeated()}; {fault}") if stuck else fault

    def _repeated(self) -> str:
        return (
            f"camera: frames repeated: the same picture {self._repeats + 1} times while the wheels "
            f"turned {self._turned_rad:.2f} rad (limits {_REPEATED_FRAMES + 1} times, "
            f"{_REPEATED_TURN_RAD:g} rad); camera or its driver hangs"
        )

    def check(self, now_s: float, report: WheelReport, pwm_top_counts: int) -> None:
        """Judge the wheels against what was asked of them up to now."""
        given = (report.sample.omega_left_rad_s, report.sample.omega_right_rad_s)
        pwm = (report.wire.pwm_left_counts, report.wire.pwm_right_counts)
        dt_s = now_s - self._last_s if self._last_s == self._last_s else 0.0
        self._last_s = now_s
        for index, side in enumerate(self._sides):
            full_ratio = abs(pwm[index]) / max(pwm_top_counts, 1)
            self._check_side(now_s, dt_s, index, side, self._asked[index], given[index], full_ratio)
        self._check_swapped(now_s, given)

    def asked(self, left_rad_s: float, right_rad_s: float) -> None:
        """Take what is asked of the wheels from now on."""
        self._asked = (left_rad_s, right_rad_s)

    def check_progress(self, now_s: float, error_m: float) -> None:
        """Judge whether the robot still gets nearer to its goal, or stays near enough."""
        if error_m < self._least_m - _PROGRESS_M or error_m < _FAR_M:
            self._least_m, self._least_s = error_m, now_s
            return
        if math.isnan(self._least_s):
            self._least_s = now_s
        stalled_s = now_s - self._least_s
        if stalled_s > _NO_PROGRESS_S:
            self._react(
                "no_progress",
                f"robot: no progress: {error_m:.3f} m from the goal, and not nearer than "
                f"{self._least_m:.3f} m for {stalled_s:.1f} s (limits {_FAR_M:g} m, {_NO_PROGRESS_S:g} s); "
                "circling, held, or a weak motor?",
            )

    def finish(self) -> None:
        """Tell what was seen over the whole run and stops nothing."""
        for name, side in zip(SIDES, self._sides, strict=True):
            if side.weak_s < _WEAK_S or side.asked_rad <= 0.0:
                continue
            ratio = max(side.given_rad, 0.0) / side.asked_rad
            if ratio < _WEAK_RATIO:
                self._note(
                    DIAGNOSIS,
                    f"side weak: {name} side gives {ratio:.2g} of what is asked (full PWM for "
                    f"{side.weak_s:.1f} s; limits {_WEAK_RATIO:g}, {_WEAK_S:g} s); motor, lead, or a "
                    "brake on that side?",
                )

    def _check_side(
        self, now_s: float, dt_s: float, index: int, side: _Side, asked: float, given: float,
        pwm_ratio: float,
    ) -> None:  # fmt: skip
        moving = abs(asked) >= _ASKED_RAD_S
        low = moving and abs(given) < _WRIGGLE_RATIO * abs(asked)
        stuck_s = side.stuck.after(now_s, low and pwm_ratio >= _STUCK_PWM_RATIO)
        if stuck_s <= 0.0:
            side.stuck_asked_rad = side.stuck_given_rad = 0.0
        side.stuck_asked_rad += asked * dt_s
        side.stuck_given_rad += given * dt_s
        stands = abs(side.stuck_given_rad) < _STUCK_RATIO * abs(side.stuck_asked_rad)
        weak = side.weak_s > _WEAK_S and side.given_rad > _TURNS_RATIO * side.asked_rad
        if stuck_s >= _STUCK_S and stands and not weak:
            self._react(
                "motor_stuck",
                f"motor stuck: {SIDES[index]} wheels turn {given:.2f} rad/s of {asked:.2f} rad/s asked at "
                f"{pwm_ratio:.0%} PWM for {stuck_s:.2f} s (limits {_STUCK_RATIO:.0%}, {_STUCK_S:g} s)",
            )
        self._check_dips(now_s, index, side, asked, given)
        full_s = side.full.after(now_s, moving and pwm_ratio >= _FULL_PWM_RATIO)
        if full_s > _RUN_UP_S:
            side.weak_s += dt_s
            side.asked_rad += abs(asked) * dt_s
            side.given_rad += math.copysign(given, given * asked) * dt_s

    def _check_dips(
        self, now_s: float, index: int, side: _Side, asked: float, given: float
    ) -> None:
        """Count the times a turning wheel's counts stop and come back while it is asked to turn."""
        began_s = side.dip.since_s
        if asked * side.asked_rad_s <= 0.0 or abs(asked) < 2.0 * _ASKED_RAD_S:
            side.turned, side.dip.since_s, side.asked_rad_s = False, math.inf, asked
            return
        side.asked_rad_s = asked
        if abs(given) < _DIP_RATIO * abs(asked):
            side.dip.after(now_s, side.turned)
            return
        if began_s < math.inf and _DIP_LEAST_S <= now_s - began_s <= _DIP_MOST_S:
            side.dips_s.append(now_s)
        side.dip.since_s = math.inf
        side.turned = abs(given) > _TURNED_RATIO * abs(asked) or (
            side.turned and began_s < math.inf
        )
        while side.dips_s and now_s - side.dips_s[0] > _DIP_WINDOW_S:
            side.dips_s.popleft()
        if len(side.dips_s) >= _DIPS:
            self._react(
                "encoder_intermittent",
                f"encoder intermittent: {SIDES[index]} counts stopped and came back {len(side.dips_s)} "
                f"times within {now_s - side.dips_s[0] + _DIP_MOST_S:.2f} s while {asked:.1f} rad/s were "
                f"asked (limits {_DIPS} times, {_DIP_WINDOW_S:g} s); check its plug",
            )

    def _check_swapped(self, now_s: float, given: Vec2) -> None:
        (left, right), (given_left, given_right) = self._asked, given
        own = abs(given_left - left) + abs(given_right - right)
        others = abs(given_left - right) + abs(given_right - left)
        against = (
            abs(right - left) >= _SWAPPED_ASKED_RAD_S
            and own >= _SWAPPED_ASKED_RAD_S
            and others < _SWAPPED_RATIO * own
        )
        held_s = self._swapped.after(now_s, against)
        if held_s >= _SWAPPED_S:
            self._react(
                "sides_swapped",
                f"sides swapped: left gives {given_left:.1f} rad/s of {left:.1f} asked, right "
                f"{given_right:.1f} of {right:.1f}, each what the other is asked for, for {held_s:.2f} s "
                f"(limit {_SWAPPED_S:g} s); motors or encoders exchanged",
            )

    def _react(self, name: str, evidence: str) -> None:
        if getattr(self._reactions, name) == "stop":
            raise RigFault(evidence)
        if name not in self._told:
            self._told.add(name)
            self._note(DIAGNOSIS, evidence)


def _picture_of(frame: Frame) -> object:
    """Return what equal pictures have equal, None where there is nothing to compare."""
    picture = frame.picture
    if picture is not None:
        content: object = getattr(picture, "content", None)
        return content or whole(picture)[::16, ::16].tobytes()
    return frame.pose.pose if frame.pose is not None else None
