"""The three experiments with a robot of another kind and size than the thesis's."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pytest

from hil.config.deck import load_deck
from hil.runs.execute import RunSpec, execute_in_memory
from tests.system.runs import scenario_with

DECK = load_deck("thesis")
CHOSEN = ("robot.file=diff-2wd", "camera.file=diff-2wd")


def run_two_wheels(name: str, outer: str, camera: str, *overrides: str):
    """Return what the run of a scenario with the differential robot gives."""
    return execute_in_memory(
        RunSpec(
            scenario=scenario_with(name, [*CHOSEN, *overrides]),
            target="twin", camera=camera, outer=outer, inner="asg-ism", seed=2, out=Path(),
        )
    )  # fmt: skip


@pytest.mark.parametrize(("name", "outer"), [*product(DECK.scenarios, DECK.laws)])
def test_a_differential_robot_passes_the_three_experiments(name: str, outer: str) -> None:
    """With a true robot 10 % off the believed one, every requirement holds with either law."""
    record = run_two_wheels(name, outer, "pose")
    assert record.manifest.outcome == "complete", record.manifest.outcome_detail
    assert [verdict.text() for verdict in record.verdicts() if not verdict.holds] == []


@pytest.mark.parametrize(
    ("name", "outer"), [*zip(DECK.scenarios, ("pid", "asg-ism", "pid"), strict=True)]
)
def test_it_passes_them_as_its_rendered_marks_show_it(name: str, outer: str) -> None:
    """The small robot is drawn with its own two wheels and marks, and found by them."""
    record = run_two_wheels(name, outer, "rendered")
    assert record.manifest.outcome == "complete", record.manifest.outcome_detail
    assert [verdict.text() for verdict in record.verdicts() if not verdict.holds] == []


def test_marks_where_another_robot_has_them_fail_it() -> None:
    """Negative control: the host that believes marks on the wrong side of the robot does not arrive."""
    record = run_two_wheels("scenario-1", "pid", "rendered", "camera.marks.swapped_marks=true")
    assert not all(verdict.holds for verdict in record.verdicts())
