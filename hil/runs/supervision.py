"""When the host stops the robot by itself: board, link, camera, fence, camera against wheels.

Everything here follows from what the session hands in; nothing reads a clock. World frame, SI.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hil.core.errors import RigFault

if TYPE_CHECKING:
    from hil.config.scenario import SafetyConfig
    from hil.core.types import Estimate, Estimator, Pose, PoseMeasurement
    from hil.wire.link import BoardLink, WheelReport

# Poses seen outside the fence, one after the other, that end the run: one may be a wrong find.
_OUTSIDE_POSES = 2
# So many poses seen and not believed are no camera that does not see.
_REFUSED_POSES = 3
# What the camera may see of a metre or a radian that the wheels turn. A robot file that is off by a
# fifth and tyres that slip in turns stay within 0.5 to 1.6; a wrong sign is -1, a robot held is 0.
_LEAST_SCALE, _MOST_SCALE = 0.2, 3.0
# Older wheel reports say nothing of what the wheels turn now; 50 come in a second.
_FRESH_S = 0.1
# The board stops by itself after so long without a set-point (firmware core, SETPOINT_TIMEOUT).
_BOARD_WAITS_S = 0.25
_DISAGREE_WHY = "marks exchanged, picture mirrored, or the robot pushed or held?"


class Disagreement(RigFault):
    """Camera and wheels say different things of the robot's motion."""


class Supervisor:
    """Judges one run by its safety limits; each check raises RigFault when the robot has to stop."""

    def __init__(self, safety: SafetyConfig, estimator: Estimator) -> None:
        self._safety = safety
        self._estimator = estimator
        self._measurement: PoseMeasurement | None = None
        self._outside = 0
        self._refused = 0
        self._last_tick_s = math.nan
        self._newest_s = -math.inf

    def check_clock(self, now_s: float) -> None:
        """Raise RigFault when the host's clock, which must never, has gone back; once for each time."""
        back_s, self._newest_s = self._newest_s - now_s, now_s
        if back_s > 0.0:
            raise RigFault(
                f"host: its clock went back by {back_s:.3f} s; nothing can be timed by it"
            )

    def check_host(self, now_s: float) -> None:
        """Raise RigFault when the host itself was away for longer than the board waits for it."""
        away_s, self._last_tick_s = now_s - self._last_tick_s, now_s
        if away_s > _BOARD_WAITS_S:
            raise RigFault(
                f"host: {away_s:.2f} s between two ticks (limit {_BOARD_WAITS_S:g} s: the board stops by "
                "itself then); process stopped, machine suspended or overloaded, or its clock stepped"
            )

    def saw(self, exposure_s: float, measurement: PoseMeasurement) -> None:
        """Take what the localiser said of a frame, after the estimator was given it."""
        self._measurement = measurement
        pose = measurement.pose
        if pose is None:
            return
        self._outside = 0 if self._is_inside(pose) else self._outside + 1
        agreed = self._estimator.agreement_age_s(exposure_s) <= 0.0
        self._refused = 0 if agreed else self._refused + 1

    def check(self, now_s: float, link: BoardLink, report: WheelReport | None) -> None:
        """Raise RigFault when board, link or camera no longer answer for the robot."""
        if not link.armed:
            anew = "; it has started anew: reset, brown-out or watchdog" if link.disarmed else ""
            raise RigFault(f"board: left ARMED by itself: {link.state_name}{anew}")
        silent_s = now_s - (report.t_arrival_s if report else -math.inf)
        limit_s = self._safety.link_lost_s
        if silent_s > limit_s:
            raise RigFault(f"link: no wheel report for {silent_s:.2f} s (limit {limit_s:g} s)")
        if self._outside >= _OUTSIDE_POSES and self._measurement and self._measurement.pose:
            raise self._left("robot seen at", self._measurement.pose)
        self._check_agreement(now_s)
        if silent_s <= _FRESH_S:  # without reports the wheels are only thought to turn as asked
            self._check_scales()

    def check_estimate(self, estimate: Estimate) -> None:
        """Raise RigFault when the robot is thought to be outside the fence."""
        if not self._is_inside(estimate.pose):
            raise self._left("robot at", estimate.pose)

    def _check_agreement(self, now_s: float) -> None:
        """Raise RigFault when no pose was believed for too long, or none was seen."""
        lost_s, limit_s = self._estimator.agreement_age_s(now_s), self._safety.pose_lost_s
        if lost_s <= limit_s:
            return
        duration = f"for {lost_s:.2f} s (limit {limit_s:g} s)"
        if self._refused >= _REFUSED_POSES:
            x_m, y_m, turn_rad = self._estimator.refused
            raise Disagreement(
                f"camera and wheels disagree: robot not seen where the wheels take it {duration}: "
                f"{self._refused} poses refused, the last one {math.hypot(x_m, y_m):.3f} m and "
                f"{math.degrees(turn_rad):.0f} deg off; {_DISAGREE_WHY}"
            )
        reason = self._measurement.reason if self._measurement else ""
        raise RigFault(f"camera: robot not seen {duration}{': ' + reason if reason else ''}")

    def _check_scales(self) -> None:
        """Raise RigFault when poses are believed only because the wheels no longer count."""
        for seen, unit in zip(self._estimator.scales, ("m", "rad"), strict=True):
            if not _LEAST_SCALE <= seen <= _MOST_SCALE:
                raise Disagreement(
                    f"camera and wheels disagree: {seen:.2f} {unit} seen for each {unit} that the "
                    f"wheels turn (limits {_LEAST_SCALE:g} to {_MOST_SCALE:g} {unit}); "
                    f"{_DISAGREE_WHY}"
                )

    def _is_inside(self, pose: Pose) -> bool:
        fence = self._safety
        return (
            fence.fence_x_min_m <= pose.x_m <= fence.fence_x_max_m
            and fence.fence_y_min_m <= pose.y_m <= fence.fence_y_max_m
        )

    def _left(self, how: str, pose: Pose) -> RigFault:
        fence = self._safety
        return RigFault(
            f"geofence: {how} ({pose.x_m:.3f}, {pose.y_m:.3f}) m, allowed X "
            f"{fence.fence_x_min_m:g} to {fence.fence_x_max_m:g} m, Y "
            f"{fence.fence_y_min_m:g} to {fence.fence_y_max_m:g} m"
        )
