"""The host's end of the link: frames to values, set-points out, clocks tied, board brought up.

Nothing here blocks or reads a clock: `poll(t_host_s)` takes what has arrived, runs the timers and
moves the procedure under way (hil.wire.handshake) one step on, the same in virtual and in wall time.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from hil.core.clocks import BoardClock
from hil.core.errors import RigFault
from hil.core.rig import ByteStream, discard_unsent
from hil.core.types import WheelSample
from hil.wire import dialect
from hil.wire.framing import FrameReader, FrameWriter
from hil.wire.messages import command_message

Tap = Callable[[float, bytes], None]
Procedure = Generator[None, None, None]

_TIMESYNC_PERIOD_S = 0.5
# The tie gains most from its first exchanges.
_TIMESYNC_FIRST = 16
_TIMESYNC_FIRST_PERIOD_S = 0.1
_HEARTBEAT_PERIOD_S = 1.0
_SEQ_MASK = 0xFFFF


@dataclass(frozen=True, slots=True)
class StatusText:
    """One line the board said, with its MAV_SEVERITY (0 emergency to 7 debug)."""

    t_host_s: float
    severity: int
    text: str


class WheelReport(NamedTuple):
    """One WHEEL_STATE: the sample for the estimator and the message as it came.

    `round_trip_s` is the link's alone: from sending the set-point it names to this report's
    arrival, less the time both lay on the board; NaN when the report names no new set-point.
    """

    t_arrival_s: float
    sample: WheelSample
    wire: Any
    round_trip_s: float


def enum_name(enum: str, value: int) -> str:
    """Return the name of a value without the enum's own: ("HIL_STATE", 1) is "ARMED"."""
    entry = dialect.enums[enum].get(value)
    return str(entry.name.removeprefix(f"{enum}_")) if entry else str(value)


