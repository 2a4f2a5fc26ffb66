"""One run of one scenario over one rig: connect, find the robot, arm, control, stop.

The loop sees a byte stream, camera frames and a clock (`hil.core.rig.Rig`) and never asks what
is behind them. Host time is the rig's; `t_s` counts from the first tick of the controlled part.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from hil.core.errors import RecordFault, RigFault
from hil.core.registry import in_one_line
from hil.record.schema import TRACE_KEYS
from hil.runs import _native
from hil.runs.driving import Asked, Turn, drive_to_end, make_drive
from hil.runs.intake import Intake
from hil.runs.parts import Ending, Parts, Progress, Publish, Situation
from hil.runs.watching import DIAGNOSIS, make_pump, make_watch
from hil.wire import handshake

if TYPE_CHECKING:
    from hil.config.scenario import Scenario
    from hil.core.types import Estimate, OuterCommand, ReferenceState

# Poses and time exchanges wanted before the start; both ties are then good to a few ms.
_POSES_WANTED = 15
_EXCHANGES_WANTED = 8
_FIND_TIMEOUT_S = 5.0
_ARM_TIMEOUT_S = 1.0
_STOP_TIMEOUT_S = 2.0
# A tick that begins later than this share of its period is a missed deadline.
_LATE_RATIO = 0.5


class Session:
    """Runs the scenario once; `run`, `steps` or `turns` may be called, once."""

    def __init__(
        self,
        scenario: Scenario,
        parts: Parts,
        parameters: dict[str, float],
        hashes: Callable[[dict[str, float]], tuple[int, int]],
        progress: Progress | None = None,
        publish: Publish | None = None,
    ) -> None:
        self._scenario = scenario
        self._parts = parts
        self._parameters = parameters
        self._hashes = hashes
        self._progress = progress
        self._publish = publish
        self.ending = Ending("fault", "ended without a cause")
        self._t0_s = 0.0
        self._dialect_hash = self._parameter_hash = 0
        self._may_move = False
        timeline, rig = parts.timeline, parts.rig

        def note(kind: str, text: str) -> None:
            timeline.event(rig.now_s(), kind, text)

        self._note = note  # no method: native parts keep it, and know nothing of this session
        self._watch = make_watch(scenario, parts, note)
        self._pump = make_pump(parts, self._watch, note, scenario.camera)
        self._intake = Intake(scenario.camera, parts, self._watch, note, self._pump)
        self._format = _native.RowFormat(TRACE_KEYS, parts.own_terms)
        self.error: Exception | SystemExit | None = None  # what ended the run and is no rig fault

    def run(self) -> Ending:
        """Run all phases; the robot is stopped whatever happens."""
        for _ in self._phases(looked_at=self._publish is not None or self._progress is not None):
            pass
        return self.ending

    def steps(self) -> Generator[Situation, int]:
        """Run all phases, pausing at each tick before the law is asked; then `ending` says how it was.

        Time of a simulated rig stands still in a pause. Closing the iterator stops the robot.
        """
        return self._phases(looked_at=True)

    def turns(self) -> Generator[Turn, int]:
        """Run all phases, whose ticks others advance: `hil.runs.driving.Turn`.

        A run whose ticks are Python's pauses nowhere. What others met on the way is thrown in.
        """
        return self._phases(looked_at=False, asked=[])

    def _phases(self, *, looked_at: bool, asked: list[Asked] | None = None) -> Generator[Any, int]:
        try:
            self._connect()
            self._find_robot()
            self._pump_while(self._parts.orders.hold, math.inf)
            self._arm()
            yield from self._control(looked_at=looked_at, asked=asked)
            self.ending = Ending("complete")
        except RigFault as fault:
            self.ending = Ending("fault", str(fault))
        except (KeyboardInterrupt, GeneratorExit) as stop:
            by = str(stop) or "Ctrl-C"
            self.ending = Ending(
                "interrupted",
                by if isinstance(stop, KeyboardInterrupt) else "closed before its end",
            )
        except (Exception, SystemExit) as error:
            self.error = error
            self.ending = Ending("fault", in_one_line(error))
        finally:
            self._stop()
        with suppress(RecordFault):  # closing the record says so
            self._watch.finish()
            if short := self._watch.short_turn():
                self._note(DIAGNOSIS, short)
            self._note(self.ending.outcome, self.ending.detail)
            self._parts.timeline.start(self._parts.rig.now_s())
            self._intake.hand_over_frames()

    def halt(self) -> None:
        """Send the emergency stop at once and wait for nothing."""
        if self._may_move:
            with suppress(Exception):
                self._parts.link.stop_now(self._parts.rig.now_s())

    # -- phases --------------------------------------------------------------------------------

    def _connect(self) -> None:
        link = self._parts.link
        link.begin(handshake.connect(link, self._parameters))
        self._pump_while(lambda: link.busy, math.inf)
        self._dialect_hash, self._parameter_hash = self._hashes(link.parameters)
        self._parts.recorder.identify(
            f"{link.info.dialect_hash:08x}",
            f"{link.info.parameter_hash:08x}",
            link.info.build_id,
        )
        self._note("connected", f"{len(link.parameters)} parameters")

    def _find_robot(self) -> None:
        """Wait at rest until the robot was seen and both clocks are tied."""
        link = self._parts.link
        ready = self._pump_while(
            lambda: self._watch.poses < _POSES_WANTED or link.clock.exchanges < _EXCHANGES_WANTED,
            self._parts.rig.now_s() + _FIND_TIMEOUT_S,
        )
        if ready:
            self._note("found", f"clock tie {link.clock.sigma_s * 1e3:.2f} ms (1 sigma)")
            return
        poses, why = self._watch.poses, self._watch.reason
        if poses < _POSES_WANTED:
            why = "no frame came" if why is None else why
            raise RigFault(
                f"camera: robot seen {poses} times in {_FIND_TIMEOUT_S:.0f} s, "
                f"{_POSES_WANTED} are needed ({why}); check light, marks and camera pose"
            )
        raise RigFault(
            f"board: {link.clock.exchanges} time exchanges in {_FIND_TIMEOUT_S:.0f} s, "
            f"{_EXCHANGES_WANTED} are needed; check range and baud rate"
        )

    def _arm(self) -> None:
        link = self._parts.link
        self._may_move = True  # from here on the robot is stopped, whatever the board last said
        now_s = self._parts.rig.now_s()
        link.begin(handshake.arm(link, self._dialect_hash, self._parameter_hash))
        self._intake.until(now_s)  # the command goes out
        # Set-points go right behind it: the board stops by itself after 250 ms of silence, and
        # its answer may take longer.
        self._pump_while(lambda: link.busy, math.inf, feed=True)
        if not self._pump_while(
            lambda: not link.armed, self._parts.rig.now_s() + _ARM_TIMEOUT_S, feed=True
        ):
            raise RigFault(f"board: acknowledged arming and stayed {link.state_name}")
        self._note("armed", link.state_name)

    def _control(self, *, looked_at: bool, asked: list[Asked] | None) -> Generator[Any, int]:
        scenario, rig, law = self._scenario, self._parts.rig, self._parts.law
        period_s = 1.0 / scenario.control.rate_hz
        ticks = round(scenario.duration_s * scenario.control.rate_hz) + 1
        self._t0_s = rig.now_s()
        self._parts.timeline.start(self._t0_s)
        rig.begin(self._t0_s)
        drive = None
        if self._pump is not None and not looked_at:
            plan = self._t0_s, period_s, ticks
            drive = make_drive(self._parts, self._pump, self._watch, *plan, asked)
        if self._pump is not None and drive is not None:
            board, check = self._board_counts, self._check_safety
            parts, intake = self._parts, self._intake
            yield from drive_to_end(drive, parts, self._pump, intake, board, check, asked)
            return
        for tick in range(ticks):
            due_s = self._t0_s + tick * period_s
            self._intake.until(due_s)
            now_s = rig.now_s()
            self._check_safety(now_s)
            estimate = self._estimate(now_s)
            reference = self._parts.reference.at(estimate.t_host_s - self._t0_s)
            if asked is None:
                yield Situation(now_s - self._t0_s, reference, estimate)
            if tick == 0:
                law.reset(reference, estimate)
            self._parts.orders.at_tick(reference, estimate)
            command = law.step(reference, estimate, period_s)
            late = now_s - due_s > _LATE_RATIO * period_s
            self._act(now_s, period_s, reference, estimate, command, late)
            if self._publish is not None:
                self._publish(now_s, estimate, self._parts.link.armed)
            if self._progress is not None:
                self._progress(now_s - self._t0_s)

    def _stop(self) -> None:
        """Stop the wheels: politely while the board answers, by repeated stop commands if not."""
        rig, link = self._parts.rig, self._parts.link
        if not self._may_move:
            return
        try:
            self._send_wheels(0.0, 0.0)
            link.begin(handshake.disarm(link))
            if self._pump_while(lambda: link.busy or link.armed, rig.now_s() + _STOP_TIMEOUT_S):
                self._note("stopped", link.state_name)
                return
            reason = "no answer to the stop; the board's own time-out ends its motion"
        except (RigFault, KeyboardInterrupt) as error:
            reason = str(error) or "Ctrl-C"
        except Exception as error:
            self.error, reason = self.error or error, in_one_line(error)
        link.stop_now(rig.now_s())
        with suppress(RecordFault):
            self._note("stop", f"emergency stop sent: {reason}")

    # -- events --------------------------------------------------------------------------------

    def _pump_while(
        self, waiting: Callable[[], bool], until_s: float, *, feed: bool = False
    ) -> bool:
        """Pump while `waiting()`; return whether it ended before `until_s`.

        With `feed`, zero set-points are sent at the outer rate meanwhile.
        """
        rig, link = self._parts.rig, self._parts.link
        period_s = 1.0 / self._scenario.control.rate_hz
        while waiting():
            now_s = rig.now_s()
            if now_s >= until_s:
                return False
            if feed:
                self._send_wheels(0.0, 0.0)
            if link.busy and not feed:
                self._intake.periods(period_s, until_s)
            else:
                self._intake.until(min(until_s, now_s + period_s))
        return True

    def _check_safety(self, now_s: float) -> None:
        """Raise RigFault when the host itself must stop the robot."""
        if self._intake.refusal:
            raise RigFault(f"board: {self._intake.refusal}")
        link, estimator = self._parts.link, self._parts.estimator
        self._watch.check_host(now_s)
        if not link.armed:
            anew = "; it has started anew: reset, brown-out or watchdog" if link.disarmed else ""
            raise RigFault(f"board: left ARMED by itself: {link.state_name}{anew}")
        top_counts = link.info.pwm_top_counts
        if self._pump is not None:
            self._pump.check(self._watch, now_s, top_counts)
            return
        self._watch.check(
            now_s, estimator.agreement_age_s(now_s), estimator.refused, estimator.scales, top_counts
        )

    def _estimate(self, now_s: float) -> Estimate:
        """Return the state at the actuation time of a tick, inside the fence; else RigFault."""
        watch = self._watch
        _, most_counts, stall_counts = self._board_counts()
        if self._pump is not None:
            return self._pump.look(watch, now_s, most_counts, stall_counts)
        estimate = self._parts.estimator.estimate_at(now_s + watch.uplink_s)
        if estimate is None:
            raise RigFault("camera: no pose to estimate from")
        watch.check_estimate(estimate.pose.x_m, estimate.pose.y_m)
        sides, hard = watch.sides(most_counts), watch.driven_hard(stall_counts)
        if sides == (0, 0) and not hard:
            return estimate
        return replace(estimate, sides_at_limit=sides, driven_hard=hard)

    def _board_counts(self) -> tuple[int, float, float]:
        """Return the counts of the board's PWM at its top, at its limit, and at a stall."""
        link = self._parts.link
        top_counts = link.info.pwm_top_counts
        return (
            top_counts,
            top_counts * link.parameters.get("PWM_MAX", 1.0),
            top_counts * link.parameters.get("STALL_DUTY", 1.0),
        )

    # -- out -----------------------------------------------------------------------------------

    def _act(
        self,
        now_s: float,
        period_s: float,
        reference: ReferenceState,
        estimate: Estimate,
        command: OuterCommand,
        late: bool,
    ) -> None:
        """Send what a tick asks of the wheels, tell estimator and judges of it, and record its row.

        Estimate, truth and goal of the row are those of `now_s`.
        """
        parts, watch, t_s = self._parts, self._watch, now_s - self._t0_s
        turn_rad_s = command.theta_dot_rad_s
        left, right = wheels = parts.vehicle.wheels(command.eta1_m_s, turn_rad_s)
        goal_m, aim_m = parts.reference.at(t_s).z1_m, reference.z1_m
        if self._pump is not None:
            row = self._pump.act(
                watch, self._format, now_s, t_s, period_s, aim_m, goal_m, command, wheels, late
            )
            parts.recorder.append(row)
            return
        self._send_wheels(left, right)
        parts.estimator.on_command(now_s + watch.uplink_s, command.eta1_m_s, turn_rad_s)
        watch.take_tick(
            now_s,
            period_s,
            estimate.sides_at_limit,
            turn_rad_s,
            estimate.theta_dot_rad_s,
            left,
            right,
            math.dist(aim_m, estimate.z1_m),
        )
        row = watch.row(
            self._format,
            parts.link.native,
            now_s,
            t_s,
            parts.estimator.estimate_at(now_s),
            parts.rig.truth(),
            goal_m,
            command,
            wheels,
            late,
        )
        parts.recorder.append(row)

    def _send_wheels(self, left_rad_s: float, right_rad_s: float) -> None:
        now_s = self._parts.rig.now_s()
        if self._pump is not None:
            self._pump.send_setpoint(now_s, left_rad_s, right_rad_s)
        else:
            self._parts.link.send_setpoint(now_s, left_rad_s, right_rad_s)
