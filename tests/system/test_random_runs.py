"""A few dozen runs drawn at random; thousands: `python -m tests.system.random_runs --runs 2000`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hil.config.load import load_scenario
from hil.record.reader import RunRecord
from hil.runs.execute import RunSpec, execute_in_memory
from tests.system.random_runs import draw, problems, run_seed

SEEDS = range(40)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_run_drawn_at_random_ends_by_a_name_and_within_its_bounds(seed: int) -> None:
    """No exception, no NaN, no speed above the bound, not outside the fence for more than 0.3 s."""
    result = run_seed(seed)
    assert result.problems == ()
    assert result.end


def test_what_is_drawn_covers_laws_references_links_and_faults() -> None:
    """The draw is no constant: each kind is among the first few dozen, and one seed is one draw."""
    drawn = [draw(seed) for seed in SEEDS]
    assert {(outer, inner) for _, outer, inner in drawn} == {
        (outer, inner) for outer in ("pid", "asg-ism") for inner in ("pid", "asg-ism")
    }
    scenarios = [scenario for scenario, _, _ in drawn]
    assert {s.reference.kind for s in scenarios} == {"point", "circle", "waypoints"}
    assert {s.robot.variant for s in scenarios} == {"constrained", "slip"}
    assert len({fault.kind for s in scenarios for fault in s.faults}) >= 5
    assert any(s.link.loss_ratio for s in scenarios)
    assert any(s.disturbances for s in scenarios)
    assert draw(3) == drawn[3]


@pytest.fixture(scope="module")
def whole() -> RunRecord:
    """Return a second of a run in which nothing is wrong."""
    scenario = load_scenario("scenario-1", ["duration_s=1"])
    return execute_in_memory(RunSpec(scenario, "twin", "pose", "pid", "pid", 1, Path()))


def altered(record: RunRecord, **columns: Any) -> RunRecord:
    """Return the record with some ticks of columns replaced."""
    samples = {name: values.copy() for name, values in record.samples.items()}
    for name, (ticks, value) in columns.items():
        samples[name][ticks] = value
    return replace(record, samples=samples)


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        ({"est_x_m": (slice(3, 4), np.nan)}, "est_x_m is not finite"),
        ({"eta1_cmd_m_s": (slice(3, 4), -0.51)}, "eta1_cmd_m_s reached 0.510, bound 0.500"),
        ({"omega_cmd_left_rad_s": (slice(3, 4), 20.1)}, "omega_cmd_left_rad_s"),
        ({"true_eta1_m_s": (slice(3, 4), 1.0)}, "true_eta1_m_s"),
        ({"true_y_m": (slice(0, 11), 0.63)}, "outside the fence for 0.33 s"),
    ],
)
def test_the_check_sees_what_it_is_for(
    whole: RunRecord, columns: dict[str, Any], says: str
) -> None:
    """Negative controls: each thing that must not be is found, and nothing in the whole run."""
    scenario = load_scenario("scenario-1", ["duration_s=1"])
    assert list(problems(scenario, whole)) == []
    found = list(problems(scenario, altered(whole, **columns)))
    assert len(found) == 1
    assert says in found[0]


def test_a_fault_without_a_name_is_a_problem(whole: RunRecord) -> None:
    """An end that does not say what failed is no end by name."""
    scenario = load_scenario("scenario-1", ["duration_s=1"])
    for outcome, detail in (("fault", "stopped"), ("running", "")):
        manifest: Any = SimpleNamespace(outcome=outcome, outcome_detail=detail)
        assert len(list(problems(scenario, replace(whole, manifest=manifest)))) == 1
