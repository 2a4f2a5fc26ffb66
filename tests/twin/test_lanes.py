"""Kernels moved on side by side: the bits of each are those it has alone, on every width of registers."""

from __future__ import annotations

import functools
import math
import struct
from random import Random
from typing import Any

import numpy as np
import pytest

from hil.wire.link import BoardLink
from sim_twin import _native
from sim_twin.setup import plant_params
from tests.twin.rigs import Drive, robot

WIDTHS = [width for width in _native.lane_widths() if width > 1]
STEADY = {"motor_per_side", "battery_charge_start_ratio"}


class Tap:
    """A byte stream that keeps what is written to it, and when."""

    def __init__(self, stream: Any, now_s: Any) -> None:
        self.read, self.kept, self._stream, self._now_s = stream.read, [], stream, now_s

    def write(self, data: bytes) -> None:
        self.kept.append((round(1e6 * (self._now_s() - 1000.0)), data))
        self._stream.write(data)


@functools.cache
def coming_up() -> tuple[tuple[int, bytes], ...]:
    """Return the bytes that bring a board up, arm it and let it drive for 0.3 s, with their times in us."""
    drive = Drive()
    tap = Tap(drive.twin.stream, drive.twin.now_s)
    drive.link = BoardLink(tap)
    drive.arm()
    rng = Random(5)
    for _ in range(8):
        drive.run(0.2, rng.uniform(-9, 9), rng.choice((0.0, 0.0, rng.uniform(-9, 9))))
        drive.run(0.1, 0.0, 0.0)
    assert drive.reports[-1].wire.left_counts != 0
    return tuple(tap.kept)


class Case:
    """Kernels drawn from a seed, and what happens to them."""

    def __init__(
        self, seed: int, n: int, *, ulp_of: str = "", wild: bool = True, stiff: bool = False
    ) -> None:
        self.rng = Random(seed)
        self.wild, self.ulp_of, self.stiff = wild, ulp_of, stiff
        self.kernels = [self._kernel(place) for place in range(n)]
        self.log: list[list[bytes]] = [[] for _ in range(n)]
        self.together = self.steps = 0  # steps in lanes, in all

    def _kernel(self, place: int) -> _native.Kernel:
        rng = self.rng
        params = plant_params(robot())
        for name in _native.PARAMETERS:
            if name not in STEADY:
                setattr(params, name, getattr(params, name) * rng.uniform(0.8, 1.25))
        if place == 1 and self.ulp_of:
            setattr(
                params, self.ulp_of, float(np.nextafter(getattr(params, self.ulp_of), math.inf))
            )
        if self.stiff:  # too much so for the step: grows from step to step once it is driven
            params.motor_inductance_h *= 0.02
        params.castor = rng.random() < 0.3
        params.castor_friction_ratio = rng.uniform(0.0, 0.1)
        params.slip = self.wild and rng.random() < 0.1
        params.lifted = self.wild and rng.random() < 0.1
        board = _native.host_board(
            rng.uniform(-200.0, 200.0), rng.randrange(1 << 32), rng.choice((57_600.0, 1e6)), False
        )
        step_us = rng.choice((100, 100, 100, 50, 200))
        kernel = _native.Kernel(params, step_us, rng.choice((1920, 1920, 64, 9000)), board)
        kernel.reset(rng.uniform(-2, 2), rng.uniform(-2, 2), rng.choice((0.3, 2.9, -1e3, 1e9)))
        if rng.random() < 0.9:
            late_us = rng.randrange(5_000)
            for t_us, data in coming_up():
                kernel.receive(t_us + late_us, data)
        if self.wild:
            for _ in range(rng.choice((0, 0, 1, 2))):
                start_s = rng.uniform(-0.1, 0.6)
                kernel.add_disturbance(
                    rng.randrange(len(_native.LOADS)),
                    rng.randrange(len(_native.SHAPES)),
                    rng.uniform(-0.2, 0.2), start_s, start_s + rng.uniform(0.01, 0.5),
                    rng.uniform(0.5, 20.0), rng.uniform(-3, 3), rng.randrange(1 << 32),
                    (0.0, 0.0, rng.choice((0.0, 1.0))),
                )  # fmt: skip
            for _ in range(rng.choice((0, 0, 0, 1, 2))):
                start_s = rng.choice((0.0, rng.uniform(0.0, 0.5)))
                kernel.add_fault(
                    rng.randrange(len(_native.FAULTS)), rng.random() < 0.7, rng.random() < 0.7,
                    start_s, start_s + rng.choice((0.1, 0.3, math.inf)), rng.uniform(0.2, 1.0),
                )  # fmt: skip
            if rng.random() < 0.8:
                kernel.begin(rng.randrange(200_000, 1_500_000))
        return kernel

    def run(self, width: int, until_us: int) -> list[list[bytes]]:
        """Move all to `until_us` in ways of random lengths; return all that can be seen of each."""
        rng = Random(self.rng.random())
        places = list(range(len(self.kernels)))
        gone: set[int] = set()
        while places:
            targets = [
                min(self.kernels[i].time_us + rng.randrange(1, 60_000), until_us) for i in places
            ]
            ends = _native.advance_together([self.kernels[i] for i in places], targets, width)
            for i, (end, together) in zip(places, ends, strict=True):
                self.log[i].append(self._seen(i, end))
                self.together += together
                if isinstance(end, str):
                    gone.add(i)
            places = [i for i in places if i not in gone and self.kernels[i].time_us < until_us]
            rng.shuffle(places)
        return self.log

    def _seen(self, place: int, end: int | str) -> bytes:
        kernel = self.kernels[place]
        now_us = kernel.time_us
        poses = [
            kernel.pose_at(max(now_us - back_us, 0.0)) for back_us in (0.0, 730.0, 4_000.0, 51e3)
        ]
        numbers = [*kernel.state(), kernel.battery_v, *kernel.duty, *sum(poses, ())]
        sent = b"".join(struct.pack("<q", t_us) + data for t_us, data in kernel.take_sent())
        where = struct.pack("<qqq", now_us, *kernel.true_counts)
        return str(end).encode() + where + struct.pack(f"<{len(numbers)}d", *numbers) + sent