class BoardLink:
    """Speaks to one board over a byte stream.

    `tap` is given the host time and the bytes of every good frame of both directions. Faults of the rig and
    refusals of the board are raised as RigFault by `poll`.
    """

    def __init__(self, stream: ByteStream, tap: Tap | None = None) -> None:
        self._stream = stream
        self._tap = tap
        self._reader = FrameReader()
        self._writer = FrameWriter()
        self.t_s = -math.inf
        self._procedure: Procedure | None = None
        self._setpoint_seq = 0
        self._setpoint_sent_s: dict[int, float] = {}
        self._echoed_seq = 0
        self._timer_due_s = -math.inf
        self._heartbeat_due_s = -math.inf
        self._timesync_due_s = -math.inf
        self._timesync_sent_s: dict[int, float] = {}
        self.acks: dict[int, int] = {}
        self._handlers: dict[int, Callable[[Any], None]] = {
            dialect.MAVLINK_MSG_ID_HEARTBEAT: self._on_heartbeat,
            dialect.MAVLINK_MSG_ID_TIMESYNC: self._on_timesync,
            dialect.MAVLINK_MSG_ID_SYS_STATUS: self._on_sys_status,
            dialect.MAVLINK_MSG_ID_STATUSTEXT: self._on_statustext,
            dialect.MAVLINK_MSG_ID_PARAM_VALUE: self._on_param_value,
            dialect.MAVLINK_MSG_ID_COMMAND_ACK: self._on_command_ack,
            dialect.MAVLINK_MSG_ID_BOARD_INFO: self._on_board_info,
        }
        self.clock = BoardClock()
        self.counters = self._reader.counters
        self.frames_sent = 0
        self.heartbeats = 0
        self.state = dialect.HIL_STATE_DISARMED
        self.reason = dialect.HIL_REASON_NONE
        self.info: Any = None
        self.sys_status: Any = None
        self.parameters: dict[str, float] = {}
        self.parameter_count = 0
        self.parameter_names: dict[int, str] = {}
        self.texts: deque[StatusText] = deque(maxlen=100)
        self.texts_heard = 0  # in all; `texts` keeps the last of them

    # -- what a caller asks ------------------------------------------------------------------

    @property
    def busy(self) -> bool:
        """True while a procedure (hil.wire.handshake) is under way."""
        return self._procedure is not None

    @property
    def armed(self) -> bool:
        """True while the board last said it was armed."""
        return bool(self.state == dialect.HIL_STATE_ARMED)

    @property
    def disarmed(self) -> bool:
        """True while the board last said it was disarmed, as it is when it starts."""
        return bool(self.state == dialect.HIL_STATE_DISARMED)

    @property
    def battery_v(self) -> float:
        """Battery voltage of the last SYS_STATUS; NaN before the first."""
        return self.sys_status.voltage_battery * 1e-3 if self.sys_status else math.nan

    @property
    def loss_ratio(self) -> float:
        """Share of the board's frames that did not arrive whole, from their sequence numbers."""
        sent = self.counters.frames + self.counters.lost
        return self.counters.lost / sent if sent else 0.0

    @property
    def state_name(self) -> str:
        """State and reason in words: "ARMED", "SAFE (SETPOINT_TIMEOUT)"."""
        state = enum_name("HIL_STATE", self.state)
        if self.reason == dialect.HIL_REASON_NONE:
            return state
        return f"{state} ({enum_name('HIL_REASON', self.reason)})"

    def poll(self, t_host_s: float) -> Sequence[WheelReport]:
        """Take what has arrived by `t_host_s`, run what is due; return new wheel reports."""
        self.t_s = t_host_s
        data = self._stream.read()
        reports: Sequence[WheelReport] = self._take(data, t_host_s) if data else ()
        if t_host_s >= self._timer_due_s:
            self._run_timers(t_host_s)
        if self._procedure is not None:
            try:
                next(self._procedure)
            except StopIteration:
                self._procedure = None
            except RigFault:
                self._procedure = None
                raise
        return reports

    def send_setpoint(
        self, t_host_s: float, omega_left_rad_s: float, omega_right_rad_s: float
    ) -> None:
        """Send wheel speeds (positive drives forward)."""
        self._setpoint_seq = seq = (self._setpoint_seq + 1) & _SEQ_MASK
        self._setpoint_sent_s[seq] = t_host_s
        if len(self._setpoint_sent_s) > 128:
            del self._setpoint_sent_s[next(iter(self._setpoint_sent_s))]
        self._write(
            self._writer.encode_setpoint(omega_left_rad_s, omega_right_rad_s, seq), t_host_s
        )

    def begin(self, procedure: Procedure) -> None:
        """Let `poll` carry a procedure out, one step a call; it replaces one under way."""
        self._procedure = procedure

    def stop_now(self, t_host_s: float) -> None:
        """Send an emergency stop three times without waiting; for the way out of a fault.

        What the port still holds is forgotten, so that nothing goes before it. The board's own
        time-out stops the wheels should none arrive.
        """
        self._procedure = None
        self.t_s = t_host_s
        try:
            discard_unsent(self._stream)
            for count in range(3):
                self.send_command(dialect.MAV_CMD_DO_FLIGHTTERMINATION, count, 1.0)
        except RigFault:
            return  # the port is gone: what is left is the board's time-out

    # -- frames in -----------------------------------------------------------------------------

    def _take(self, data: bytes, t_s: float) -> list[WheelReport]:
        reports = []
        for msg_id, message, frame in self._reader.feed(data):
            if self._tap is not None:
                self._tap(t_s, frame)
            if msg_id == dialect.MAVLINK_MSG_ID_WHEEL_STATE:
                reports.append(self._on_wheel_state(message))
            else:
                handler = self._handlers.get(msg_id)
                if handler is not None:
                    handler(message)
        return reports

    def _on_wheel_state(self, wire: Any) -> WheelReport:
        t_s = self.t_s
        self.state, self.reason = wire.state, wire.reason
        round_trip_s = math.nan
        if wire.setpoint_seq != self._echoed_seq:
            self._echoed_seq = wire.setpoint_seq
            sent_s = self._setpoint_sent_s.get(wire.setpoint_seq)
            if sent_s is not None:
                rest_us = (wire.t_mcu_us - wire.t_setpoint_us) & 0xFFFF_FFFF
                round_trip_s = t_s - sent_s - rest_us * 1e-6
        self.clock.report(wire.t_mcu_us, t_s)
        t_board_s = self.clock.to_host_s(wire.t_mcu_us) if self.clock.ready else t_s
        sample = WheelSample(
            t_board_s,
            wire.left_counts,
            wire.right_counts,
            wire.omega_left_rad_s,
            wire.omega_right_rad_s,
        )
        return WheelReport(t_s, sample, wire, round_trip_s)

    def _on_heartbeat(self, _message: Any) -> None:
        self.heartbeats += 1

    def _on_timesync(self, message: Any) -> None:
        sent_s = self._timesync_sent_s.pop(message.ts1, None)
        if sent_s is not None and message.tc1:
            self.clock.exchange(sent_s, self.t_s, message.tc1 // 1000)

    def _on_sys_status(self, message: Any) -> None:
        self.sys_status = message

    def _on_statustext(self, message: Any) -> None:
        self.texts.append(StatusText(self.t_s, message.severity, message.text))
        self.texts_heard += 1

    def _on_param_value(self, message: Any) -> None:
        self.parameters[message.param_id] = message.param_value
        self.parameter_count = message.param_count
        self.parameter_names[message.param_index] = message.param_id

    def _on_command_ack(self, message: Any) -> None:
        self.acks[message.command] = message.result

    def _on_board_info(self, message: Any) -> None:
        self.info = message

    # -- frames out ----------------------------------------------------------------------------

    def _write(self, frame: bytes, t_s: float) -> None:
        self._stream.write(frame)
        self.frames_sent += 1
        if self._tap is not None:
            self._tap(t_s, frame)

    def send(self, message: dialect.MAVLink_message) -> None:
        """Send any message of the dialect at the time of the last poll."""
        self._write(self._writer.encode(message), self.t_s)

    def send_command(self, command: int, confirmation: int, *params: float) -> None:
        """Send a COMMAND_LONG; parameters not given are 0."""
        self.send(command_message(command, *params, confirmation=confirmation))

    def _run_timers(self, t_s: float) -> None:
        if t_s >= self._heartbeat_due_s:
            self._heartbeat_due_s = t_s + _HEARTBEAT_PERIOD_S
            self.send(
                dialect.MAVLink_heartbeat_message(
                    dialect.MAV_TYPE_GCS,
                    dialect.MAV_AUTOPILOT_INVALID,
                    0,
                    0,
                    dialect.MAV_STATE_ACTIVE,
                    3,
                )
            )
        if t_s >= self._timesync_due_s:
            first = self.clock.exchanges < _TIMESYNC_FIRST
            self._timesync_due_s = t_s + (_TIMESYNC_FIRST_PERIOD_S if first else _TIMESYNC_PERIOD_S)
            self.ask_time(t_s)
        self._timer_due_s = min(self._heartbeat_due_s, self._timesync_due_s)

    def ask_time(self, t_s: float) -> None:
        """Ask for the board's time; the answer is one more exchange of `clock`."""
        ts1_ns = round(t_s * 1e9)
        if len(self._timesync_sent_s) > 31:  # replies that never came
            del self._timesync_sent_s[next(iter(self._timesync_sent_s))]
        self._timesync_sent_s[ts1_ns] = t_s
        self.send(dialect.MAVLink_timesync_message(0, ts1_ns))
