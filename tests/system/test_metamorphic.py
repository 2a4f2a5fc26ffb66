"""What must come out the same, or mirrored, turned and shifted, when the same is asked otherwise.

The camera's drawn errors are in world axes, so they are switched off where the world is turned.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import sim_twin.twin
from hil.config.load import load_scenario
from hil.config.scenario import Scenario
from hil.record.reader import RunRecord
from hil.runs.execute import RunSpec, execute_in_memory
from sim_twin.drawn_poses import LocaliserError
from tests.cli.command import hil

SHORT = ["duration_s=2.5", "link.loss_ratio=0"]
START = (-0.60, -0.35, 1.5708)
GOAL = (0.05, 0.35)
LAWS = ["asg-ism", "pid"]
# Every column that is a number of the run and not of the link's bytes.
COLUMNS = ("true_x_m", "true_y_m", "true_theta_rad", "eta1_cmd_m_s", "theta_dot_cmd_rad_s",
           "pwm_left_counts", "pwm_right_counts", "est_x_m", "est_y_m")  # fmt: skip


@pytest.fixture
def _exact_camera(monkeypatch: pytest.MonkeyPatch) -> None:
    exact = LocaliserError(
        sigma_xy_m=0, sigma_theta_rad=0, not_seen_ratio=0, outlier_ratio=0, outlier_xy_m=0,
        outlier_theta_rad=0, quality_ratio=1, place_ratio=0,
    )  # fmt: skip
    monkeypatch.setattr(sim_twin.twin, "load_localiser_error", lambda: exact)


def run(scenario: Scenario, outer: str, seed: int = 1) -> RunRecord:
    """Run in memory; every one of these runs comes to its end."""
    record = execute_in_memory(RunSpec(scenario, "twin", "pose", outer, "asg-ism", seed, Path()))
    assert record.manifest.outcome == "complete", record.manifest.outcome_detail
    return record


def moved(start: Sequence[float], goal: Sequence[float], fence_m: float = 4.0) -> Scenario:
    """Return scenario 1 with another start and goal in a wide fence."""
    x_m, y_m, theta_rad = start
    fence = [f"safety.fence_{axis}_{end}_m={sign}{fence_m}" for axis in "xy"
             for end, sign in (("min", "-"), ("max", ""))]  # fmt: skip
    return load_scenario(
        "scenario-1",
        [*SHORT, *fence, f"start={{x_m={x_m!r},y_m={y_m!r},theta_rad={theta_rad!r}}}",
         f"reference.x_m={goal[0]!r}", f"reference.y_m={goal[1]!r}"],
    )  # fmt: skip


def path_of(record: RunRecord) -> NDArray[np.float64]:
    """Return the true path, (ticks, 3): X, Y, heading."""
    return np.column_stack([record.samples[f"true_{name}"] for name in ("x_m", "y_m", "theta_rad")])


def same(one: RunRecord, two: RunRecord, ticks: int | None = None) -> bool:
    """Say whether two runs are one, to the last bit, over their first ticks."""
    return all(
        np.array_equal(one.samples[name][:ticks], two.samples[name][:ticks], equal_nan=True)
        for name in COLUMNS
    )


def turned(point: Sequence[float], angle_rad: float) -> tuple[float, float]:
    """Return a point turned about the origin."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return c * point[0] - s * point[1], s * point[0] + c * point[1]


@pytest.mark.parametrize("outer", LAWS)
@pytest.mark.usefixtures("_exact_camera")
def test_the_mirrored_scene_gives_the_mirrored_path(outer: str) -> None:
    """Y and headings change their signs, left and right change places; nothing else does."""
    plain = path_of(run(moved(START, GOAL), outer))
    x_m, y_m, theta_rad = START
    mirrored = path_of(run(moved((x_m, -y_m, -theta_rad), (GOAL[0], -GOAL[1])), outer))
    assert mirrored * [1, -1, -1] == pytest.approx(plain, abs=1e-9)
    assert np.ptp(plain[:, 0]) > 0.1  # it moved


@pytest.mark.parametrize(
    ("outer", "angle_rad"),
    [("pid", 0.7), ("pid", -2.0), ("pid", math.pi / 2), ("asg-ism", math.pi / 2),
     ("asg-ism", math.pi)],
)  # fmt: skip
@pytest.mark.usefixtures("_exact_camera")
def test_the_turned_scene_gives_the_turned_path(outer: str, angle_rad: float) -> None:
    """PID at any angle; ASG-ISM, whose sign acts on each axis, at quarter turns."""
    plain = path_of(run(moved(START, GOAL), outer))
    start = (*turned(START[:2], angle_rad), START[2] + angle_rad)
    path = path_of(run(moved(start, turned(GOAL, angle_rad)), outer))
    back = np.array([turned(point, -angle_rad) for point in path[:, :2].tolist()])
    assert back == pytest.approx(plain[:, :2], abs=1e-6)
    assert path[:, 2] - angle_rad == pytest.approx(plain[:, 2], abs=1e-6)


