"""Limits of host, geometry and board fit together, whatever the robot."""

from __future__ import annotations

import math
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st

from hil.config.fields import Setting
from hil.config.fields import settings as settings_of
from hil.config.fit import board_parameters, check_fit
from hil.config.limits import board_table, check_board
from hil.config.load import build, load_scenario, put_value
from hil.config.robot import RobotConfig
from hil.config.scenario import Scenario
from hil.control.estimators.geometry import BelievedGeometry
from hil.control.laws.within import WithinWheelSpeed
from hil.core.errors import BadInput
from hil.core.types import Estimate, OuterCommand, Pose, ReferenceState
from hil.record.reader import RunRecord
from hil.runs.execute import RunSpec, execute_in_memory
from hil.wire.link import StatusText
from hil.wire.refusal import refused_set_point
from tests.system.random_runs import problems

SMALL_WHEELS = [
    "robot.wheel_radius_m=0.0309", "robot.floor.friction_ratio=1.086",
    "start.x_m=0.741", "start.y_m=-0.535", "start.theta_rad=1.909",
    "control.limits.turn_missing_rad_s=20",  # never: giving way to the turn, it asks for less
]  # fmt: skip
AT_REST = Estimate(0.0, Pose(0.0, 0.0, 0.0), 0.0, 0.0, (0.0, 0.0), (0.0, 0.0))
HERE = ReferenceState((0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0))


def run(scenario: Scenario, outer: str = "asg-ism") -> RunRecord:
    """Run in memory, with poses drawn."""
    return execute_in_memory(RunSpec(scenario, "twin", "pose", outer, "pid", 1, Path()))


class Asks:
    """An outer law that always asks for the same."""

    def __init__(self, eta1_m_s: float, theta_dot_rad_s: float) -> None:
        self._command = OuterCommand(eta1_m_s, theta_dot_rad_s, {"saturated": 0.0})

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Nothing to start anew."""

    def step(self, *_: object) -> OuterCommand:
        """Return what is always asked."""
        return self._command


@given(
    radius_m=st.floats(0.01, 0.5),
    track_m=st.floats(0.05, 2.0),
    eta1_m_s=st.floats(-5.0, 5.0),
    theta_dot_rad_s=st.floats(-20.0, 20.0),
    bound_rad_s=st.floats(0.5, 60.0),
)
@settings(max_examples=300, deadline=None)
def test_no_wheel_is_asked_more_than_the_board_takes_and_the_curvature_is_kept(
    radius_m: float, track_m: float, eta1_m_s: float, theta_dot_rad_s: float, bound_rad_s: float
) -> None:
    """Over the whole range of robots and limits, rounded to the 32-bit floats of the wire."""
    geometry = BelievedGeometry(radius_m, track_m, 0.03, 1920)
    law = WithinWheelSpeed(Asks(eta1_m_s, theta_dot_rad_s), geometry, bound_rad_s)
    given_now = law.step(HERE, AT_REST, 1 / 30)
    wheels = geometry.wheels(given_now.eta1_m_s, given_now.theta_dot_rad_s)
    assert all(abs(np.float32(wheel)) <= np.float32(bound_rad_s) for wheel in wheels)
    # The same curvature and direction: theta_dot / eta1 as asked, without a division by zero.
    cross = given_now.eta1_m_s * theta_dot_rad_s - given_now.theta_dot_rad_s * eta1_m_s
    assert abs(cross) <= 1e-9 * (1.0 + abs(eta1_m_s * theta_dot_rad_s))
    assert given_now.eta1_m_s * eta1_m_s >= 0.0
    asked = max(abs(wheel) for wheel in geometry.wheels(eta1_m_s, theta_dot_rad_s))
    if asked <= bound_rad_s:
        assert (given_now.eta1_m_s, given_now.theta_dot_rad_s) == (eta1_m_s, theta_dot_rad_s)
    else:
        assert given_now.trace["saturated"] == 1.0
        assert max(abs(wheel) for wheel in wheels) == pytest.approx(bound_rad_s, rel=1e-5)


@pytest.mark.parametrize("outer", ["asg-ism", "pid"])
def test_small_wheels_run_at_what_the_board_takes(outer: str) -> None:
    """Wheels of 62 mm: speed and turn together ask 25 rad/s, and the robot reaches its point."""
    # Later it stands and turns by turns: friction takes what the motors give, and a stall is named.
    scenario = load_scenario("scenario-1", [*SMALL_WHEELS, "duration_s=12"])
    limits, robot = scenario.control.limits, scenario.robot
    rim_m_s = limits.eta1_max_m_s + 0.5 * robot.track_m * limits.theta_dot_max_rad_s
    assert rim_m_s / robot.wheel_radius_m == pytest.approx(24.94, abs=0.01)
    record = run(scenario, outer)
    assert (record.manifest.outcome, record.manifest.outcome_detail) == ("complete", "")
    asked = np.abs([record.samples[f"omega_cmd_{side}_rad_s"] for side in ("left", "right")])
    assert asked.max() <= 20.0
    assert asked.max() > 19.99  # the bound was met: without it the board had refused
    assert record.figures().values["delta1_worst_last_second_m"] < 0.03


def test_a_set_point_that_the_board_refuses_is_said_by_its_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Without the scaling the run stops at the refusal, and not 250 ms later by a time-out."""
    monkeypatch.setattr("hil.runs.assembly.wheel_speed_max_rad_s", lambda _: math.inf)
    record = run(load_scenario("scenario-1", SMALL_WHEELS))
    assert record.manifest.outcome == "fault"
    assert "set-point refused: above W_MAX" in record.manifest.outcome_detail
    assert "TIMEOUT" not in record.manifest.outcome_detail


