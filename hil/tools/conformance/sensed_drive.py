"""A drive whose truth is known, as an estimator is told of it: commands, wheel counts, delayed poses."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from hil.core.types import Pose, PoseMeasurement, WheelSample, wrap_pi
from hil.tools.conformance.floor import mirrored_pose

if TYPE_CHECKING:
    from hil.control.estimators.geometry import BelievedGeometry

_STEP_S = 0.001
_SECONDS = 8.0
_CAMERA_S, _CAMERA_DELAY_S = 0.033, 0.06
_REPORT_S, _LINK_DELAY_S = 0.02, 0.02
_TICK_S, _LEAD_S = 0.033, 0.02
_SIGMA_M, _SIGMA_RAD = 0.001, 0.005
_LOST_RATIO = 0.05
# A cable over the robot: no pose for half a second.
_DARK_S = (4.0, 4.3)


@dataclass(frozen=True, slots=True)
class Given:
    """Something an estimator is told at its time: one of the three."""

    t_s: float
    wheels: WheelSample | None = None
    measurement: PoseMeasurement | None = None
    command: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Asked:
    """The estimator is asked for its state at `t_s`, where the robot truly is at `truth`."""

    t_s: float
    truth: Pose


@dataclass(frozen=True, slots=True)
class Drive:
    """All that happens, in the order in which the host hears of it."""

    events: tuple[Given | Asked, ...]

    @property
    def asked(self) -> tuple[Asked, ...]:
        """Return the questions alone."""
        return tuple(event for event in self.events if isinstance(event, Asked))


def sensed_drive(geometry: BelievedGeometry, lag_s: float, seed: int) -> Drive:
    """Return a weaving drive of a robot of this geometry whose wheels follow with `lag_s`."""
    rng = random.Random(seed)
    told: list[tuple[float, int, Given | Asked]] = []
    wheels, angle, goal = [0.0, 0.0], [0.0, 0.0], (0.0, 0.0)
    commands: list[tuple[float, tuple[float, float]]] = []
    x, y, theta = 0.1 * seed, -0.2, 0.3
    truth: list[Pose] = []
    fade = math.exp(-_STEP_S / lag_s)
    steps = round(_SECONDS / _STEP_S)
    d0_m, unit = geometry.d0_m, geometry.rad_per_count
    for step in range(steps + round(_LEAD_S / _STEP_S) + 2):
        t_s = step * _STEP_S
        pose = Pose(x - d0_m * math.cos(theta), y - d0_m * math.sin(theta), theta)
        truth.append(pose)
        if step < steps:
            if step % round(_CAMERA_S / _STEP_S) == 0:
                told.append((t_s + _CAMERA_DELAY_S, step, _seen(t_s, pose, rng)))
            if step % round(_REPORT_S / _STEP_S) == 0:
                sample = WheelSample(t_s, *(math.floor(a / unit) for a in angle), *wheels)
                told.append((t_s + _LINK_DELAY_S, step, Given(t_s, wheels=sample)))
            if step % round(_TICK_S / _STEP_S) == 16:
                command = _wanted(t_s, seed)
                commands.append((t_s + _LEAD_S, geometry.wheels(*command)))
                told.append((t_s, step, Asked(t_s + _LEAD_S, pose)))
                told.append((t_s, step, Given(t_s + _LEAD_S, command=command)))
        while commands and commands[0][0] <= t_s:
            goal = commands.pop(0)[1]
        for side in (0, 1):
            wheels[side] = goal[side] + (wheels[side] - goal[side]) * fade
            angle[side] += wheels[side] * _STEP_S
        eta1, w = geometry.body(*wheels)
        middle = theta + 0.5 * w * _STEP_S
        x, y = x + eta1 * math.cos(middle) * _STEP_S, y + eta1 * math.sin(middle) * _STEP_S
        theta += w * _STEP_S
    told.sort(key=lambda item: item[0])  # stable: what came first stays first
    return Drive(tuple(_with_truth(event, truth) for _, _, event in told))


def _wanted(t_s: float, seed: int) -> tuple[float, float]:
    """Return body speeds: at rest, then forward and turning to and fro."""
    if t_s < 1.0:
        return 0.0, 0.0
    return 0.25 + 0.1 * math.sin(1.3 * t_s), 0.9 * math.sin(0.8 * t_s + 0.5 * seed)


def _seen(t_s: float, pose: Pose, rng: random.Random) -> Given:
    if _DARK_S[0] <= t_s < _DARK_S[1] or rng.random() < _LOST_RATIO:
        return Given(t_s, measurement=PoseMeasurement(None, 0.0, "hidden"))
    noisy = Pose(
        pose.x_m + rng.gauss(0.0, _SIGMA_M),
        pose.y_m + rng.gauss(0.0, _SIGMA_M),
        wrap_pi(pose.theta_rad + rng.gauss(0.0, _SIGMA_RAD)),
    )
    return Given(t_s, measurement=PoseMeasurement(noisy, 1.0, "", _SIGMA_M, _SIGMA_RAD))


def _with_truth(event: Given | Asked, truth: list[Pose]) -> Given | Asked:
    """Give a question the truth of the instant that it asks for."""
    return (
        replace(event, truth=truth[round(event.t_s / _STEP_S)])
        if isinstance(event, Asked)
        else event
    )


def mirrored_drive(drive: Drive) -> Drive:
    """Return the drive mirrored left to right: the wheels change sides."""
    return Drive(tuple(_mirrored(event) for event in drive.events))


def _mirrored(event: Given | Asked) -> Given | Asked:
    if isinstance(event, Asked):
        return replace(event, truth=mirrored_pose(event.truth))
    if event.wheels is not None:
        w = event.wheels
        return replace(
            event,
            wheels=WheelSample(
                w.t_host_s, w.counts_right, w.counts_left, w.omega_right_rad_s, w.omega_left_rad_s
            ),
        )
    if event.measurement is not None:
        pose = event.measurement.pose
        seen = replace(event.measurement, pose=None if pose is None else mirrored_pose(pose))
        return replace(event, measurement=seen)
    return replace(event, command=(event.command[0], -event.command[1]))