def test_there_is_a_width_beside_one():
    """Two robots fit side by side on every processor."""
    assert _native.lane_widths()[:2] == [1, 2]
    with pytest.raises(ValueError, match="no registers of that width"):
        _native.advance_together([], [], 3)


@pytest.mark.parametrize("seed", [*range(6), 117, 139])
def test_bits_are_those_of_kernels_alone(seed: int):
    """Robots, floors, boards, starts, loads, faults and ways drawn at random; 1 to 20 kernels."""
    n = 1 + (seed * 7 + 4) % 20 if seed < 100 else 1 + seed % 20
    until_us = 900_000 if seed < 100 else 1_200_000
    alone = Case(seed, n).run(1, until_us)
    for width in WIDTHS:
        case = Case(seed, n)
        assert case.run(width, until_us) == alone, f"width {width}"
        assert case.together > 1_000  # and most of that was in lanes


@pytest.mark.parametrize("width", WIDTHS)
def test_one_last_bit_of_one_robot_is_seen_in_that_robot_alone(width: int):
    """Negative control: the comparison above would find a lane that is off by the smallest number."""
    alone = Case(21, 9, wild=False).run(1, 700_000)
    other = Case(21, 9, wild=False, ulp_of="mass_kg").run(width, 700_000)
    assert [a == b for a, b in zip(alone, other, strict=True)] == [True, False] + [True] * 7


@pytest.mark.parametrize("width", WIDTHS)
def test_a_robot_that_runs_away_leaves_the_others_right(width: int):
    """It fails as it does alone, at the same step and with the same state; eight others go on."""
    logs = []
    for lanes in (1, width):
        case = Case(33, 9, wild=False)
        case.kernels[4] = Case(34, 1, wild=False, stiff=True).kernels[0]
        logs.append(case.run(lanes, 700_000))
        assert b"state diverges" in case.log[4][-1]
        assert all(b"diverges" not in log[-1] for log in case.log if log is not case.log[4])
    assert logs[0] == logs[1]
    assert case.together > 20_000


def test_time_of_the_plants_steps():
    """Every width has one, more steps take longer, and what is no whole register is refused."""
    params = plant_params(robot())
    for lanes in _native.lane_widths():
        times = [_native.plant_lane_time(params, lanes, 8, steps) for steps in (40, 40_000)]
        assert 0.0 <= times[0] < times[1]
    with pytest.raises(ValueError, match="whole number of registers"):
        _native.plant_lane_time(params, 2, 3, 40)
    with pytest.raises(ValueError, match="no registers of that width"):
        _native.plant_lane_time(params, 16, 16, 40)