def test_a_late_set_point_is_no_refusal_of_its_value() -> None:
    """Warnings of the board (out of order, not armed) do not stop a run."""
    assert refused_set_point(StatusText(0.0, 3, "set-point refused: above W_MAX"))
    assert not refused_set_point(StatusText(0.0, 4, "set-point refused: sequence number not newer"))
    assert not refused_set_point(StatusText(0.0, 3, "not armed: battery low"))


# -- one source for every bound ----------------------------------------------------------------


def _host_values(scenario: Scenario) -> list[Setting]:
    """Return every bounded number of the scenario that stands outside the table of the board."""
    tree = scenario.model_dump(mode="json")
    found = []
    for setting in settings_of(Scenario):
        if setting.low is None or setting.high is None or setting.key.startswith("board."):
            continue
        if "*" not in setting.key and setting.kind in {"", "point"} and _has(tree, setting.key):
            found.append(setting)
    return found


def _has(tree: Any, key: str) -> bool:
    for part in key.split("."):
        if not isinstance(tree, dict) or part not in tree:
            return False
        tree = tree[part]
    return tree is not None


def _board_after(scenario: Scenario, key: str, value: float) -> dict[str, float] | None:
    tree = scenario.model_dump(mode="json")
    put_value(tree, key, value)
    try:
        return board_parameters(build(Scenario, tree, "test"), "pid")
    except BadInput:
        return None


def test_a_host_value_that_becomes_a_parameter_has_the_parameters_bounds() -> None:
    """Walk all: where a change of a host value changes what the board is given, bounds are one."""
    # Slow wheels, so that the board can count whatever encoder there is.
    scenario = load_scenario("scenario-1", ["board.OVER_W=5", "board.W_MAX=5"])
    before = board_parameters(scenario, "pid")
    shared = {}
    for setting in _host_values(scenario):
        assert setting.low is not None
        assert setting.high is not None
        middle = math.floor(0.5 * (setting.low + setting.high))
        after = _board_after(scenario, setting.key, middle) or before
        for name in before:
            if after[name] != before[name]:
                shared[setting.key] = name
                entry = board_table()[name]
                assert (setting.low, setting.high) == (entry.minimum, entry.maximum), setting.key
                for bound in (setting.low, setting.high):
                    given_now = _board_after(scenario, setting.key, bound)
                    assert given_now is not None
                    check_board(given_now)
    assert shared == {"robot.encoder_counts_per_turn": "ENC_COUNTS"}


