"""The suite: its split, its conditions, its scores; references with stops and from a file."""

import json
import math
from importlib.resources import files

import pytest

from hil.analysis.costs import USUAL
from hil.config.deck import Cell, Deck, load_deck
from hil.config.load import load_scenario
from hil.control.references import make_reference, unfinished
from hil.core.errors import BadInput
from hil.study.experiment import Conditions, deck_specs
from hil.study.suite import (
    FAILED,
    KEPT,
    MOST,
    ByTask,
    Scores,
    Yardstick,
    refuse_seen,
    spread_over,
    together,
)
from hil.study.tune import Case, Plan, Trial
from hil.study.tune_work import identity_of, load_tasks
from hil.study.tuning_verdict import judge


def test_no_search_sees_a_task_or_a_condition_that_the_verdict_uses():
    """The two halves of the suite share neither; each has several of both."""
    deck = load_deck("suite")
    seen, unseen = deck.search_cells(), deck.unseen_cells()
    for side in ("scenario", "condition"):
        one, two = ({getattr(cell, side) for cell in cells} for cells in (seen, unseen))
        assert len(one) >= 4
        assert len(two) >= 4
        assert not one & two
    refuse_seen(unseen, seen)


@pytest.mark.parametrize(
    ("cell", "told"), [("ahead in late-camera", "task"), ("beside in calm", "condition")]
)
def test_a_verdict_on_what_was_searched_is_refused(cell, told):
    """A task, or a condition, that a search has seen is named."""
    scenario, _, condition = cell.partition(" in ")
    seen = load_deck("suite").search_cells()
    with pytest.raises(BadInput, match=f"the search has seen {told}"):
        refuse_seen([Cell(scenario=scenario, condition=condition)], seen)


def test_tune_judges_the_suite_on_its_unseen_half():
    """What `hil tune suite` judges on has neither task nor condition of what it searches."""
    tasks = load_tasks(["suite"], None)
    seen = {name.partition("-in-") for name in tasks.names}
    judged = {name.partition("-in-") for name in tasks.judged}
    assert len(judged) == 30
    assert not {name for name, *_ in seen} & {name for name, *_ in judged}
    assert not {one[2] for one in seen} & {one[2] for one in judged}
    assert {case.scenario for case in tasks.cases()} == set(tasks.names)


def test_a_search_is_another_one_where_what_judges_it_changed(tmp_path):
    """Runs are kept by the names of their tasks: an unseen condition, or the yardstick's task, made other."""
    text = files("hil").joinpath("data/decks/suite.toml").read_text(encoding="utf-8")
    file = tmp_path / "own.toml"

    def identity(deck):
        file.write_text(deck)
        tasks = load_tasks([str(file)], None)
        return identity_of(tasks, Plan(cases=tasks.cases()), "pose", "program")["tasks"]

    unseen = text.replace(
        '"robot.encoder_counts_per_turn" = 120', '"robot.encoder_counts_per_turn" = 240'
    )
    assert unseen != text
    assert identity(text) == identity(text)
    assert identity(unseen) != identity(text)


def test_tune_refuses_to_judge_on_runs_it_tuned_on():
    """A held-out tape with a seed of the search is refused; the same with another is judged."""
    figures = [{"iae_m_s": 1.0}] * 4
    trials = [
        Trial(law, None, Case("scenario-1", "calm", "pid"), seed)
        for seed in (1, 1001)
        for law in ("pid", "asg-ism")
    ]
    with pytest.raises(BadInput, match="held-out seeds 1: the search has run them"):
        judge(trials, figures)
    assert judge(trials[2:], figures[2:]).seeds == (1001,)


def test_a_deck_with_conditions_and_no_split_is_not_tuned_on(tmp_path):
    """Nothing would be left to judge on."""
    file = tmp_path / "deck.toml"
    file.write_text('scenarios = ["ahead"]\n[conditions.calm]\n')
    with pytest.raises(BadInput, match="no \\[search\\]"):
        load_tasks([str(file)], None)


@pytest.mark.parametrize(
    ("search", "told"),
    [
        ({"scenarios": ["ahead", "beside"], "conditions": ["calm"]}, "names all of them"),
        ({"scenarios": ["nowhere"], "conditions": ["calm"]}, "none of the deck's scenarios"),
    ],
)
def test_a_split_leaves_something_unseen(search, told):
    """A split that names everything, or what is not there, is refused."""
    tree = {
        "scenarios": ["ahead", "beside"],
        "conditions": {"calm": {}, "wet": {}},
        "search": search,
    }
    with pytest.raises(ValueError, match=told):
        Deck.model_validate(tree)


def test_conditions_change_what_they_say_and_nothing_else():
    """The payload is in the true robot alone; a brake is beside the scenario's own disturbances."""
    deck = load_deck("suite")
    calm, payload, brake = (
        deck.scenario_of(Cell(scenario="ahead", condition=name))
        for name in ("calm", "payload", "brake-left")
    )
    assert payload.mismatch["mass_kg"] == 1.6
    assert payload.mismatch["inertia_kg_m2"] == 1.8
    assert payload.robot == calm.robot
    same = {"name", "mismatch"}
    assert payload.model_dump(exclude=same) == calm.model_dump(exclude=same)
    assert [one.target for one in brake.disturbances] == ["brake_left_n_m"]
    assert not calm.disturbances


def test_an_experiment_runs_every_cell_once(tmp_path):
    """Nine tasks in eleven conditions with two laws, each in a folder of its own."""
    deck = load_deck("suite")
    specs = deck_specs(deck, Conditions("twin", "pose", "asg-ism", 1, 1, (), ""), tmp_path)
    assert len(specs) == 9 * 11 * 2
    assert len({spec.out for spec in specs}) == len(specs)


