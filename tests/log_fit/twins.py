"""Robots with known parameters, simulated apart from the fit's own model, and their logs.

`Answer` is a body that follows commands through dead time, dead zone and lag, integrated in small
Euler steps; `motor_log` is the project's robot plant driven by duties.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.config.load import load_robot
from sim_twin import _native
from sim_twin.setup import plant_params

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

STEP_S = 1e-3
COMMAND_S = 0.05


@dataclass(frozen=True)
class Answer:
    """The true parameters, by the names that the fit uses."""

    distance_scale_ratio: float = 0.95
    turn_scale_ratio: float = 1.06
    veer_rad_m: float = 0.03
    forward_lag_s: float = 0.18
    turn_lag_s: float = 0.12
    dead_time_s: float = 0.11
    forward_dead_zone_m_s: float = 0.02
    turn_dead_zone_rad_s: float = 0.1
    pose_ahead_m: float = 0.05
    pose_left_m: float = -0.01
    heading_offset_rad: float = 0.02

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Answer:
        """Return a robot drawn at random."""
        return cls(
            rng.uniform(0.85, 1.15), rng.uniform(0.8, 1.2), rng.uniform(-0.1, 0.1),
            rng.uniform(0.05, 0.35), rng.uniform(0.05, 0.3), rng.uniform(0.02, 0.25),
            rng.uniform(0.0, 0.04), rng.uniform(0.0, 0.15), rng.uniform(-0.08, 0.08),
            rng.uniform(-0.02, 0.02), rng.uniform(-0.05, 0.05),
        )  # fmt: skip


@dataclass(frozen=True)
class Log:
    """Commands (t, forward, turn), poses (t, x, y, theta) and wheel speeds (t, left, right)."""

    commands: Array
    poses: Array
    wheels: Array


def random_commands(rng: np.random.Generator, duration_s: float) -> Array:
    """Return commands at 20 Hz in steps of 0.7 to 2.5 s."""
    t_s = np.arange(0.0, duration_s, COMMAND_S)
    forward, turn = np.zeros_like(t_s), np.zeros_like(t_s)
    at = 0.0
    while at < duration_s:
        last = at + rng.uniform(0.7, 2.5)
        inside = (t_s >= at) & (t_s < last)
        forward[inside] = rng.choice([0.0, 0.1, 0.2, 0.3, -0.15])
        turn[inside] = rng.choice([0.0, 0.3, 0.6, -0.4, -0.8])
        at = last
    return np.column_stack((t_s, forward, turn))


def drive(
    answer: Answer,
    seed: int,
    duration_s: float = 60.0,
    noise: tuple[float, float] = (0.002, 0.01),
    slip: float = 0.01,
    pose_hz: float = 30.0,
    radius_m: float = 0.05,
    track_m: float = 0.22,
) -> Log:
    """Return the log of a drive; `slip` is the spread of a speed error that lasts some 0.5 s."""
    rng = np.random.default_rng(seed)
    commands = random_commands(rng, duration_s)
    count = int(duration_s / STEP_S)
    t_s = STEP_S * np.arange(count)
    row = np.floor((t_s - answer.dead_time_s) / COMMAND_S + 1e-9).astype(int)
    asked = np.where(row >= 0, commands[np.clip(row, 0, None), 1:].T, 0.0)
    push = rng.normal(size=(2, count)) * slip * math.sqrt(2.0 * STEP_S / 0.5)
    forward = turn = loss = twist = x = y = theta = 0.0
    rows = np.empty((count, 5))
    zones = (answer.forward_dead_zone_m_s, answer.turn_dead_zone_rad_s)
    for k in range(count):
        rows[k] = x, y, theta, forward, turn
        u, w = (
            math.copysign(max(abs(v) - z, 0.0), v) for v, z in zip(asked[:, k], zones, strict=True)
        )
        forward += STEP_S * (answer.distance_scale_ratio * u - forward) / answer.forward_lag_s
        turn += STEP_S * (answer.turn_scale_ratio * w - turn) / answer.turn_lag_s
        loss += -STEP_S * loss / 0.5 + push[0, k]
        twist += -STEP_S * twist / 0.5 + push[1, k]
        v, rate = forward * (1.0 + loss), (turn + answer.veer_rad_m * forward) * (1.0 + twist)
        middle = theta + 0.5 * STEP_S * rate
        x += STEP_S * v * math.cos(middle)
        y += STEP_S * v * math.sin(middle)
        theta += STEP_S * rate
    at = np.arange(0, count, round(1.0 / (pose_hz * STEP_S)))
    x, y, theta, forward, turn = rows[at].T
    ahead, left = answer.pose_ahead_m, answer.pose_left_m
    poses = np.column_stack((
        t_s[at],
        x + ahead * np.cos(theta) - left * np.sin(theta) + noise[0] * rng.normal(size=at.size),
        y + ahead * np.sin(theta) + left * np.cos(theta) + noise[0] * rng.normal(size=at.size),
        theta + answer.heading_offset_rad + noise[1] * rng.normal(size=at.size),
    ))  # fmt: skip
    rate = turn + answer.veer_rad_m * forward
    wheels = np.column_stack((
        t_s[at], (forward - 0.5 * track_m * rate) / radius_m,
        (forward + 0.5 * track_m * rate) / radius_m,
    ))  # fmt: skip
    return Log(commands, poses, wheels)


def write_csv(path: Path, log: Log, *, wheels: bool = False) -> Path:
    """Write a log as one table on one time column, with empty cells, and return the path."""
    parts = [("v_cmd", log.commands[:, :2]), ("w_cmd", log.commands[:, ::2])]
    parts += [(name, log.poses[:, [0, k]]) for k, name in enumerate(("x", "y", "theta"), 1)]
    if wheels:
        parts += [(name, log.wheels[:, [0, k]]) for k, name in enumerate(("wl", "wr"), 1)]
    return write_table(path, parts)


def write_table(path: Path, parts: list[tuple[str, Array]]) -> Path:
    """Write named (t, value) series as one CSV table."""
    times = np.unique(np.concatenate([values[:, 0] for _, values in parts]).round(6))
    cells: list[dict[float, str]] = [
        {round(float(t), 6): f"{value:.9g}" for t, value in values} for _, values in parts
    ]
    lines = [",".join(["t_s", *(name for name, _ in parts)])]
    lines += [",".join([f"{t:.6f}", *(own.get(float(t), "") for own in cells)]) for t in times]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@dataclass(frozen=True)
class WheelAnswer:
    """The true parameters of both wheel loops, by the names that the fit uses."""

    wheel_scale_left_ratio: float
    wheel_scale_right_ratio: float
    wheel_lag_s: float
    wheel_dead_time_s: float
    wheel_dead_zone_rad_s: float

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> WheelAnswer:
        """Return wheel loops drawn at random."""
        return cls(
            rng.uniform(0.8, 1.2), rng.uniform(0.8, 1.2), rng.uniform(0.03, 0.3),
            rng.uniform(0.01, 0.15), rng.uniform(0.0, 1.0),
        )  # fmt: skip


def wheel_log(
    path: Path, answer: WheelAnswer, seed: int, duration_s: float = 60.0, load: float = 0.02
) -> Path:
    """Write wheel commands at 20 Hz and speeds at 50 Hz; `load` is a relative error that lasts 0.5 s."""
    rng = np.random.default_rng(seed)
    commands = random_commands(rng, duration_s)
    asked = np.column_stack((
        commands[:, 0],
        (commands[:, 1] - 0.11 * commands[:, 2]) / 0.05,
        (commands[:, 1] + 0.11 * commands[:, 2]) / 0.05,
    ))  # fmt: skip
    count = int(duration_s / STEP_S)
    t_s = STEP_S * np.arange(count)
    row = np.floor((t_s - answer.wheel_dead_time_s) / COMMAND_S + 1e-9).astype(int)
    sides = []
    for side, scale in ((1, answer.wheel_scale_left_ratio), (2, answer.wheel_scale_right_ratio)):
        wanted = np.where(row >= 0, asked[np.clip(row, 0, None), side], 0.0)
        zone = answer.wheel_dead_zone_rad_s
        wanted = scale * np.copysign(np.maximum(np.abs(wanted) - zone, 0.0), wanted)
        push = rng.normal(size=count) * load * math.sqrt(2.0 * STEP_S / 0.5)
        speed, loss, rows = 0.0, 0.0, np.empty(count)
        for k in range(count):
            rows[k] = speed * (1.0 + loss)
            speed += STEP_S * (wanted[k] - speed) / answer.wheel_lag_s
            loss += -STEP_S * loss / 0.5 + push[k]
        sides.append(rows[:: round(0.02 / STEP_S)])
    at = t_s[:: round(0.02 / STEP_S)]
    noise = rng.normal(size=(2, at.size)) * 0.05
    return write_table(path, [
        ("omega_cmd_left_rad_s", asked[:, [0, 1]]), ("omega_cmd_right_rad_s", asked[:, [0, 2]]),
        ("wl", np.column_stack((at, sides[0] + noise[0]))),
        ("wr", np.column_stack((at, sides[1] + noise[1]))),
    ])  # fmt: skip


def motor_log(path: Path, changes: dict[str, Any], seed: int = 1, duration_s: float = 60.0) -> Path:
    """Drive the robot's plant by steps of duty; write duty, battery, wheel speeds and poses at 50 Hz.

    `changes` are true values of the robot's file; a dotted key reaches into a table.
    """
    tree = load_robot("thesis-4wd").model_dump()
    for key, value in changes.items():
        table, _, leaf = key.rpartition(".")
        (tree[table] if table else tree)[leaf] = value
    robot = type(load_robot("thesis-4wd")).model_validate(tree)
    plant = _native.Plant(plant_params(robot))
    plant.reset(0.0, 0.0, 0.0)
    rng = np.random.default_rng(seed)
    still = [0.0] * len(_native.LOADS)
    place = {name: k for k, name in enumerate(_native.STATES)}
    rows, left, right, until = [], 0.0, 0.0, 0.0
    for k in range(int(duration_s / 0.02)):
        t_s = 0.02 * k
        if t_s >= until:
            until = t_s + rng.uniform(0.5, 1.4)
            straight = rng.choice([0.0, 0.3, 0.45, 0.7, -0.5])
            apart = rng.choice([0.0, 0.0, 0.25, -0.25, 0.4])
            left, right = (float(np.clip(straight + s * apart, -1, 1)) for s in (-1, 1))
        state = plant.state
        rows.append((
            t_s, round(left * 400), round(right * 400), plant.battery_v(left, right),
            state[place["omega_left_rad_s"]] + 0.05 * rng.normal(),
            state[place["omega_right_rad_s"]] + 0.05 * rng.normal(),
            state[place["x_m"]] + 0.002 * rng.normal(), state[place["y_m"]] + 0.002 * rng.normal(),
            state[place["theta_rad"]] + 0.01 * rng.normal(),
        ))  # fmt: skip
        plant.run(200, 1e-4, round(left * 400) / 400, round(right * 400) / 400, still)
    head = "t_s,pwm_left,pwm_right,battery_v,wl,wr,x,y,theta"
    lines = [head, *(",".join(f"{value:.7g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