def test_defaults_of_host_and_board_fit_and_every_built_in_scenario_does() -> None:
    """The negative controls of the fit: what ships passes it."""
    for name in ("scenario-1", "scenario-2", "scenario-3", "circle"):
        check_fit(load_scenario(name))


@pytest.mark.parametrize(
    ("key", "good", "bad"),
    [
        # 127 counts in 4 ms: 31,750 counts/s; over 28 rad/s that is 7,124.8 counts a turn.
        ("robot.encoder_counts_per_turn", 7124, 7125),
        ("board.W_MAX", 28.0, 28.01),
        ("board.OVER_W", 20.0, 19.99),
        # 0.8 of 250 ms.
        ("control.rate_hz", 5.0, 4.99),
        # 1 / 30 Hz over 0.8.
        ("board.SP_TIMEOUT", 41.7, 41.6),
        # 10.85 V + 0.7 (12.3 - 10.85) V = 11.865 V.
        ("board.BATT_LOW", 11.86, 11.87),
    ],
)
def test_fit_on_both_sides_of_each_limit(key: str, good: float, bad: float) -> None:
    """By hand: the last value that fits, and the first that does not."""
    check_fit(load_scenario("scenario-1", [f"{key}={good}"]))
    with pytest.raises(BadInput, match=key.rsplit(".", maxsplit=1)[-1].split("_", maxsplit=1)[0]):
        check_fit(load_scenario("scenario-1", [f"{key}={bad}"]))


# -- robots over the whole range of their file -------------------------------------------------

ROBOT = [
    s for s in settings_of(RobotConfig)
    if s.low is not None and s.high is not None and not s.key.startswith("bring_up")
]  # fmt: skip


def drawn_robot(seed: int) -> dict[str, Any]:
    """Return a scenario's tree with every number of the robot drawn over its whole range."""
    rng = Random(seed)
    tree = load_scenario("scenario-1", ["duration_s=0.4", "mismatch={}"]).model_dump(mode="json")
    for setting in ROBOT:
        assert setting.low is not None
        assert setting.high is not None
        if setting.low < 0:
            value = rng.uniform(setting.low, setting.high)
        else:
            least = max(setting.low, 1e-4 * setting.high)
            value = math.exp(rng.uniform(math.log(least), math.log(setting.high)))
        is_count = setting.unit in {"motors", "counts/turn"}
        put_value(tree["robot"], setting.key, round(value) if is_count else value)
    robot, motor, battery = tree["robot"], tree["robot"]["motor"], tree["robot"]["battery"]
    robot["variant"] = rng.choice(["constrained", "slip", "lifted"])
    if rng.random() < 0.9:  # else left as drawn, and mostly refused
        motor["stiction_n_m"] = max(motor["stiction_n_m"], motor["coulomb_n_m"])
        motor["inductance_h"] = 0.1
        battery["empty_v"] = min(battery["empty_v"], battery["full_v"])
        robot["d0_m"] = min(robot["d0_m"], 0.9 * (robot["front_axle_m"] + robot["rear_axle_m"]))
        robot["encoder_counts_per_turn"] = min(robot["encoder_counts_per_turn"], 7000)
        tree["board"]["BATT_LOW"] = 0.0
    return tree


@given(seed=st.integers(0, 2**31))
@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_any_robot_of_the_file_is_refused_or_runs(seed: int) -> None:
    """Refused in one line before anything moves, or armed and asked only what the board takes."""
    try:
        scenario = build(Scenario, drawn_robot(seed), "drawn")
        check_fit(scenario)
    except BadInput as error:
        event("refused")
        refusal = str(error)
    else:
        event("ran")
        refusal = ""
    assert "\n" not in refusal
    if refusal:
        return
    record = run(scenario)
    assert list(problems(scenario, record)) == []
    detail = record.manifest.outcome_detail
    assert "SETPOINT_TIMEOUT" not in detail
    assert "stayed" not in detail  # armed: nothing of the robot's file is refused by the board
    assert any(item.kind == "armed" for item in record.events)