@pytest.mark.parametrize("name", load_deck("suite").scenarios)
def test_every_task_of_the_suite_fits_its_time_and_the_camera(name):
    """The reference ends before the run does and stays within the fence by a wheel's width."""
    scenario = load_scenario(name)
    assert unfinished(scenario.reference, scenario.duration_s) is None
    reference = make_reference(scenario.reference)
    safety = scenario.safety
    for step in range(int(10 * scenario.duration_s)):
        x_m, y_m = reference.at(0.1 * step).z1_m
        assert safety.fence_x_min_m + 0.1 <= x_m <= safety.fence_x_max_m - 0.1
        assert safety.fence_y_min_m + 0.1 <= y_m <= safety.fence_y_max_m - 0.1


def test_a_square_stops_at_its_corners():
    """Straight legs: at rest at each corner for the pause, and half-way at half a leg's time."""
    config = load_scenario("square-stops").reference
    reference = make_reference(config)
    leg_s = 35 / 16 * 0.8 / config.speed_max_m_s  # the septic step's peak speed, on 0.8 m
    corner = reference.at(leg_s + 0.5 * config.pause_s)
    assert corner.z1_m == pytest.approx((0.4, -0.3), abs=1e-9)
    assert corner.z1_dot_m_s == pytest.approx((0.0, 0.0), abs=1e-9)
    assert reference.at(0.5 * leg_s).z1_m == pytest.approx((0.0, -0.3), abs=1e-9)
    assert reference.at(1e3).z1_m == pytest.approx((-0.4, -0.3), abs=1e-9)


SCENARIO = """
base = "ahead"
[reference]
kind = "waypoints"
file = "way.csv"
"""


def test_a_path_comes_from_a_file_beside_the_scenario(tmp_path):
    """Its points are in the resolved tree, so a record needs the file no more."""
    (tmp_path / "task.toml").write_text(SCENARIO)
    (tmp_path / "way.csv").write_text("x_m,y_m\n-0.5,0\n0,0.1\n0.4,0\n")
    scenario = load_scenario(str(tmp_path / "task.toml"))
    assert scenario.reference.points_m == ((-0.5, 0.0), (0.0, 0.1), (0.4, 0.0))
    assert "file" not in scenario.model_dump()["reference"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("x,y\n1,2\n", "first line must be x_m,y_m"),
        ("x_m,y_m\n0,0\n1\n", "line 3 is '1': needs two numbers"),
        (None, "cannot be read"),
    ],
)
def test_a_path_file_that_is_none_is_told_in_one_line(tmp_path, text, told):
    """What, where, and what to do."""
    (tmp_path / "task.toml").write_text(SCENARIO)
    if text is not None:
        (tmp_path / "way.csv").write_text(text)
    with pytest.raises(BadInput, match=told):
        load_scenario(str(tmp_path / "task.toml"))


def figures_of(factor, rest_m=0.001):
    return dict.fromkeys(KEPT, factor) | {"delta1_worst_last_second_m": rest_m}


def test_scores_are_normalised_by_the_task():
    """The yardstick itself scores 1 on every task however large its figures; twice as much scores 2."""
    yard = Yardstick({"small": figures_of(0.01, 0.02), "large": figures_of(50.0, 0.02)})
    for task, usual in (("small", 0.01), ("large", 50.0)):
        assert yard.scores(f"{task} in calm", figures_of(usual, 0.02)) == pytest.approx((1, 1, 1))
        twice = yard.scores(f"{task} in slope", figures_of(2 * usual, 0.04))
        assert twice == pytest.approx((2, 2, 2))
    assert yard.scores("small in calm", {}) == FAILED
    assert yard.scores("small in calm", figures_of(math.nan)) == FAILED
    assert max(yard.scores("small in calm", figures_of(1e9, 9.0))) == MOST


def test_tune_counts_runs_of_the_suite_by_their_task():
    """A run twice as bad as the yardstick in all costs 2 (1 + 0.2 + 0.05), whatever the task's size."""

    def work(trial):
        return figures_of(2.0 * size[trial.case.scenario.partition("-in-")[0]], 0.04)

    size = {"small": 0.01, "large": 50.0}
    yard = Yardstick.of({name: figures_of(usual, 0.02) for name, usual in size.items()})
    for name in size:
        trial = Trial("pid", None, Case(f"{name}-in-slope", "calm", "pid"), 1)
        assert USUAL.of(ByTask(work, yard)(trial)) == pytest.approx(2.5)
    with pytest.raises(BadInput, match="ends early in it"):
        Yardstick.of({"small": {}})


def test_several_runs_count_by_mean_and_worst():
    """Accuracy 0.8 of the mean of 1 and 3 and 0.2 of 3; calm and effort are means."""
    found = together([Scores(1.0, 1.0, 2.0), Scores(3.0, 2.0, 4.0)])
    assert found == pytest.approx((0.8 * 2.0 + 0.2 * 3.0, 1.5, 3.0))


def test_cells_are_taken_evenly():
    """Of 5 x 6 cells, 6 have every condition once and every task once or twice; 99 are all 30."""
    cells = load_deck("suite").unseen_cells()
    six = spread_over(cells, 6)
    assert len({cell.condition for cell in six}) == 6
    assert len({cell.scenario for cell in six}) == 5
    assert sorted(map(str, spread_over(cells, 99))) == sorted(map(str, cells))
    assert json.dumps([str(c) for c in six]) == json.dumps([str(c) for c in spread_over(cells, 6)])
