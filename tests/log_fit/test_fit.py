"""What a log tells is found within its interval; what it does not is said; symmetries hold."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from hil.config.load import load_robot
from hil.study.log_fit.fit import LogFit, fit_log
from hil.study.log_fit.model import drive as integrated
from hil.study.log_fit.model import grid_over, held_means, lagged
from hil.study.log_fit.motion import fit_body
from hil.study.log_fit.signals import Pair2, Poses
from hil.study.log_fit.windows import cut
from tests.log_fit.twins import Answer, Log, drive, motor_log, write_csv, write_table

ROBOT = load_robot("thesis-4wd")


@cache
def driven(seed: int = 5, duration_s: float = 36.0) -> Log:
    """Return the log of one robot, simulated once."""
    return drive(Answer(), seed, duration_s, pose_hz=20.0)


def values(log: Log) -> dict[str, tuple[float, float, bool]]:
    """Return (value, half interval, told) of the body's parameters, fitted to arrays in memory."""
    commands, poses = Pair2(*log.commands.T), Poses(*log.poses.T)
    windows = cut(poses, [], np.ones(poses.t_s.size, dtype=bool))
    found = fit_body(commands, poses, windows, grid_over(float(poses.t_s[-1]))).found
    return {e.name: (e.value, 0.5 * (e.high - e.low), e.told) for e in found.estimates}


@cache
def plain() -> dict[str, tuple[float, float, bool]]:
    """Return the fit of the log as it was driven."""
    return values(driven())


def test_a_lag_gives_the_known_step_response() -> None:
    """After a step of 1 for one time constant the speed is 1 - 1/e, and the way 1/e of it."""
    grid = grid_over(2.0)
    means = held_means(np.array([0.0]), np.array([1.0]), grid.edges_s)
    mean, ends = lagged(means, grid.cell_s, 0.5)
    assert ends[50] == pytest.approx(1.0 - math.exp(-1.0), abs=1e-9)
    assert grid.cell_s * mean[:50].sum() == pytest.approx(0.5 * math.exp(-1.0), abs=1e-9)


def test_an_arc_is_integrated_exactly() -> None:
    """0.3 m/s and 0.5 rad/s for 2 s end on a circle of 0.6 m."""
    count = 200
    track = integrated(np.full(count, 0.3), np.full(count, 0.5), 0.01)
    assert track.x_m[-1] == pytest.approx(0.6 * math.sin(1.0), abs=1e-9)
    assert track.y_m[-1] == pytest.approx(0.6 * (1.0 - math.cos(1.0)), abs=1e-9)


def test_a_known_robot_is_recovered() -> None:
    """Every parameter is told, and lies within twice its 95 % half interval of the truth."""
    for name, (value, half, told) in plain().items():
        assert told, name
        assert abs(value - getattr(Answer(), name)) <= 2.0 * half, name
        assert 0.0 < half < 0.1, name


def test_intervals_hold_about_as_often_as_they_say() -> None:
    """Of two robots' 22 intervals of 95 %, no more than four miss the truth."""
    inside = []
    for seed in (11, 12):
        answer = Answer.drawn(np.random.default_rng(seed))
        found = values(drive(answer, seed, 40.0, pose_hz=15.0))
        inside += [
            abs(value - getattr(answer, name)) <= half
            for name, (value, half, told) in found.items()
            if told
        ]
    assert len(inside) >= 18
    assert sum(not ok for ok in inside) <= 4


def mirrored(log: Log) -> Log:
    """Return it with left and right exchanged."""
    return replace(
        log, commands=log.commands * [1, 1, -1], poses=log.poses * [1, 1, -1, -1]
    )  # fmt: skip


def turned(log: Log) -> Log:
    """Return it in a world turned by 1 rad and shifted."""
    t, x, y, theta = log.poses.T
    cos, sin = math.cos(1.0), math.sin(1.0)
    return replace(
        log,
        poses=np.column_stack((t, cos * x - sin * y + 3.0, sin * x + cos * y - 2.0, theta + 1.0)),
    )


@pytest.mark.parametrize(("change", "odd"), [
    (mirrored, {"veer_rad_m", "pose_left_m", "heading_offset_rad"}),
    (turned, set()),
])  # fmt: skip
def test_what_changes_nothing_real_changes_no_value(change: object, odd: set[str]) -> None:
    """A log mirrored, turned or shifted gives the same robot (mirrored: its odd values negated)."""
    assert callable(change)
    for name, (value, half, told) in values(change(driven())).items():
        expected = plain()[name][0] * (-1.0 if name in odd else 1.0)
        assert told == plain()[name][2], name
        assert value == pytest.approx(expected, abs=0.05 * half + 1e-6), name


def fitted(tmp_path: Path, log: Log, name: str = "log.csv", *, wheels: bool = False) -> LogFit:
    """Return the fit of a log through its CSV file."""
    return fit_log(write_csv(tmp_path / name, log, wheels=wheels), None, ROBOT)