@pytest.mark.parametrize("outer", LAWS)
@pytest.mark.usefixtures("_exact_camera")
def test_the_shifted_scene_gives_the_shifted_path(outer: str) -> None:
    """No place of the floor is special."""
    plain = path_of(run(moved(START, GOAL), outer))
    start = (START[0] + 1.7, START[1] - 2.3, START[2])
    path = path_of(run(moved(start, (GOAL[0] + 1.7, GOAL[1] - 2.3)), outer))
    assert path - [1.7, -2.3, 0.0] == pytest.approx(plain, abs=1e-6)


@pytest.mark.parametrize("turns", [-1, 1])
@pytest.mark.parametrize("outer", LAWS)
@pytest.mark.usefixtures("_exact_camera")
def test_a_heading_is_the_same_after_a_full_turn(outer: str, turns: int) -> None:
    """Theta and theta + 2 pi are one heading; the path does not know which was given."""
    plain = path_of(run(moved(START, GOAL), outer))
    theta_rad = START[2] + 2.0 * math.pi * turns
    if abs(theta_rad) > 7.0:
        theta_rad = START[2] - 2.0 * math.pi
    path = path_of(run(moved((*START[:2], theta_rad), GOAL), outer))
    assert path[:, :2] == pytest.approx(plain[:, :2], abs=1e-6)
    assert np.cos(path[:, 2] - plain[:, 2]) == pytest.approx(np.ones(len(path)), abs=1e-9)


@pytest.mark.parametrize("outer", LAWS)
def test_the_same_run_twice_and_a_longer_one(outer: str) -> None:
    """One seed is one run; a longer duration changes nothing before its end; a seed does."""
    plain = run(load_scenario("scenario-1", SHORT), outer)
    assert same(plain, run(load_scenario("scenario-1", SHORT), outer))
    longer = run(load_scenario("scenario-1", [*SHORT, "duration_s=3"]), outer)
    ticks = plain.samples["t_s"].size
    assert longer.samples["t_s"].size == ticks + 15
    assert same(plain, longer, ticks)
    assert not same(plain, run(load_scenario("scenario-1", SHORT), outer, seed=2))


def test_the_order_of_changes_does_not_matter() -> None:
    """--set of different keys commutes; of one key the last counts."""
    changes = ["robot.mass_kg=3.3", "link.latency_s=0.03", "start.x_m=-0.5"]
    scenarios = [load_scenario("scenario-1", order) for order in permutations(changes)]
    assert all(scenario == scenarios[0] for scenario in scenarios)
    assert load_scenario("scenario-1", ["start.x_m=9", *changes]) == scenarios[0]


def test_a_value_named_in_another_way_is_the_same_value(tmp_path: Path) -> None:
    """Dotted or as a table, as 3 or 3.0 or 0.3e1, by --set or in a file on a base: one scenario."""
    named = load_scenario("scenario-1", ["start.x_m=-0.5", "robot.mass_kg=3", "duration_s=2"])
    table = "start={x_m=-0.5,y_m=-0.35,theta_rad=1.5708}"
    assert load_scenario("scenario-1", [table, "robot.mass_kg=0.3e1", "duration_s=2.0"]) == named
    own = tmp_path / "own.toml"
    own.write_text(
        'base = "scenario-1"\nduration_s = 2\nrobot.mass_kg = 3\nstart.x_m = -0.5\n',
        encoding="utf-8",
    )
    assert load_scenario(str(own)) == named
    assert load_scenario(str(own), ["link.baud=57600"]) == named
    assert same(run(load_scenario(str(own)), "pid"), run(named, "pid"))


def test_no_disturbance_is_one_of_amplitude_zero_or_of_later() -> None:
    """What does not act changes nothing, and neither does a fault after the end."""
    plain = run(load_scenario("scenario-1", SHORT), "pid")
    for nothing in (
        'disturbances=[{target="force_left_n",shape="step",amplitude=0.0}]',
        'disturbances=[{target="force_left_n",shape="step",amplitude=9.0,start_s=60.0}]',
        'faults=[{kind="motor_stuck",start_s=60.0}]',
        "safety.fence_x_max_m=3.0",
    ):
        assert same(plain, run(load_scenario("scenario-1", [*SHORT, nothing]), "pid")), nothing


def test_the_order_of_runs_does_not_change_their_figures(tmp_path: Path) -> None:
    """`hil compare A B` and `B A` say the same of each run."""
    for outer in LAWS:
        hil("run", "scenario-1", "--camera", "pose", "--outer", outer, "--set", "duration_s=0.5",
            "--out", tmp_path / outer)  # fmt: skip
    told = []
    for order in (LAWS, LAWS[::-1]):
        done = hil("compare", *(tmp_path / outer for outer in order), "--json")
        told.append({run["label"]: run["figures"] for run in done.json["runs"]})
    assert told[0] == told[1]
    assert set(told[0]) == set(LAWS)
