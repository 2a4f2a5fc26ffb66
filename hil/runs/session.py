"""One run of one scenario over one rig: connect, find the robot, arm, control, stop.

The loop sees a byte stream, camera frames and a clock (`hil.core.rig.Rig`) and never asks what
is behind them. Host time is the rig's; `t_s` counts from the first tick of the controlled part.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from hil.core.clocks import odd_stamp
from hil.core.errors import RecordFault, RigFault
from hil.core.registry import in_one_line
from hil.core.types import PoseMeasurement
from hil.record.tick_rows import sample_row
from hil.runs.parts import Ending, Parts, Progress, Publish, Situation
from hil.runs.plausibility import DIAGNOSIS, Plausibility
from hil.runs.supervision import Disagreement, Supervisor
from hil.runs.wheel_limits import WheelLimits
from hil.wire import handshake
from hil.wire.refusal import refused_set_point
from vision.rolling import unrolled

if TYPE_CHECKING:
    from hil.config.scenario import Scenario
    from hil.core.rig import Frame
    from hil.core.types import Estimate, OuterCommand
    from hil.wire.link import WheelReport

# Poses and time exchanges wanted before the start; both ties are then good to a few ms.
_POSES_WANTED = 15
_EXCHANGES_WANTED = 8
_FIND_TIMEOUT_S = 5.0
_ARM_TIMEOUT_S = 1.0
_STOP_TIMEOUT_S = 2.0
# A tick that begins later than this share of its period is a missed deadline.
_LATE_RATIO = 0.5
# Share by which the measured delay to the board follows a new round trip.
_UPLINK_GAIN = 0.05


class Session:
    """Runs the scenario once; `run` or `steps` may be called, once."""

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
        self._texts_noted = 0
        self._refusal = ""
        self._report: WheelReport | None = None
        self._measurement: PoseMeasurement | None = None
        self._supervisor = Supervisor(scenario.safety, parts.estimator)
        self._plausibility = Plausibility(scenario.safety.reactions, self._note)
        self._limits = WheelLimits()
        self._wheels_asked = (0.0, 0.0)
        self._pose_time_s = -math.inf  # of the newest pose believed
        self._seen = self._accepted = False  # since the last tick
        self._camera_restarts = 0
        self._camera_latency_s = math.nan
        self._poses = 0
        self._uplink_s = scenario.link.latency_s
        self.error: Exception | SystemExit | None = None  # what ended the run and is no rig fault

    def run(self) -> Ending:
        """Run all phases; the robot is stopped whatever happens."""
        for _ in self.steps():
            pass
        return self.ending

    def steps(self) -> Generator[Situation]:
        """Run all phases, pausing at each tick before the law is asked; then `ending` says how it was.

        Time of a simulated rig stands still in a pause. Closing the iterator stops the robot.
        """
        try:
            self._connect()
            self._find_robot()
            self._arm()
            yield from self._control()
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
            self._plausibility.finish()
            if short := self._limits.verdict():
                self._note(DIAGNOSIS, short)
            self._note(self.ending.outcome, self.ending.detail)
            self._parts.timeline.start(self._parts.rig.now_s())

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
            lambda: self._poses < _POSES_WANTED or link.clock.exchanges < _EXCHANGES_WANTED,
            self._parts.rig.now_s() + _FIND_TIMEOUT_S,
        )
        if ready:
            self._note("found", f"clock tie {link.clock.sigma_s * 1e3:.2f} ms (1 sigma)")
            return
        if self._poses < _POSES_WANTED:
            why = self._measurement.reason if self._measurement else "no frame came"
            raise RigFault(
                f"camera: robot seen {self._poses} times in {_FIND_TIMEOUT_S:.0f} s, "
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
        self._pump_until(now_s)  # the command goes out
        # Set-points go right behind it: the board stops by itself after 250 ms of silence, and
        # its answer may take longer.
        self._pump_while(lambda: link.busy, math.inf, feed=True)
        if not self._pump_while(
            lambda: not link.armed, self._parts.rig.now_s() + _ARM_TIMEOUT_S, feed=True
        ):
            raise RigFault(f"board: acknowledged arming and stayed {link.state_name}")
        self._note("armed", link.state_name)

    def _control(self) -> Generator[Situation]:
        scenario, rig, law = self._scenario, self._parts.rig, self._parts.law
        period_s = 1.0 / scenario.control.rate_hz
        ticks = round(scenario.duration_s * scenario.control.rate_hz) + 1
        self._t0_s = rig.now_s()
        self._parts.timeline.start(self._t0_s)
        rig.begin(self._t0_s)
        for tick in range(ticks):
            due_s = self._t0_s + tick * period_s
            self._pump_until(due_s)
            now_s = rig.now_s()
            self._check_safety(now_s)
            estimate = self._estimate(now_s + self._uplink_s)
            reference = self._parts.reference.at(estimate.t_host_s - self._t0_s)
            yield Situation(now_s - self._t0_s, reference, estimate)
            if tick == 0:
                law.reset(reference, estimate)
            command = law.step(reference, estimate, period_s)
            wheels = self._wheels_asked = self._command_wheels(now_s, command)
            self._plausibility.asked(*wheels)
            self._limits.take(
                estimate.sides_at_limit,
                command.theta_dot_rad_s,
                estimate.theta_dot_rad_s,
                period_s,
            )
            self._plausibility.check_progress(now_s, math.dist(reference.z1_m, estimate.z1_m))
            self._record(now_s, command, wheels, now_s - due_s > _LATE_RATIO * period_s)
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

    def _pump_until(self, until_s: float) -> None:
        """Take bytes and frames as they arrive until `until_s`; wait at least once, if for no time.

        Ctrl-C is obeyed in waits (`hil.runs.interruption`): a host that is always late must come to one too.
        """
        rig = self._parts.rig
        waited = False
        while True:
            now_s = rig.now_s()
            self._supervisor.check_clock(now_s)
            self._take_all(now_s)
            if now_s >= until_s:
                break
            rig.wait(until_s)
            waited = True
        if not waited:
            rig.wait(now_s)

    def _pump_while(
        self, waiting: Callable[[], bool], until_s: float, *, feed: bool = False
    ) -> bool:
        """Pump while `waiting()`; return whether it ended before `until_s`.

        With `feed`, zero set-points are sent at the outer rate meanwhile.
        """
        rig = self._parts.rig
        period_s = 1.0 / self._scenario.control.rate_hz
        while waiting():
            now_s = rig.now_s()
            if now_s >= until_s:
                return False
            if feed:
                self._send_wheels(0.0, 0.0)
            self._pump_until(min(until_s, now_s + period_s))
        return True

    def _take_all(self, now_s: float) -> None:
        link = self._parts.link
        for report in link.poll(now_s):
            self._report = report
            self._parts.estimator.on_wheels(report.sample)
            round_trip_s = report.round_trip_s
            if not math.isnan(round_trip_s):
                self._uplink_s += _UPLINK_GAIN * (0.5 * round_trip_s - self._uplink_s)
        poll_frame = self._parts.rig.poll_frame
        while (frame := poll_frame()) is not None:
            self._take_frame(frame, now_s)
        if link.texts_heard != self._texts_noted:
            self._note_texts()

    def _note_texts(self) -> None:
        link = self._parts.link
        new = link.texts_heard - self._texts_noted
        self._texts_noted = link.texts_heard
        for text in list(link.texts)[-new:]:
            self._note("board", text.text)
            self._refusal = self._refusal or refused_set_point(text)

    def _take_frame(self, frame: Frame, now_s: float) -> None:
        """Localise one frame and hand the pose to the estimator at its exposure time.

        A frame whose stamp the camera's clock refuses is recorded and not looked at.
        """
        parts, clock = self._parts, self._parts.camera_clock
        if frame.note:
            self._note("camera", frame.note)
        stamped = clock.arrival(frame.t_cam_s, now_s)
        exposure_s = clock.to_host_s(frame.t_cam_s)
        if clock.restarts != self._camera_restarts:
            self._camera_restarts = clock.restarts
            self._note("camera", f"its clock has stepped by {clock.step_s:+.3f} s; tied anew")
        if not stamped:
            measurement = PoseMeasurement(None, 0.0, odd_stamp(exposure_s - now_s))
        else:
            exposure_s = min(exposure_s, now_s)  # jitter aside, no frame is exposed after it came
            measurement = self._measured(frame, exposure_s)
            self._camera_latency_s = now_s - exposure_s
        self._measurement = measurement
        if measurement.pose is not None:
            self._poses += 1
            self._seen = True
            if parts.estimator.on_pose(exposure_s, measurement):
                self._pose_time_s = exposure_s
                self._accepted = True
        self._plausibility.saw(frame, self._report, parts.vehicle.geometry.rad_per_count)
        self._supervisor.saw(exposure_s, measurement)
        parts.timeline.camera_frame(frame, now_s, exposure_s, measurement)

    def _check_safety(self, now_s: float) -> None:
        """Raise RigFault when the host itself must stop the robot."""
        if self._refusal:
            raise RigFault(f"board: {self._refusal}")
        link = self._parts.link
        self._supervisor.check_host(now_s)
        try:
            self._supervisor.check(now_s, link, self._report)
        except Disagreement as fault:
            raise self._plausibility.narrowed(fault) from None
        if self._report is not None:
            self._plausibility.check(now_s, self._report, link.info.pwm_top_counts)

    def _measured(self, frame: Frame, exposure_s: float) -> PoseMeasurement:
        """Return the frame's own pose, else what the localiser finds near the estimate."""
        if frame.pose is not None:
            return frame.pose
        assert frame.image is not None
        before = self._parts.estimator.estimate_at(exposure_s)
        camera = self._scenario.camera
        predicted = before.pose if before is not None else None
        seen = self._parts.localiser.locate(frame.image, predicted, camera.search_radius_m)
        return unrolled(seen, camera, before)

    def _estimate(self, t_effect_s: float) -> Estimate:
        """Return the state at the actuation time, inside the fence; else RigFault."""
        estimate = self._parts.estimator.estimate_at(t_effect_s)
        if estimate is None:
            raise RigFault("camera: no pose to estimate from")
        self._supervisor.check_estimate(estimate)
        link = self._parts.link
        most_counts = link.info.pwm_top_counts * link.parameters.get("PWM_MAX", 1.0)
        stall_counts = link.info.pwm_top_counts * link.parameters.get("STALL_DUTY", 1.0)
        sides = self._limits.sides(self._report, self._wheels_asked, most_counts)
        hard = self._limits.driven_hard(self._report, stall_counts)
        if sides == (0, 0) and not hard:
            return estimate
        return replace(estimate, sides_at_limit=sides, driven_hard=hard)

    # -- out -----------------------------------------------------------------------------------

    def _command_wheels(self, now_s: float, command: OuterCommand) -> tuple[float, float]:
        left, right = self._parts.vehicle.wheels(command.eta1_m_s, command.theta_dot_rad_s)
        self._send_wheels(left, right)
        self._parts.estimator.on_command(
            now_s + self._uplink_s, command.eta1_m_s, command.theta_dot_rad_s
        )
        return left, right

    def _send_wheels(self, left_rad_s: float, right_rad_s: float) -> None:
        self._parts.link.send_setpoint(self._parts.rig.now_s(), left_rad_s, right_rad_s)

    def _note(self, kind: str, text: str) -> None:
        self._parts.timeline.event(self._parts.rig.now_s(), kind, text)

    def _record(
        self, now_s: float, command: OuterCommand, wheels: tuple[float, float], late: bool
    ) -> None:
        """Append the row of this tick; estimate, truth and reference are those of `now_s`."""
        parts, link = self._parts, self._parts.link
        t_s = now_s - self._t0_s
        parts.recorder.append(
            sample_row(
                t_s=t_s,
                estimate=parts.estimator.estimate_at(now_s),
                truth=parts.rig.truth(),
                goal_m=parts.reference.at(t_s).z1_m,
                command=command,
                wheels_rad_s=wheels,
                report=self._report,
                latency=(
                    self._seen,
                    self._accepted,
                    self._measurement.quality if self._measurement else math.nan,
                    self._camera_latency_s,
                    now_s + self._uplink_s - self._pose_time_s,
                ),
                link=link,
                late=late,
                own_terms=parts.own_terms,
            )
        )
        self._seen = self._accepted = False