def test_a_log_that_begins_later_gives_the_same(tmp_path: Path) -> None:
    """100 s on every time stamp change nothing; nor does a second fit of the same file."""
    log = drive(Answer(), 7, 20.0, pose_hz=15.0)
    late = np.array([100.0, 0.0, 0.0, 0.0])
    later = Log(log.commands + late[:3], log.poses + late, log.wheels)
    first, again, second = (
        fitted(tmp_path, log), fitted(tmp_path, log), fitted(tmp_path, later, "later.csv"),
    )  # fmt: skip
    assert first.body is not None
    assert again.body is not None
    assert second.body is not None
    assert first.body.found == again.body.found
    for name, value in first.body.found.values.items():
        assert second.body.found.values[name] == pytest.approx(value, abs=1e-5), name


def test_outliers_holes_and_odd_rates_do_little(tmp_path: Path) -> None:
    """With jumps, a hole, and poses at uneven times the values stay within their intervals."""
    log = driven()
    rng = np.random.default_rng(3)
    keep = (rng.random(len(log.poses)) > 0.2) & (np.abs(log.poses[:, 0] - 20.0) > 1.5)
    poses = log.poses[keep].copy()
    wild = rng.choice(len(poses), 15, replace=False)
    poses[wild, 1:3] += rng.uniform(-1.0, 1.0, (15, 2)) + 0.5
    commands = log.commands[np.abs(log.commands[:, 0] - 32.0) > 1.0]
    fit = fitted(tmp_path, Log(commands, poses, log.wheels))
    assert fit.body is not None
    for item in fit.body.found.estimates:
        if item.told:
            half = 0.5 * (item.high - item.low)
            assert abs(item.value - getattr(Answer(), item.name)) <= 2.0 * half, item.name
    told = "\n".join(fit.notes)
    assert "1 holes in the commands" in told
    assert "poses jump and come back" in told


def test_straight_driving_tells_no_turning(tmp_path: Path) -> None:
    """A log without turns says so, names a manoeuvre, and still tells the distance scale."""
    log = driven()
    straight = log.commands * [1, 1, 0]
    t_s = np.arange(0.0, 36.0, 0.05)
    speed = 0.95 * np.interp(t_s - 0.1, *straight[:, :2].T)
    x = np.concatenate(([0.0], np.cumsum(speed[:-1]) * 0.05))
    rng = np.random.default_rng(1)
    poses = np.column_stack((t_s, x, 0 * x, 0 * x)) + rng.normal(size=(t_s.size, 4)) * [
        0,
        1e-3,
        1e-3,
        3e-3,
    ]
    fit = fitted(tmp_path, Log(straight, poses, log.wheels))
    assert fit.body is not None
    assert not fit.body.found.told("turn_scale_ratio")
    assert fit.body.found.told("distance_scale_ratio")
    assert fit.body.found.values["distance_scale_ratio"] == pytest.approx(0.95, abs=0.05)
    advice = {name: item.manoeuvre for item in fit.advice for name in item.tells}
    assert "turn on the spot" in advice["body turn_scale_ratio"]


def test_wheel_speeds_and_poses_tell_radius_and_track(tmp_path: Path) -> None:
    """A true radius of 50 mm and track of 0.22 m are found from a believed 48.2 mm and 0.2166 m.

    The fitted twin foretells the part held out better than plain odometry does.
    """
    fit = fitted(tmp_path, driven(), wheels=True)
    told = {item.name: item for item in fit.robot_values}
    for name, truth in (("wheel_radius_m", 0.05), ("track_m", 0.22)):
        half = 0.5 * (told[name].high - told[name].low)
        assert abs(told[name].value - truth) <= 2.0 * half
        assert half < 0.03 * truth
    assert fit.scores["fitted odometry"].position_m < fit.scores["plain odometry"].position_m
    assert fit.scores["fitted twin"].position_m < fit.scores["standing still"].position_m


def test_positions_without_heading_are_enough(tmp_path: Path) -> None:
    """A log with x and y only still tells the scales."""
    log = driven()
    parts = [("v_cmd", log.commands[:, :2]), ("w_cmd", log.commands[:, ::2])]
    parts += [(name, log.poses[:, [0, k]]) for k, name in enumerate(("x", "y"), 1)]
    fit = fit_log(write_table(tmp_path / "xy.csv", parts), None, ROBOT)
    assert fit.body is not None
    scale = next(e for e in fit.body.found.estimates if e.name == "distance_scale_ratio")
    assert scale.told
    assert scale.low - 0.02 <= 0.95 <= scale.high + 0.02
    assert scale.high - scale.low < 0.3


def test_duties_tell_motor_constants_and_mass(tmp_path: Path) -> None:
    """Of a plant with other motors and mass, both are found within 3 %, by PWM and wheel speeds."""
    truth = {"mass_kg": 3.4, "motor.emf_constant_v_s_rad": 0.0115,
             "motor.torque_constant_n_m_a": 0.0115}  # fmt: skip
    log = motor_log(tmp_path / "motors.csv", truth, duration_s=9.0)
    fit = fit_log(log, None, ROBOT)
    told = {item.name: item for item in fit.robot_values}
    for name, value in truth.items():
        assert told[name].value == pytest.approx(value, rel=0.03), name
        assert told[name].low - 0.01 * value <= value <= told[name].high + 0.01 * value, name
