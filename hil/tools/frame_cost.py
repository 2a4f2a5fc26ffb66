"""What one frame from the host costs the processor, and what a flood of them does to the ticks.

Measured on the ELF under simavr: time awake with twenty of a kind a second, less that without.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from hil.board import _firmware
from hil.wire import dialect, handshake
from hil.wire.framing import BOARD_COMPONENT, BOARD_SYSTEM
from hil.wire.link import BoardLink
from hil.wire.messages import set_parameter_message
from sim_twin.pil import Pil

_RATE_HZ = 20
# What 57,600 baud carry; a PARAM_SET has 37 bytes without its signature.
_LINE_BYTES_S, _SET_BYTES = 5_760, 37
_STEP_S = 1.0 / 30.0
_SPEED_RAD_S = 5.0

Say = Callable[[BoardLink, int], None]


def _set(name: str, value: float, change: float = 0.0) -> Say:
    """Set a parameter; a `change` makes every second one another value."""

    def say(link: BoardLink, count: int) -> None:
        link.send(set_parameter_message(name, value + change * (count % 2)))

    return say


def _read(name: str, index: int) -> Say:
    message = dialect.MAVLink_param_request_read_message(
        BOARD_SYSTEM, BOARD_COMPONENT, name.encode(), index
    )
    return lambda link, _: link.send(message)


def _kinds() -> dict[str, Say]:
    last = _firmware.parameter_table()[-1]
    return {
        "PARAM_SET, in force": _set(last.name, last.default),
        "PARAM_SET, a change": _set("PID_KD", 0.00003, 0.00001),
        "PARAM_REQUEST_READ, unknown name": _read("NO_SUCH", -1),
        "PARAM_REQUEST_READ, by index": _read("", 7),
        "COMMAND_LONG, unknown": lambda link, _: link.send_command(22, 0, 1.0),
    }


@dataclass(frozen=True, slots=True)
class FrameCost:
    """`us` is processor time a frame, parse, answer and serial interrupts included.

    A flood is a PARAM_SET at line rate: `overruns` are the ticks it made late, armed and driving under
    changes and disarmed under orders to take the defaults, `bad_frames` those it cost. `latest_us` is how
    much after its time a tick began at the most, of the fifth of them that are reported.
    """

    us: dict[str, float]
    latest_us: int
    overruns: int
    bad_frames: int

    @property
    def costliest_us(self) -> float:
        """The most that one frame costs."""
        return max(self.us.values())


class _Flooded:
    """A board that is driven at a constant speed while somebody else talks to it."""

    def __init__(self, rig: Pil, link: BoardLink) -> None:
        self.rig, self.link = rig, link
        self.latest_us = 0

    def drive(self, seconds: float, say: Say | None = None, rate_hz: int = _RATE_HZ) -> float:
        """Drive, with frames at `rate_hz`; return the processor's time awake in s."""
        before = self._awake()
        begin_s = self.rig.now_s()
        said = 0
        for step in range(round(seconds / _STEP_S)):
            if self.link.armed:
                self.link.send_setpoint(self.rig.now_s(), _SPEED_RAD_S, _SPEED_RAD_S)
            end_s = begin_s + (step + 1) * _STEP_S
            while say is not None and (due_s := begin_s + said / rate_hz) < end_s:
                self._listen(due_s)
                say(self.link, said)
                said += 1
            self._listen(end_s)
        return self._awake() - before

    def counts(self) -> tuple[int, int]:
        """Return the board's (overruns, bad frames)."""
        self.link.forget_sys_status()
        while self.link.sys_status is None:
            self.drive(_STEP_S)
        return self.link.sys_status.errors_count1, self.link.sys_status.errors_comm

    def _awake(self) -> float:
        usage = self.rig.board.usage()
        return float(usage["cycles"] - usage["asleep"]) / 16e6

    def _listen(self, until_s: float) -> None:
        while self.rig.now_s() < until_s:
            self.rig.wait(until_s)
            for report in self.link.poll(self.rig.now_s()):
                self.latest_us = max(self.latest_us, report.wire.t_mcu_us % _firmware.TICK_US)


def measure_frames(rig: Pil, link: BoardLink, block_bytes: int = 0) -> FrameCost:
    """Measure on a board that is armed; leaves it disarmed with the defaults in force.

    `block_bytes` come with every frame for its signature.
    """
    bench = _Flooded(rig, link)
    bench.drive(1.0)
    alone_s = bench.drive(1.0)
    us = {
        name: 1e6 * (bench.drive(1.0, say) - alone_s) / _RATE_HZ for name, say in _kinds().items()
    }
    before = bench.counts()
    flood_hz = _LINE_BYTES_S // (_SET_BYTES + block_bytes)
    bench.drive(2.0, _set("PID_KD", 0.00003, 0.00001), flood_hz)
    bench.counts()  # what is still on the line comes in meanwhile
    handshake.finish(link, rig, handshake.disarm(link))
    storage = dialect.MAV_CMD_PREFLIGHT_STORAGE
    bench.drive(1.0, lambda link, _: link.send_command(storage, 0, 2.0), 100)
    bench.drive(1.0)
    after = bench.counts()
    return FrameCost(us, bench.latest_us, after[0] - before[0], after[1] - before[1])
