"""Wheels driven by duty alone, over the wire as it is.

The board takes wheel speeds only, but with its PID law at zero gains and no Coulomb feed-forward
what is left is duty = FF_GAIN x set-point. The supervisor stays on guard: silence, stall, encoder
noise and battery stop the wheels as ever; only the checks that a set-point which is no speed would
trip are moved aside. Nothing is stored: the parameters are put back at the end, and a reset does so
too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from hil.core.errors import RigFault
from hil.core.rig import Rig
from hil.core.wording import past
from hil.wire import handshake, identity
from hil.wire.link import BoardLink, WheelReport

# Duty from which the board takes a wheel without counts for stalled; slow drives stay below it.
STALL_DUTY = 0.5
_DUTY_S_RAD = 0.05
OPEN_LOOP = {
    "LAW": 1.0,
    "PID_KP": 0.0,
    "PID_KI": 0.0,
    "PID_KD": 0.0,
    "FF_GAIN": _DUTY_S_RAD,
    "FF_DEAD": 0.0,
    "W_MAX": 1.0 / _DUTY_S_RAD,  # a set-point of W_MAX is full duty
    "PWM_MAX": 1.0,
    "STALL_DUTY": STALL_DUTY,
    "STALL_MS": 500.0,
    "STALL_W": 60.0,  # set-points are no speeds here
    "RUN_MS": 10_000.0,  # without feedback nothing runs away
    "OVER_W": 60.0,  # free wheels at full duty may pass a limit set for the floor
}
_PERIOD_S = 1.0 / 30.0
_SILENCE_S = 0.5
_REST_COUNTS = 3
_REST_TIMEOUT_S = 4.0
_ARM_TIMEOUT_S = 1.0

# Duty of left and right as a function of the time since the drive began.
Profile = Callable[[float], tuple[float, float]]


class BoardStopped(RigFault):
    """The board left ARMED by itself while the wheels were driven."""


class OpenLoop:
    """Arms, drives by duty, and stops whatever happens."""

    def __init__(self, rig: Rig, link: BoardLink) -> None:
        self._rig = rig
        self._link = link
        self._before: dict[str, float] = {}

    @property
    def pwm_top(self) -> int:
        """PWM counts at full duty, as the board said."""
        return int(self._link.info.pwm_top_counts)

    def now_s(self) -> float:
        """Return the rig's clock."""
        return self._rig.now_s()

    @property
    def battery_v(self) -> float:
        """Battery voltage last heard; NaN before the first."""
        return self._link.battery_v

    def prepare(self) -> None:
        """Set the parameters of open loop, keeping what they were."""
        self._before = {name: self._link.parameters[name] for name in OPEN_LOOP}
        self._set(OPEN_LOOP)

    def restore(self) -> None:
        """Put the parameters back; raises RigFault when the board does not answer."""
        self._set(self._before)

    def _set(self, values: dict[str, float]) -> None:
        for name, value in values.items():
            handshake.finish(
                self._link, self._rig, handshake.set_parameter(self._link, name, value)
            )

    def pump(self, seconds: float) -> list[WheelReport]:
        """Let time pass; return the wheel reports of that while."""
        rig, reports = self._rig, list[WheelReport]()
        until_s = rig.now_s() + seconds
        while rig.now_s() < until_s:
            rig.wait(until_s)
            reports += self._link.poll(rig.now_s())
            while rig.poll_frame() is not None:
                pass  # pictures play no part here
        return reports

    def fresh(self) -> WheelReport:
        """Return a wheel report of now; raises RigFault when none comes."""
        for _ in range(10):
            if reports := self.pump(0.1):
                return reports[-1]
        raise RigFault("link: no wheel report for 1 s")

    @contextmanager
    def armed(self) -> Iterator[None]:
        """Arm for a while; the wheels are off afterwards however it ends, and stand if it went well."""
        self._wait_for_rest()
        try:
            self._arm()
            yield
        except BaseException:
            self.emergency()
            raise
        self.stop()
        self._wait_for_rest()

    def _arm(self) -> None:
        rig, link = self._rig, self._link
        hashes = identity.board_hashes(link.parameters)
        handshake.finish(link, rig, handshake.arm(link, *hashes))
        until_s = rig.now_s() + _ARM_TIMEOUT_S
        while not link.armed:  # the report that says so is on its way
            if rig.now_s() >= until_s:
                raise RigFault(f"board: acknowledged arming and stayed {link.state_name}")
            self._send((0.0, 0.0))
            self.pump(_PERIOD_S)

    def _wait_for_rest(self) -> None:
        until_s = self._rig.now_s() + _REST_TIMEOUT_S
        while (reports := self.pump(0.2)) and any(
            abs(a - b) > _REST_COUNTS
            for a, b in zip(counts(reports[0]), counts(reports[-1]), strict=True)
        ):
            if self._rig.now_s() > until_s:
                raise RigFault(
                    f"board: wheels still turn {_REST_TIMEOUT_S:.0f} s after the stop; "
                    "cut the motors' supply"
                )

    def stop(self) -> None:
        """Stop the wheels and disarm; an emergency stop where the board does not answer."""
        try:
            self._send((0.0, 0.0))
            handshake.finish(self._link, self._rig, handshake.disarm(self._link))
        except BaseException:
            self.emergency()
            raise

    def emergency(self) -> None:
        """Send the emergency stop; the board's own time-out stands behind it."""
        self._link.stop_now(self._rig.now_s())

    def drive(
        self,
        profile: Profile,
        seconds: float,
        done: Callable[[list[WheelReport]], bool] | None = None,
    ) -> list[WheelReport]:
        """Follow a profile of duty while armed, for `seconds` or until `done`; return the reports.

        Raises BoardStopped when the board stops by itself, RigFault when it falls silent.
        """
        begin_s = heard_s = self._rig.now_s()
        reports: list[WheelReport] = []
        while (t_s := self._rig.now_s() - begin_s) < seconds:
            self._send(profile(t_s))
            new = self.pump(_PERIOD_S)
            reports += new
            heard_s = new[-1].t_arrival_s if new else heard_s
            self._check(self._rig.now_s() - heard_s)
            if done is not None and done(reports):
                break
        return reports

    def _check(self, silent_s: float) -> None:
        link = self._link
        if not link.armed:
            said = f": {link.texts[-1].text}" if link.texts else ""
            raise BoardStopped(f"board: left ARMED by itself: {link.state_name}{said}")
        if silent_s > _SILENCE_S:
            raise RigFault(
                f"link: no wheel report for {past(silent_s, _SILENCE_S, '.2f')} s "
                f"(limit {_SILENCE_S:g} s)"
            )

    def _send(self, duty: tuple[float, float]) -> None:
        left, right = (max(-1.0, min(1.0, value)) / _DUTY_S_RAD for value in duty)
        self._link.send_setpoint(self._rig.now_s(), left, right)


def counts(report: WheelReport) -> tuple[int, int]:
    """Return the counters of a report, (left, right)."""
    return report.sample.counts_left, report.sample.counts_right


def duty_of(report: WheelReport, pwm_top: int) -> tuple[float, float]:
    """Return the duty a report shows, (left, right)."""
    return report.wire.pwm_left_counts / pwm_top, report.wire.pwm_right_counts / pwm_top


def speed_rad_s(
    reports: list[WheelReport], side: int, counts_per_turn: float, window_s: float
) -> float:
    """Return the mean speed of a side over the last `window_s`, from counts and board time."""
    last = reports[-1]
    for first in reversed(reports):
        span_s = ((last.wire.t_mcu_us - first.wire.t_mcu_us) & 0xFFFF_FFFF) * 1e-6
        if span_s >= window_s:
            turns = (counts(last)[side] - counts(first)[side]) / counts_per_turn
            return 2.0 * math.pi * turns / float(span_s)
    return 0.0
