"""The compiled board behind a byte stream on virtual time, with a link that can be spoilt."""

from __future__ import annotations

import math
from collections.abc import Callable

from hil.board import _firmware
from hil.core.rig import Frame, Truth

Spoil = Callable[[bytes], bytes]
TICK_S = _firmware.TICK_US * 1e-6


class BoardRig:
    """A `Rig` without robot or camera: one compiled board, ticked every 4 ms.

    The wheels answer the PWM as motors of 15 rad/s at full duty, with 12 % of duty lost to friction
    and 80 ms of lag. `down` and `up` may change or drop each chunk. `start_us` is the board's clock
    at time 0.
    """

    def __init__(self, start_us: int = 0) -> None:
        self.board = _firmware.Board()
        self.stream = self
        self.down: Spoil = bytes
        self.up: Spoil = bytes
        self.powered = True
        self.pwm = (0, 0)
        self.bytes_up = self.bytes_down = 0
        self._start_us = start_us
        self._ticks = 0
        self._arrived: list[bytes] = []
        self._angle_rad = [0.0, 0.0]
        self._omega_rad_s = [0.0, 0.0]

    def read(self) -> bytes:
        data = b"".join(self._arrived)
        self._arrived.clear()
        return data

    def write(self, data: bytes) -> None:
        self.bytes_down += len(data)
        data = self.down(data)
        if data and self.powered:
            self.board.receive(data, self._clock_us())
            self._collect()

    def now_s(self) -> float:
        return self._ticks * TICK_S

    def wait(self, until_s: float) -> None:
        """Tick until `until_s`, or until the board has said something."""
        while self.now_s() < until_s and not self._arrived:
            self._tick()

    def reset(self) -> None:
        """Let the board start anew; the wheels and their encoders go on."""
        self.board = _firmware.Board()
        self._start_us = -self._ticks * _firmware.TICK_US

    def _clock_us(self) -> int:
        return (self._start_us + self._ticks * _firmware.TICK_US) % 2**32

    def _tick(self) -> None:
        self._ticks += 1
        for side in (0, 1):
            duty = self.pwm[side] / _firmware.PWM_TOP
            goal_rad_s = math.copysign(max(abs(duty) - 0.12, 0.0) * 15.0 / 0.88, duty)
            self._omega_rad_s[side] += (goal_rad_s - self._omega_rad_s[side]) * TICK_S / 0.08
            self._angle_rad[side] += self._omega_rad_s[side] * TICK_S
        if self.powered:
            counts = [math.floor(a * 1920 / math.tau) for a in self._angle_rad]
            self.pwm = self.board.tick(self._clock_us(), counts[0], counts[1])
            self._collect()

    def _collect(self) -> None:
        data = self.board.transmit()
        self.bytes_up += len(data)
        data = self.up(data)
        if data:
            self._arrived.append(data)

    def poll_frame(self) -> Frame | None:
        return None

    def begin(self, t_start_s: float) -> None:
        pass

    def truth(self) -> Truth | None:
        return None

    def close(self) -> None:
        pass
