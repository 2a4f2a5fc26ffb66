"""The host's end of the link: frames to values, set-points out, clocks tied, board brought up.

Nothing here blocks or reads a clock: `poll(t_host_s)` takes what has arrived, runs the timers and
moves the procedure under way (hil.wire.handshake) one step on, the same in virtual and in wall time.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any

from hil.core.errors import RigFault
from hil.core.rig import ByteStream, discard_unsent
from hil.wire import _wire, dialect
from hil.wire.framing import FrameWriter, decode
from hil.wire.messages import command_message

Tap = Callable[[float, bytes], None]
# Gives the host time by which it is to be asked again should nothing come that it may look at: a message, a
# heartbeat, or a frame that is signed. To be asked oftener changes nothing.
Procedure = Generator[float, None, None]


@dataclass(frozen=True, slots=True)
class StatusText:
    """One line the board said, with its MAV_SEVERITY (0 emergency to 7 debug)."""

    t_host_s: float
    severity: int
    text: str


# One WHEEL_STATE: `t_arrival_s`, the `sample` for the estimator, the message as it came (`wire`), and the
# `round_trip_s` of the link alone: from sending the set-point it names to this report's arrival, less the
# time both lay on the board; NaN when the report names no new set-point.
WheelReport = _wire.WheelReport


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
        self.native = _wire.Link()
        self._writer = FrameWriter(native=self.native.writer)
        self.t_s = -math.inf
        self._procedure: Procedure | None = None
        self.acks: dict[int, int] = {}
        self._handlers: dict[int, Callable[[Any], None]] = {
            dialect.MAVLINK_MSG_ID_STATUSTEXT: self._on_statustext,
            dialect.MAVLINK_MSG_ID_COMMAND_ACK: self._on_command_ack,
            dialect.MAVLINK_MSG_ID_BOARD_INFO: self._on_board_info,
        }
        self.clock = self.native.clock
        self.counters = self.native.counters
        self.info: Any = None
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
        return bool(self.native.state == dialect.HIL_STATE_ARMED)

    @property
    def disarmed(self) -> bool:
        """True while the board last said it was disarmed, as it is when it starts."""
        return bool(self.native.state == dialect.HIL_STATE_DISARMED)

    @property
    def frames_sent(self) -> int:
        """Frames sent so far."""
        return self.native.frames_sent

    @property
    def heartbeats(self) -> int:
        """Heartbeats of the board heard so far."""
        return self.native.heartbeats

    @property
    def sys_status(self) -> Any:
        """The last SYS_STATUS, None before the first or after `forget_sys_status`."""
        frame = self.native.sys_status
        return decode(dialect.MAVLINK_MSG_ID_SYS_STATUS, frame) if frame else None

    def forget_sys_status(self) -> None:
        """Let `sys_status` be None until the next one comes."""
        self.native.forget_sys_status()

    @property
    def battery_v(self) -> float:
        """Battery voltage of the last SYS_STATUS; NaN before the first."""
        return self.native.battery_v

    @property
    def loss_ratio(self) -> float:
        """Share of the board's frames that did not arrive whole, from their sequence numbers."""
        sent = self.counters.frames + self.counters.lost
        return self.counters.lost / sent if sent else 0.0

    @property
    def state_name(self) -> str:
        """State and reason in words: "ARMED", "SAFE (SETPOINT_TIMEOUT)"."""
        state, reason = enum_name("HIL_STATE", self.native.state), self.native.reason
        if reason == dialect.HIL_REASON_NONE:
            return state
        return f"{state} ({enum_name('HIL_REASON', reason)})"

    def poll(self, t_host_s: float) -> Sequence[WheelReport]:
        """Take what has arrived by `t_host_s`, run what is due; return new wheel reports."""
        self.t_s = t_host_s
        data = self._stream.read()
        reports: Sequence[WheelReport] = self._take(data, t_host_s) if data else ()
        if self.native.due(t_host_s):
            for frame in self.native.timer_frames(t_host_s):
                self._write(frame, t_host_s)
        self.step()
        return reports

    def step(self) -> None:
        """Move the procedure under way one step on."""
        if self._procedure is not None:
            try:
                self.native.rest_until(next(self._procedure))
            except StopIteration:
                self._procedure = None
            except RigFault:
                self._procedure = None
                raise

    def send_setpoint(
        self, t_host_s: float, omega_left_rad_s: float, omega_right_rad_s: float
    ) -> None:
        """Send wheel speeds (positive drives forward)."""
        self._write(self.native.setpoint(t_host_s, omega_left_rad_s, omega_right_rad_s), t_host_s)

    def begin(self, procedure: Procedure) -> None:
        """Let `poll` carry a procedure out, one step a call; it replaces one under way."""
        self._procedure = procedure
        self.native.rest_until(-math.inf)

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
        reports, others = self.native.take(data, t_s, self._tap)
        for msg_id, frame in others:
            self.heard(msg_id, frame)
        return reports

    def heard(self, msg_id: int, frame: bytes) -> None:
        """Take a message that only procedures and people need."""
        if msg_id == dialect.MAVLINK_MSG_ID_PARAM_VALUE:  # some sixty of them before a run
            self._on_param_value(*_wire.parameter(frame))
            return
        handler = self._handlers.get(msg_id)
        if handler is not None:
            handler(decode(msg_id, frame))

    def _on_statustext(self, message: Any) -> None:
        self.texts.append(StatusText(self.t_s, message.severity, message.text))
        self.texts_heard += 1

    def _on_param_value(self, name: str, value: float, count: int, index: int) -> None:
        self.parameters[name] = value
        self.parameter_count = count
        self.parameter_names[index] = name

    def _on_command_ack(self, message: Any) -> None:
        self.acks[message.command] = message.result

    def _on_board_info(self, message: Any) -> None:
        self.info = message

    # -- frames out ----------------------------------------------------------------------------

    def _write(self, frame: bytes, t_s: float) -> None:
        self._stream.write(frame)
        self.native.frames_sent += 1
        if self._tap is not None:
            self._tap(t_s, frame)

    def send(self, message: dialect.MAVLink_message) -> None:
        """Send any message of the dialect at the time of the last poll."""
        self._write(self._writer.encode(message), self.t_s)

    def send_command(self, command: int, confirmation: int, *params: float) -> None:
        """Send a COMMAND_LONG; parameters not given are 0."""
        self.send(command_message(command, *params, confirmation=confirmation))

    def request_parameter(self, index: int) -> None:
        """Ask the board for the parameter with this index."""
        self._write(self.native.writer.parameter_request(index), self.t_s)

    def ask_time(self, t_s: float) -> None:
        """Ask for the board's time; the answer is one more exchange of `clock`."""
        self._write(self.native.ask_time(t_s), self.t_s)
