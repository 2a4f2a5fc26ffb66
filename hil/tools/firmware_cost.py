"""What the firmware costs its processor: cycles, load, memory, measured on the ELF under simavr."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from hil.board import _firmware
from hil.board._firmware import stored_key
from hil.board.build import FLASH_LIMIT_BYTES, RAM_LIMIT_BYTES, build
from hil.board.stack_bound import stack_bound
from hil.config.camera import CameraConfig
from hil.config.link import LinkConfig
from hil.config.robot import RobotConfig
from hil.core.types import Pose
from hil.rigs.signed import SignedStream
from hil.tools.frame_cost import FrameCost, measure_frames
from hil.wire import handshake
from hil.wire.link import BoardLink
from hil.wire.signing import BLOCK_BYTES, Key
from sim_twin.pil import Pil
from sim_twin.pil_profile import part_map
from sim_twin.twin import TwinSetup

CLOCK_HZ = 16_000_000
TICKS_PER_S = 1_000_000 // _firmware.TICK_US
FULL_EDGES_1_S = 8_000
_ENCODER_VECTORS = (1, 2, 5, 6)
_SETPOINT_S = 1.0 / 30.0
_FULL_SPEED_RAD_S = 10.0
_TICK_AND_LINK = ("tick", "link", "serial")

Speeds = Callable[[float], tuple[float, float]]


@dataclass(frozen=True, slots=True)
class FirmwareCost:
    """Cycles are those of the 16 MHz processor, ratios are shares of its time.

    `cycles_per_tick` is the mean by part under set-points that change at 30 Hz, and
    `tick_and_link_ratio` the share of the parts that are the tick or move bytes; `awake_ratio` is
    everything. `stack_bytes` is the deepest met, `stack_bound_bytes` what no path can pass.
    `awake_full_ratio` and `edges_lost` are with 8,000 edges a second on either wheel.
    """

    flash_bytes: int
    ram_bytes: int
    stack_bytes: int
    stack_bound_bytes: int
    cycles_per_tick: dict[str, float]
    tick_and_link_ratio: float
    awake_ratio: float
    awake_full_ratio: float
    longest_tick_us: float
    encoder_interrupt_cycles: int
    interrupts_off_cycles: int
    edges_lost: int
    frames: FrameCost


class Bench:
    """A board brought up on a plain wire and driven by set-points."""

    def __init__(self, robot: RobotConfig, changes: Mapping[str, float], key: Key | None) -> None:
        link = LinkConfig(latency_s=0.0, latency_jitter_s=0.0)
        eeprom = stored_key(key.secret, 0) if key else b""
        setup = TwinSetup(robot, link, CameraConfig(), Pose(0.0, 0.0, 0.0), 1, eeprom=eeprom)
        rig = self.rig = Pil(setup)
        stream = (
            SignedStream(rig.stream, key, lambda: round(1e5 * rig.now_s())) if key else rig.stream
        )
        self.link = BoardLink(stream)
        self.last: Any = None  # WHEEL_STATE
        parameters = {entry.name: entry.default for entry in _firmware.parameter_table()}
        parameters["ENC_COUNTS"] = float(robot.encoder_counts_per_turn)
        parameters.update(changes)
        handshake.finish(self.link, self.rig, handshake.connect(self.link, parameters))
        info = self.link.info
        arming = handshake.arm(self.link, info.dialect_hash, info.parameter_hash)
        handshake.finish(self.link, self.rig, arming)

    def drive(self, seconds: float, speeds: Speeds) -> float:
        """Send the set-points of `speeds` (rad/s over s) for a while; return the share awake."""
        before = self.rig.board.usage()
        begin_s = self.rig.now_s()
        for step in range(round(seconds / _SETPOINT_S)):
            self.link.send_setpoint(self.rig.now_s(), *speeds(step * _SETPOINT_S))
            self.listen(begin_s + (step + 1) * _SETPOINT_S)
        after = self.rig.board.usage()
        return 1.0 - (after["asleep"] - before["asleep"]) / (after["cycles"] - before["cycles"])

    def stop(self) -> None:
        """Disarm and wait until the robot stands."""
        handshake.finish(self.link, self.rig, handshake.disarm(self.link))
        self.listen(self.rig.now_s() + 2.0)

    def listen(self, until_s: float) -> None:
        """Take what the board says until then."""
        while self.rig.now_s() < until_s:
            self.rig.wait(until_s)
            for report in self.link.poll(self.rig.now_s()):
                self.last = report.wire


def _weaving(t_s: float) -> tuple[float, float]:
    """Set-points that neither rest nor repeat, forward and backward."""
    return 6.0 * math.sin(3.0 * t_s) + 0.5 * math.sin(17.0 * t_s), 5.0 * math.cos(2.3 * t_s)


def measure(
    robot: RobotConfig, parameters: Mapping[str, float] | None = None, key: Key | None = None
) -> FirmwareCost:
    """Drive the processor in the loop and look at what it did; takes a few seconds of wall time.

    `parameters` are board parameters that differ from their defaults, `key` is a signing key set on it.
    """
    made, changes = build(), parameters or {}
    bench, parts = Bench(robot, changes, key), part_map(made)
    board = bench.rig.board
    awake_ratio = bench.drive(3.0, _weaving)
    board.start_profile(parts.part_of_word)
    bench.drive(1.0, _weaving)
    by_part, interrupts_off, _ = board.profile()
    board.stop_profile()
    share = {name: count / CLOCK_HZ for name, count in zip(parts.names, by_part, strict=True)}
    interrupts = board.usage()["interrupts"]
    longest_tick_us = 1e-3 * bench.link.sys_status.load * _firmware.TICK_US
    frames = measure_frames(bench.rig, bench.link, BLOCK_BYTES if key else 0)
    full, awake_full_ratio = _full_encoders(robot, changes, key)
    counted = (full.last.left_counts, full.last.right_counts)
    return FirmwareCost(
        flash_bytes=made.flash_bytes,
        ram_bytes=made.ram_bytes,
        stack_bytes=max(board.stack_used, full.rig.board.stack_used),
        stack_bound_bytes=stack_bound(made.elf).total_bytes,
        cycles_per_tick={name: part * CLOCK_HZ / TICKS_PER_S for name, part in share.items()},
        tick_and_link_ratio=sum(v for name, v in share.items() if name.startswith(_TICK_AND_LINK)),
        awake_ratio=awake_ratio,
        awake_full_ratio=awake_full_ratio,
        longest_tick_us=longest_tick_us,
        encoder_interrupt_cycles=max(interrupts[vector][2] for vector in _ENCODER_VECTORS),
        interrupts_off_cycles=interrupts_off,
        edges_lost=sum(abs(a - b) for a, b in zip(counted, full.rig.true_counts, strict=True)),
        frames=frames,
    )


def _full_encoders(
    robot: RobotConfig, changes: Mapping[str, float], key: Key | None
) -> tuple[Bench, float]:
    """Run with finer encoders, 8,000 edges a second at 10 rad/s; return bench and share awake."""
    counts_per_turn = round(FULL_EDGES_1_S * math.tau / _FULL_SPEED_RAD_S)
    fine = robot.model_copy(update={"encoder_counts_per_turn": counts_per_turn})
    bench = Bench(fine, changes, key)
    straight = (_FULL_SPEED_RAD_S, _FULL_SPEED_RAD_S)
    bench.drive(1.0, lambda _: straight)
    awake_ratio = bench.drive(2.0, lambda _: straight)
    bench.stop()
    return bench, awake_ratio


def budgets(cost: FirmwareCost) -> list[tuple[str, float, str, str]]:
    """Return (what, measured, unit, limit) for every figure that has one, and some that have none."""
    return [
        ("tick and link traffic", 100 * cost.tick_and_link_ratio, "%", "<= 40"),
        ("awake in all", 100 * cost.awake_ratio, "%", ""),
        ("awake at 8,000 edges/s a wheel", 100 * cost.awake_full_ratio, "%", ""),
        ("edges lost at that speed", cost.edges_lost, "", "0"),
        ("encoder interrupt", cost.encoder_interrupt_cycles, "cycles", "<= 100"),
        ("longest stretch with interrupts off", cost.interrupts_off_cycles, "cycles", ""),
        ("longest tick", cost.longest_tick_us, "us", "<= 4000"),
        ("costliest frame, all that follows from it", cost.frames.costliest_us, "us", "<= 4000"),
        ("latest begin of a tick in a flood of frames", cost.frames.latest_us, "us", "<= 1000"),
        ("ticks late under a flood of frames", cost.frames.overruns, "", "0"),
        ("flash", cost.flash_bytes, "bytes", f"<= {FLASH_LIMIT_BYTES}"),
        ("static RAM", cost.ram_bytes, "bytes", f"<= {RAM_LIMIT_BYTES}"),
        ("deepest stack", cost.stack_bytes, "bytes", f"<= {cost.stack_bound_bytes}"),
        (
            "stack of the deepest path, interrupt included",
            cost.stack_bound_bytes,
            "bytes",
            "<= 1024",
        ),
    ]
