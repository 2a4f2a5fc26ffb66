"""A bench for the firmware core: a board stepped through time by hand, and a wheel that turns."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from hil.board import _firmware
from hil.wire import dialect, identity
from hil.wire.framing import FrameReader, FrameWriter

TICK_S = _firmware.TICK_US * 1e-6
COUNTS_PER_TURN = 1920
COUNT_RAD = 2.0 * math.pi / COUNTS_PER_TURN
UINT32 = 0xFFFF_FFFF


def rms(values: Iterable[float]) -> float:
    """Root of the mean square."""
    squares = [value * value for value in values]
    return math.sqrt(sum(squares) / len(squares))


class Motor:
    """First-order wheel drive: `gain` rad/s per duty, `tau_s`, Coulomb friction and a load in duty."""

    def __init__(
        self, gain: float = 17.0, tau_s: float = 0.08, dead: float = 0.12, angle_rad: float = 1e-4
    ) -> None:
        self.gain, self.tau_s, self.dead = gain, tau_s, dead
        self.omega_rad_s, self.angle_rad, self.load = 0.0, angle_rad, 0.0

    def turn(self, pwm: int, span_s: float = TICK_S, parts: int = 8) -> None:
        """Let the motor run under `pwm` counts for `span_s`."""
        drive = pwm / _firmware.PWM_TOP - self.load
        step_s = span_s / parts
        for _ in range(parts):
            if self.omega_rad_s == 0.0 and abs(drive) <= self.dead:
                continue
            way = math.copysign(1.0, self.omega_rad_s or drive)
            rate = (self.gain * (drive - self.dead * way) - self.omega_rad_s) / self.tau_s
            faster = self.omega_rad_s + step_s * rate
            stops = self.omega_rad_s * faster < 0.0
            self.omega_rad_s = 0.0 if stops else faster
            self.angle_rad += step_s * self.omega_rad_s

    @property
    def counts(self) -> int:
        """What the encoder shows."""
        return math.floor(self.angle_rad / COUNT_RAD)


class BoardBench:
    """A board, its clock in microseconds (unwrapped), and the host's end of the wire.

    The first tick runs at once, with the encoders at `counts`.
    """

    def __init__(self, t_us: int = 1_000_000, counts: tuple[int, int] = (0, 0)) -> None:
        self.board = _firmware.Board()
        self.t_us = t_us
        self.counts = list(counts)
        self.faults = 0
        self.battery_mv = 12_000
        self.pwm = (0, 0)
        self.seq = 0
        self.sent_bytes = 0
        self.messages: list[Any] = []
        self._writer = FrameWriter()
        self._reader = FrameReader()
        self.tick()

    def send(self, message: Any) -> None:
        """Send one message to the board, arriving now."""
        self.receive(self._writer.encode(message))

    def receive(self, data: bytes) -> None:
        """Let bytes arrive at the board now."""
        self.board.receive(data, self.t_us & UINT32)

    def setpoint(self, left: float, right: float | None = None, seq: int | None = None) -> None:
        """Send a set-point; both sides alike unless `right` is given."""
        self.seq = self.seq + 1 if seq is None else seq
        other = left if right is None else right
        self.send(dialect.MAVLink_wheel_setpoint_message(left, other, self.seq & 0xFFFF))

    def command(self, command: int, *values: float) -> int:
        """Send a command and return the result of its acknowledgement."""
        padded = [*values, *([0.0] * (7 - len(values)))]
        self.messages.clear()
        self.send(dialect.MAVLink_command_long_message(1, 1, command, 0, *padded))
        self.collect()
        acks = [m for m in self.messages if m.get_msgId() == dialect.MAVLINK_MSG_ID_COMMAND_ACK]
        assert [ack.command for ack in acks] == [command]
        return int(acks[0].result)

    def arm(self, dialect_hash: int | None = None, parameter_hash: int | None = None) -> int:
        """Send an arming with the hashes given, the right ones by default; return the result."""
        halves = []
        for own, given in (
            (identity.dialect_hash(), dialect_hash),
            (self.board.parameter_hash, parameter_hash),
        ):
            value = own if given is None else given
            halves += [float(value >> 16), float(value & 0xFFFF)]
        return self.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0, 0.0, *halves)

    def set_param(self, name: str, value: float) -> None:
        """Send PARAM_SET."""
        kind = dialect.MAV_PARAM_TYPE_REAL32
        self.send(dialect.MAVLink_param_set_message(1, 1, name.encode(), value, kind))

    def tick(self, count: int = 1) -> None:
        """Run ticks with the inputs as they stand."""
        for _ in range(count):
            self.pwm = self.board.tick(
                self.t_us & UINT32, *self.counts, self.faults & 0xFFFF, self.battery_mv
            )
            self.t_us += _firmware.TICK_US
            self.collect()

    def run(self, motors: tuple[Motor, Motor], ticks: int, setpoint: float | None = None) -> None:
        """Run ticks with motors on the PWM; with `setpoint`, one is sent every 32 ms."""
        for i in range(ticks):
            if setpoint is not None and i % 8 == 0:
                self.setpoint(setpoint)
            self.counts = [motor.counts for motor in motors]
            self.tick()
            for motor, pwm in zip(motors, self.pwm, strict=True):
                motor.turn(pwm)

    def collect(self) -> None:
        """Take what the board has for the serial port."""
        while data := self.board.transmit():
            self.sent_bytes += len(data)
            self.messages += [_as_message(received) for received in self._reader.feed(data)]

    def of(self, msg_id: int) -> list[Any]:
        """Return the messages of one kind collected since they were last cleared."""
        return [m for m in self.messages if m.get_msgId() == msg_id]

    def texts(self) -> list[str]:
        """Return the status texts collected, after giving the board a second to say them."""
        self.tick(300)
        return [m.text for m in self.of(dialect.MAVLINK_MSG_ID_STATUSTEXT)]


def _as_message(received: Any) -> Any:
    """Return the message as the generated class decodes it."""
    return dialect.MAVLink(None).decode(bytearray(received.frame))
