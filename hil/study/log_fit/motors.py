"""Fit of motor voltages to wheel speeds, through the robot's own plant: constants, friction, mass.

Values are ratios over the robot file that the fit begins with. Resistances, gear, bridge and wheel
inertia are taken from it: a log of voltages and speeds tells the others only given these.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hil.config.load import build
from hil.config.robot import RobotConfig
from hil.study.log_fit.estimate import Estimate, Found, Parameter, estimate, first_values
from hil.study.log_fit.wheels import lively_part
from sim_twin import _native
from sim_twin.setup import plant_params

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hil.study.log_fit.signals import Pair2

    Array = NDArray[np.float64]

# ratio -> values of the robot file that it multiplies, all told apart by no log of this kind
KEYS = {
    "motor_constant_ratio": ("motor.emf_constant_v_s_rad", "motor.torque_constant_n_m_a"),
    "motor_friction_ratio": (
        "motor.coulomb_n_m", "motor.stiction_n_m", "motor.viscous_n_m_s_rad",
    ),
    "floor_friction_ratio": ("floor.friction_ratio",),
    "mass_ratio": ("mass_kg",),
    "inertia_ratio": ("inertia_kg_m2",),
}  # fmt: skip
_PARAMETERS = (
    Parameter("motor_constant_ratio", "ratio", "motor constants over those believed", 1.0, 0.3, 3.0,
              0.12, 0.02, main=True),
    Parameter("motor_friction_ratio", "ratio", "friction in motor and gear over that believed", 1.0,
              0.05, 10.0, 0.3, 0.04, share=0.3, could_be=0.5),
    Parameter("floor_friction_ratio", "ratio", "scrubbing on the floor over that believed", 1.0,
              0.02, 5.0, 0.3, 0.02, share=0.3, could_be=0.5),
    Parameter("mass_ratio", "ratio", "mass over that believed", 1.0, 0.2, 5.0, 0.25, 0.03,
              share=0.25, could_be=0.5),
    Parameter("inertia_ratio", "ratio", "inertia about the vertical over that believed", 1.0, 0.1,
              8.0, 0.3, 0.05, share=0.3, could_be=1.0),
    Parameter("wheel_speed_delay_s", "s", "wheel speed as logged behind the voltage as logged", 0.0,
              -0.15, 0.3, 0.03, 2e-3, could_be=0.02),
)  # fmt: skip
_STEP_S = 1e-4
_CELL_S = 0.01
_KEPT = 16  # runs of the plant that are remembered
_LONGEST_S = 30.0  # of driving that is fitted: each evaluation runs the plant through all of it
_SIGMA_RAD_S, _LEAST_SIGMA_RAD_S = 0.3, 1e-3


def fit_motors(
    voltage: Pair2, wheels: Pair2, robot: RobotConfig, holes: Sequence[tuple[float, float]]
) -> Found | None:
    """Fit the plant's wheel speeds to those of the log; None when the wheels turn too little."""
    seen = (wheels.first, wheels.second)
    at, window = lively_part(wheels.t_s, seen, voltage, holes)
    at &= wheels.t_s <= voltage.t_s[0] + _LONGEST_S
    if np.unique(window[at]).size < 3:
        return None
    rows, sigma = wheels.t_s[at], _SIGMA_RAD_S
    edges_s = np.arange(voltage.t_s[0], rows[-1] + 1.0, _CELL_S)
    place = np.clip(np.searchsorted(voltage.t_s, edges_s, side="right") - 1, 0, None)
    left_v, right_v = voltage.first[place].tolist(), voltage.second[place].tolist()
    known: dict[tuple[float, ...], tuple[Array, Array]] = {}

    def speeds(point: dict[str, float]) -> tuple[Array, Array]:
        key = tuple(point[name] for name in KEYS)
        if key not in known:
            if len(known) > _KEPT:
                known.clear()
            known[key] = _driven(scaled(robot, point), left_v, right_v)
        return known[key]

    def residual(point: dict[str, float]) -> Array:
        both = speeds(point)
        return np.concatenate([
            (np.interp(rows - point["wheel_speed_delay_s"], edges_s, side) - part[at]) / sigma
            for side, part in zip(both, seen, strict=True)
        ])  # fmt: skip

    groups = np.tile(window[at], 2)
    values = first_values(_PARAMETERS, residual, [])
    rest = residual(values) * sigma
    sigma = max(1.4826 * float(np.median(np.abs(rest))), _LEAST_SIGMA_RAD_S)
    floor = dict.fromkeys(KEYS, 0.003) | {"wheel_speed_delay_s": 0.1 * _CELL_S}
    return estimate(_PARAMETERS, residual, groups, [values], floor)


def scaled(robot: RobotConfig, point: dict[str, float]) -> RobotConfig:
    """Return a robot with its values multiplied by the ratios."""
    tree = robot.model_dump()
    for name, keys in KEYS.items():
        for key in keys:
            table, _, leaf = key.rpartition(".")
            (tree[table] if table else tree)[leaf] *= point[name]
    return build(RobotConfig, tree, "fit")


def _driven(robot: RobotConfig, left_v: list[float], right_v: list[float]) -> tuple[Array, Array]:
    """Return the wheel speeds at the beginning of each cell, from rest, under voltages held over it."""
    plant = _native.Plant(plant_params(robot))
    plant.reset(0.0, 0.0, 0.0)
    still = [0.0] * len(_native.LOADS)
    left_at, right_at = (_native.STATES.index(f"omega_{side}_rad_s") for side in ("left", "right"))
    steps = round(_CELL_S / _STEP_S)
    left, right = np.empty(len(left_v)), np.empty(len(left_v))
    duty = (0.0, 0.0)
    for k, (a, b) in enumerate(zip(left_v, right_v, strict=True)):
        state = plant.state
        left[k], right[k] = state[left_at], state[right_at]
        # The plant has its own battery; what counts is the voltage that the log gives.
        supply_v = max(plant.battery_v(*duty), 0.1)
        duty = (min(max(a / supply_v, -1.5), 1.5), min(max(b / supply_v, -1.5), 1.5))
        plant.run(steps, _STEP_S, *duty, still)
    return left, right


def motor_values(found: Found, robot: RobotConfig) -> list[Estimate]:
    """Return the values of the robot file that the log tells."""
    tree = robot.model_dump()
    units = {"mass_kg": "kg", "inertia_kg_m2": "kg m^2"}
    values = []
    for item in found.estimates:
        if not item.told or item.name not in KEYS:
            continue
        for key in KEYS[item.name]:
            table, _, leaf = key.rpartition(".")
            believed = float((tree[table] if table else tree)[leaf])
            low, value, high = (believed * ratio for ratio in (item.low, item.value, item.high))
            values.append(Estimate(
                key, units.get(key, "SI"), f"{item.value:.3f} of what was believed; resistance, gear "
                "and wheel inertia as believed", value, low, high, told=True,
            ))  # fmt: skip
    return values
