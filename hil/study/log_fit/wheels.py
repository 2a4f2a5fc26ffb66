"""Fits of what is seen in wheel speeds: from wheel commands, and from motor voltages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hil.study.log_fit.estimate import Estimate, Found, Parameter, estimate, first_values
from hil.study.log_fit.model import CELL_S, Grid, dead_zone, held_means, lagged

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from hil.config.robot import RobotConfig
    from hil.study.log_fit.signals import Pair2

    Array = NDArray[np.float64]

_WINDOW_S = 1.5
_FITTED_SHARE = 0.7
_LEAST_WINDOWS = 5
_MOVING_RAD_S = 0.2
_SIGMA_RAD_S, _LEAST_SIGMA_RAD_S = 0.3, 1e-3
_MOST_SAMPLES = 20_000


def fit_wheels(command: Pair2, wheels: Pair2, grid: Grid, holes: Sequence[tuple[float, float]]
               ) -> Found | None:  # fmt: skip
    """Fit wheel commands to wheel speeds: scale of each side, lag, dead time, dead zone."""
    most = max(float(np.abs(np.concatenate((command.first, command.second))).max()), 1e-3)
    parameters = (
        Parameter("wheel_scale_left_ratio", "ratio", "left wheel speed over what was asked", 1.0,
                  -60.0, 60.0, 0.1, 1e-3, share=0.1, main=True),
        Parameter("wheel_scale_right_ratio", "ratio", "right wheel speed over what was asked", 1.0,
                  -60.0, 60.0, 0.1, 1e-3, share=0.1, main=True),
        Parameter("wheel_lag_s", "s", "first-order time constant of the wheel speeds", 0.0, 0.0,
                  3.0, 0.05, 2e-3, share=0.3, could_be=0.5),
        Parameter("wheel_dead_time_s", "s", "from a wheel command as logged to its effect as logged",
                  0.0, -0.3, 1.5, 0.05, 2e-3, share=0.3, could_be=0.5),
        Parameter("wheel_dead_zone_rad_s", "rad/s", "wheel command up to which nothing turns", 0.0,
                  0.0, 0.8 * most, 0.08 * most, 0.002 * most, share=0.5, could_be=0.2 * most),
    )  # fmt: skip

    def model(point: dict[str, float]) -> tuple[Array, Array]:
        edges = grid.edges_s - point["wheel_dead_time_s"]
        sides = []
        for values, scale in ((command.first, "wheel_scale_left_ratio"),
                              (command.second, "wheel_scale_right_ratio")):  # fmt: skip
            asked = point[scale] * dead_zone(values, point["wheel_dead_zone_rad_s"])
            means = held_means(command.t_s, asked, edges)
            sides.append(lagged(means, grid.cell_s, point["wheel_lag_s"])[1])
        return sides[0], sides[1]

    starts = [
        {"wheel_lag_s": lag, "wheel_dead_time_s": dead}
        for lag in (0.03, 0.2, 0.6)
        for dead in (0.0, 0.1, 0.3)
    ]
    floor = {"wheel_scale_left_ratio": 2e-4, "wheel_scale_right_ratio": 2e-4,
             "wheel_lag_s": 0.1 * CELL_S, "wheel_dead_time_s": 0.1 * CELL_S,
             "wheel_dead_zone_rad_s": 1e-3}  # fmt: skip
    return _fit(parameters, model, command, wheels, grid, holes, starts, floor)


def fit_motors(voltage: Pair2, wheels: Pair2, grid: Grid, holes: Sequence[tuple[float, float]]
               ) -> Found | None:  # fmt: skip
    """Fit motor voltages to wheel speeds: gain, dead voltages, lags straight on and turning."""
    most = max(float(np.abs(np.concatenate((voltage.first, voltage.second))).max()), 0.1)
    reached = max(float(np.abs(np.concatenate((wheels.first, wheels.second))).max()), 0.1)
    gain = 1.5 * reached / most
    parameters = (
        Parameter("motor_gain_rad_s_v", "rad/s/V", "wheel speed per volt above the dead voltage",
                  gain, -100.0 * gain, 100.0 * gain, 0.0, 1e-3 * gain, share=0.1, main=True),
        Parameter("motor_dead_v", "V", "voltage up to which the wheels stand", 0.0, 0.0, 0.9 * most,
                  0.1 * most, 0.002 * most, share=0.3, could_be=0.3 * most),
        Parameter("motor_turn_dead_v", "V", "more of it on each side when turning (scrubbing)", 0.0,
                  0.0, 0.9 * most, 0.1 * most, 0.002 * most, share=0.3, could_be=0.3 * most),
        Parameter("motor_forward_lag_s", "s", "time constant straight on", 0.0, 0.0, 5.0, 0.05,
                  2e-3, share=0.3, could_be=0.5),
        Parameter("motor_turn_lag_s", "s", "time constant turning", 0.0, 0.0, 5.0, 0.05, 2e-3,
                  share=0.3, could_be=0.5),
        Parameter("motor_time_offset_s", "s", "wheel speed as logged behind the voltage as logged",
                  0.0, -0.2, 0.5, 0.03, 2e-3, could_be=0.1),
    )  # fmt: skip

    def model(point: dict[str, float]) -> tuple[Array, Array]:
        edges = grid.edges_s - point["motor_time_offset_s"]
        left, right = (
            held_means(voltage.t_s, dead_zone(part, point["motor_dead_v"]), edges)
            for part in (voltage.first, voltage.second)
        )
        gain = point["motor_gain_rad_s_v"]
        straight = lagged(0.5 * gain * (left + right), grid.cell_s, point["motor_forward_lag_s"])[1]
        turning = dead_zone(0.5 * (right - left), point["motor_turn_dead_v"])
        apart = lagged(gain * turning, grid.cell_s, point["motor_turn_lag_s"])[1]
        return straight - apart, straight + apart

    starts = [
        {"motor_forward_lag_s": lag, "motor_turn_lag_s": lag, "motor_dead_v": dead * most}
        for lag in (0.05, 0.2, 0.6)
        for dead in (0.02, 0.15, 0.35)
    ]
    floor = {"motor_gain_rad_s_v": 5e-4 * gain, "motor_dead_v": 0.01, "motor_turn_dead_v": 0.01,
             "motor_forward_lag_s": 0.1 * CELL_S, "motor_turn_lag_s": 0.1 * CELL_S,
             "motor_time_offset_s": 0.1 * CELL_S}  # fmt: skip
    return _fit(parameters, model, voltage, wheels, grid, holes, starts, floor)


def _fit(
    parameters: tuple[Parameter, ...],
    model: Callable[[dict[str, float]], tuple[Array, Array]],
    source: Pair2,
    wheels: Pair2,
    grid: Grid,
    holes: Sequence[tuple[float, float]],
    starts: list[dict[str, float]],
    floor: dict[str, float],
) -> Found | None:
    """Return the fit over the first part of the log, None when too little happens in it."""
    stride = max(math.ceil(wheels.t_s.size / _MOST_SAMPLES), 1)
    t_s, seen = wheels.t_s[::stride], (wheels.first[::stride], wheels.second[::stride])
    window = (t_s / _WINDOW_S).astype(np.intp)
    usable = (t_s >= source.t_s[0]) & (t_s <= source.t_s[-1] + _WINDOW_S)
    for begin, end in holes:
        usable &= (t_s < begin) | (t_s > end + _WINDOW_S)
    lively = (np.abs(seen[0]) > _MOVING_RAD_S) | (np.abs(seen[1]) > _MOVING_RAD_S)
    names = [n for n in np.unique(window[usable]) if lively[window == n].any()]
    if len(names) < _LEAST_WINDOWS:
        return None
    names = names[: math.ceil(_FITTED_SHARE * len(names))]
    at = usable & np.isin(window, names)
    rows, sigma = t_s[at], _SIGMA_RAD_S

    def residual(point: dict[str, float]) -> Array:
        both = model(point)
        return np.concatenate([
            (np.interp(rows, grid.edges_s, side) - part[at]) / sigma
            for side, part in zip(both, seen, strict=True)
        ])  # fmt: skip

    groups = np.tile(window[at], 2)
    values = first_values(parameters, residual, starts)
    rest = residual(values) * sigma
    sigma = max(1.4826 * float(np.median(np.abs(rest))), _LEAST_SIGMA_RAD_S)
    return estimate(parameters, residual, groups, [values], floor)


def motor_values(found: Found, robot: RobotConfig) -> list[Estimate]:
    """Return what motor gain, dead voltage and lags mean for a robot file, given the rest of it.

    A first-order motor: 1/gain = N k + R b / (eta N k) and J = lag n (eta N^2 k^2 / R + b) a side, with
    R the winding's and the bridge's resistance, n motors a side; J - J_wheels = m r^2 / 2 straight on
    and 2 r^2 (I + m d0^2) / W^2 turning. Resistance, gear and wheel inertia are taken as believed.
    """
    by_name = {item.name: item for item in found.estimates}
    motor = robot.motor
    out: list[Estimate] = []
    gain = by_name["motor_gain_rad_s_v"]
    if not gain.told or gain.low <= 0.0:
        return out
    constants = [_constant(value, robot) for value in (gain.value, gain.high, gain.low)]
    if all(math.isfinite(value) for value in constants):
        value, low, high = constants
        for name, what in (("motor.emf_constant_v_s_rad", "k_b"),
                           ("motor.torque_constant_n_m_a", "k_t, taken equal to k_b")):  # fmt: skip
            out.append(Estimate(name, "SI", f"{what}, of the motor's gain; resistance as believed",
                                value, low, high, told=True))  # fmt: skip
    else:
        return out
    radius, half = robot.wheel_radius_m, robot.wheel_radius_m / robot.track_m
    rotor = motor.gear_ratio**2 * motor.rotor_inertia_kg_m2
    side = motor.per_side * rotor + 2.0 * robot.wheel_inertia_kg_m2
    forward = _inertias(by_name["motor_forward_lag_s"], constants, robot)
    mass = [2.0 * (value - side) / radius**2 for value in forward] if forward else []
    if mass and mass[1] > 0.0:
        out.append(Estimate("mass_kg", "kg", "of the lag straight on and the motor constants",
                            mass[0], mass[1], mass[2], told=mass[2] - mass[1] < 1.2 * mass[0]))  # fmt: skip
    turning = _inertias(by_name["motor_turn_lag_s"], constants, robot)
    if turning:
        own = (mass[0] if mass else robot.mass_kg) * robot.d0_m**2
        yaw = [(value - side) / (2.0 * half**2) - own for value in turning]
        if yaw[1] > 0.0:
            out.append(Estimate("inertia_kg_m2", "kg m^2", "of the lag turning and the constants",
                                yaw[0], yaw[1], yaw[2], told=yaw[2] - yaw[1] < 1.2 * yaw[0]))  # fmt: skip
    return out


def _resistance(robot: RobotConfig) -> float:
    return robot.motor.resistance_ohm + robot.motor.per_side * robot.bridge.resistance_ohm


def _constant(gain: float, robot: RobotConfig) -> float:
    """Return k of a gain in rad/s/V; NaN where friction alone would be more."""
    motor = robot.motor
    loss = 4.0 * _resistance(robot) * motor.viscous_n_m_s_rad / motor.gear_efficiency_ratio
    inside = 1.0 / gain**2 - loss
    return 0.5 * (1.0 / gain + math.sqrt(inside)) / motor.gear_ratio if inside > 0.0 else math.nan


def _inertias(lag: Estimate, constants: Sequence[float], robot: RobotConfig) -> list[float]:
    """Return the inertia of a side: value, low, high."""
    if not lag.told:
        return []
    motor = robot.motor

    def damping(constant: float) -> float:
        turn = (motor.gear_ratio * constant) ** 2 * motor.gear_efficiency_ratio
        return motor.per_side * (turn / _resistance(robot) + motor.viscous_n_m_s_rad)

    low, high = damping(constants[1]), damping(constants[2])
    return [lag.value * damping(constants[0]), lag.low * low, lag.high * high]
