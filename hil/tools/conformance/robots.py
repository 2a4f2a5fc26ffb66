"""What a robot's file must do, checked: the experiments hold on its twin, and say something of it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from hil.config.fit import check_fit
from hil.config.load import build, load_robot, load_scenario
from hil.config.robot import RobotConfig
from hil.config.scenario import Scenario
from hil.core.registry import BUILT_IN
from hil.record.reader import RunRecord
from hil.runs.execute import execute_in_memory
from hil.tools.conformance.laws import (
    require_equal_run,
    require_held,
    require_turned_fails,
    spec_of,
)
from hil.tools.conformance.report import Checks, Report

SCENARIOS = ("scenario-1", "scenario-2", "scenario-3")


def check_robot(robot: str | Path, *, overrides: Sequence[str] = ()) -> Report:
    """Return the report on a robot, by its built-in name or file, that passes every check.

    Raises AssertionError that names the checks that do not hold, BadInput for a file that is none.
    """
    return robot_report(robot, overrides=overrides).required()


def robot_report(robot: str | Path, *, overrides: Sequence[str] = ()) -> Report:
    """Return what the kit finds of a robot; raises BadInput for a file that is none."""
    config = load_robot(str(robot))
    where = str(robot) if str(robot).endswith(".toml") else BUILT_IN
    checks = Checks("robot", config.name, where)
    scenarios = [with_robot(load_scenario(name, overrides), config) for name in SCENARIOS]
    checks.run("values fit together", lambda: _fits(scenarios))
    runs: list[RunRecord] = []
    for scenario in scenarios:
        checks.run(f"{scenario.name} holds", partial(_holds, scenario, runs))
    rest = ("against itself", "negative control")
    if len(runs) < len(scenarios):
        checks.leave_out(rest, "the robot does not run")
        return checks.report()
    first = scenarios[0]
    checks.run(rest[0], lambda: require_equal_run(runs[0], first, first.control.outer))
    checks.run(rest[1], lambda: require_turned_fails(first, first.control.outer))
    return checks.report()


def with_robot(scenario: Scenario, robot: RobotConfig) -> Scenario:
    """Return the scenario with another robot in it, every value checked anew; raises BadInput."""
    tree = scenario.model_dump(mode="json") | {"robot": robot.model_dump(mode="json")}
    return build(Scenario, tree, robot.name)


def _fits(scenarios: Sequence[Scenario]) -> str:
    for scenario in scenarios:
        check_fit(scenario)
    return f"{len(scenarios)} scenarios"


def _holds(scenario: Scenario, runs: list[RunRecord]) -> str:
    record = execute_in_memory(spec_of(scenario, scenario.control.outer))
    runs.append(record)
    return require_held(record)
