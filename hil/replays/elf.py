"""A replay's inputs through the firmware's ELF on the simulated ATmega2560, which target `pil` uses.

Frames come in on the UART at its own pace, counts as edges on the encoder pins, and PWM is read off
the timers: nothing between the pins is replaced.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hil.board._firmware import PWM_TOP, TICK_US
from hil.board.build import build
from hil.core.errors import BadInput, RigFault
from hil.replays.firmware import Firmware
from hil.wire import dialect
from hil.wire.framing import FrameReader, FrameWriter

if TYPE_CHECKING:
    from hil.replays.firmware import Sent, Tick
    from sim_twin import _pil

    Pwm = list[tuple[int, int]]

_UP_US = 100_000  # the board is up 35 ms after power-up
# Its clock is asked at five places of a tick: a question that comes while a tick is at work is stamped late.
_ASKED_US = tuple(range(120_000, 170_000, 10_800))
_ANSWERED_US = 200_000
# A step of the pins ends this much before the tick, so that its last edge is counted by then.
_LEAD_US = 150
# A frame stamped behind a tick comes at least this much behind it: the board looks for bytes between
# waking up and the tick, and would take it into that tick.
_BEHIND_US = 50
_BATTERY_V = 12.0  # as the core's binding has it
_AB = (0b00, 0b10, 0b11, 0b01)  # lines of an encoder over a period, forward


def elf() -> Firmware:
    """Return the ELF under simavr as a firmware to replay wheels with.

    Raises BadInput in one line, with the packages to install, where simavr or avr-gcc is missing.
    """
    from sim_twin.pil import pil_is_missing  # noqa: PLC0415 - only the ELF needs the twin

    missing = pil_is_missing()
    if missing:
        raise BadInput(f"replay through the ELF cannot run here: {missing}")
    made = build()
    return Firmware("elf", made.build_id, lambda frames, ticks: elf_pwm(made.elf, frames, ticks))


def elf_pwm(elf: Path, frames: Sequence[Sent], ticks: Sequence[Tick]) -> Pwm:
    """Return the PWM (left, right) in counts that the ELF sets at each tick."""
    from hil.config.link import UART_BAUD  # noqa: PLC0415 - as above
    from sim_twin.pil import pil_module  # noqa: PLC0415 - as above

    board = pil_module()(str(elf), "1", 0.0, b"")
    board.power_up()
    first_us = _time_of_a_tick(board)
    stamps = np.array([tick.t_us for tick in ticks]) - ticks[0].t_us
    numbers = np.rint(stamps / TICK_US).astype(int)
    # A tick's stamp is late by what the processor was busy with; frames are timed by the usual one.
    zero_us = ticks[0].t_us + round(float(np.median(stamps - numbers * TICK_US)))
    for item in _on_the_line(frames, 10 * 1e6 / UART_BAUD):  # start bit, 8 bits, stop bit
        behind_us = (item.t_us - zero_us) % TICK_US
        held_us = _BEHIND_US - behind_us if 0 < behind_us < _BEHIND_US else 0
        board.receive(first_us + item.t_us - zero_us + held_us, item.frame)
    times = [*(first_us + numbers * TICK_US).tolist(), first_us + int(numbers[-1] + 1) * TICK_US]
    pwm = []
    for (tick, after), (begin, end) in zip(
        pairwise([*ticks, ticks[-1]]), pairwise(times), strict=True
    ):
        for side in (0, 1):
            moved = after.counts[side] - tick.counts[side]
            _turn(board, side, tick.counts[side] - ticks[0].counts[side], moved, (begin, end))
        board.advance_to(end - _LEAD_US, _BATTERY_V)
        pwm.append((round(PWM_TOP * board.duty(0)), round(PWM_TOP * board.duty(1))))
    return pwm


def _on_the_line(frames: Sequence[Sent], byte_us: float) -> list[Sent]:
    """Return the frames with room on the wire: nothing holds up a set-point, whose time is known.

    A frame that would overlap a set-point behind it comes earlier. One that overlaps what is before
    it comes later, which the simulated UART sees to.
    """
    placed: list[Sent] = []
    latest_us = frames[-1].t_us
    for item in reversed(frames):
        moved = item._replace(t_us=min(item.t_us, latest_us))
        msg_id = int.from_bytes(item.frame[7:10], "little")
        if msg_id == dialect.MAVLINK_MSG_ID_WHEEL_SETPOINT or moved.t_us < item.t_us:
            latest_us = moved.t_us - math.ceil(len(item.frame) * byte_us)
        placed.append(moved)
    return placed[::-1]


def _turn(
    board: _pil.Board, side: int, counts: int, moved: int, between_us: tuple[int, int]
) -> None:
    """Spread the edges of `moved` counts evenly over the time between two ticks."""
    begin, end = between_us
    step = 1 if moved > 0 else -1
    for i in range(1, abs(moved) + 1):
        at_us = begin + (end - begin - 2 * _LEAD_US) * i / abs(moved)
        board.edge(at_us, side, _AB[(counts + i * step) % 4])


def _time_of_a_tick(board: _pil.Board) -> int:
    """Return the next tick's true time in us; the board says by TIMESYNC what its clock shows.

    Its clock shows multiples of TICK_US at its ticks.
    """
    board.advance_to(_UP_US, _BATTERY_V)
    writer = FrameWriter()
    for asked_us in _ASKED_US:
        board.receive(asked_us, writer.encode(dialect.MAVLink_timesync_message(0, asked_us)))
    board.advance_to(_ANSWERED_US, _BATTERY_V)
    reader = FrameReader()
    zeros_us = [
        int(message.ts1) - int(message.tc1) // 1000
        for _, chunk in board.take_sent()
        for msg_id, message, _ in reader.feed(chunk)
        if msg_id == dialect.MAVLINK_MSG_ID_TIMESYNC
    ]
    if zeros_us:
        zero_us = max(zeros_us)  # the one that was stamped soonest
        return zero_us - (zero_us - _ANSWERED_US) // TICK_US * TICK_US
    raise RigFault(
        "the ELF gave no answer to TIMESYNC within 30 ms; build it anew: hil firmware build"
    )
