"""Turns the configuration of robot, disturbances and faults into the native kernel's."""

from __future__ import annotations

import math
from collections.abc import Sequence
from random import Random
from typing import TYPE_CHECKING

from hil.control.vehicles.vehicle import make_vehicle
from hil.core.newest import of_newest
from hil.core.registries import VEHICLES
from sim_twin import _native

if TYPE_CHECKING:
    from hil.config.events import Disturbance, Fault
    from hil.config.robot import RobotConfig

STEP_US = 100  # RK4 at 1e-4 s
_UNSEEDED = 1 << 31
_GROUPS = ("motor", "bridge", "battery", "floor")


def plant_params(robot: RobotConfig) -> _native.PlantParams:
    """Return the plant's parameters: `motor.resistance_ohm` is `motor_resistance_ohm` there."""
    params = _native.PlantParams()
    contacts = make_vehicle(robot).contacts
    axles = {"front_axle_m": contacts.front_m, "rear_axle_m": contacts.rear_m}
    for name in _native.PARAMETERS:
        if name in axles:
            setattr(params, name, axles[name])
            continue
        group, _, rest = name.partition("_")
        owner = getattr(robot, group) if group in _GROUPS else robot
        setattr(params, name, float(getattr(owner, rest if group in _GROUPS else name)))
    params.castor = contacts.castor_friction_ratio is not None
    params.castor_friction_ratio = contacts.castor_friction_ratio or 0.0
    params.slip = robot.variant == "slip"
    params.lifted = robot.variant == "lifted"
    return params


_plant_params = of_newest(plant_params, by=lambda robot: VEHICLES.get(robot.vehicle.kind).factory)


def make_kernel(
    robot: RobotConfig,
    baud: int,
    rng: Random,
    disturbances: Sequence[Disturbance] = (),
    faults: Sequence[Fault] = (),
    board: object | None = None,
    *,
    wired: bool = False,
    eeprom: bytes = b"",
) -> _native.Kernel:
    """Return robot and board at rest at the origin, with every event of the scenario loaded.

    `rng` draws what nobody sets: when the board was switched on, and the noise. `board` is the
    handle of another board than the firmware core compiled for this machine, which is met on its USB
    port where it is `wired`, and has `eeprom` in its storage.
    """
    clock_start_us = rng.randrange(2_000_000, 600_000_000)
    if board is None:
        board = _native.host_board(
            robot.board_clock_ppm, clock_start_us, float(baud), wired, eeprom
        )
    kernel = _native.Kernel(
        _plant_params(robot),
        step_us=STEP_US,
        counts_per_turn=robot.encoder_counts_per_turn,
        board=board,
    )
    noise_seed = rng.getrandbits(32) << 32
    for place, item in enumerate(disturbances):
        arguments = shape_arguments(item, noise_seed, place)
        kernel.add_disturbance(_native.LOADS.index(item.target), *arguments)
    for fault in faults:
        if fault.kind in _native.FAULTS:
            kernel.add_fault(
                _native.FAULTS.index(fault.kind),
                fault.side != "right",
                fault.side != "left",
                fault.start_s,
                _end_s(fault.end_s),
                fault.strength_ratio,
            )
    return kernel


def shape_arguments(
    item: Disturbance, noise_seed: int, place: int = 0
) -> tuple[int, float, float, float, float, float, int, tuple[float, float, float]]:
    """Return the arguments of `_native.disturbance_value` that describe one disturbance.

    `place` in the list tells noises apart that have no seed of their own.
    """
    zone = item.zone
    # No given seed reaches the upper half: a drawn one is never another's.
    seed = _UNSEEDED + place if item.seed is None else item.seed
    return (
        _native.SHAPES.index(item.shape),
        item.amplitude,
        item.start_s,
        _end_s(item.end_s),
        item.frequency_hz,
        item.phase_rad,
        noise_seed | seed,
        (zone.x_m, zone.y_m, zone.radius_m) if zone else (0.0, 0.0, 0.0),
    )


def _end_s(end_s: float | None) -> float:
    return math.inf if end_s is None else end_s
