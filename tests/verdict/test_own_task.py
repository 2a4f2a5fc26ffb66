"""A task of one's own beside the verdict: its ranking, and that a report says when it is another."""

from __future__ import annotations

import json
import math

import pytest
from click.testing import CliRunner

from hil.cli.verdict import command
from hil.config.deck import load_deck
from hil.core.errors import BadInput
from hil.study.own_task import Agreement, OwnTask, judged_on, only_laws, ranking
from hil.study.suite import KEPT, condition_of
from hil.study.verdict import shipped_text

TASK = """
base = "ahead"
name = "own"
duration_s = 3.0
requirements = []
[start]
x_m = -0.3
y_m = 0.0
theta_rad = 0.0
[reference]
kind = "point"
x_m = 0.1
y_m = 0.05
"""


@pytest.fixture(scope="module")
def data():
    """Return the data that ship."""
    return json.loads(shipped_text())


@pytest.fixture
def file(tmp_path):
    """Return a task that nobody tuned on."""
    path = tmp_path / "own.toml"
    path.write_text(TASK)
    return str(path)


def runs(factors):
    """Return what makes runs whose error is the law's factor of the yardstick's, all of them calm."""

    def make(jobs):
        return [
            dict.fromkeys(KEPT, 1.0)
            | {"iae_m_s": factors.get(job.outer, 1.0), "delta1_worst_last_second_m": 0.0}
            for job in jobs
        ]

    return make


def test_a_task_that_ranks_alike_is_said_to(data, file):
    """Factors in the order of the verdict give its order, tau 1."""
    usual = list(ranking(data))
    told = judged_on(
        OwnTask.of(file, load_deck("suite"), data),
        data,
        runs({law: 1.0 + 0.1 * place for place, law in enumerate(usual)}),
    )
    found = Agreement.of(told, data)
    assert found.same
    assert found.tau == pytest.approx(1.0)
    assert found.text() == f"own ranks the laws as the verdict does: {', '.join(usual)}"


def test_a_task_that_ranks_otherwise_is_said_to(data, file):
    """The reverse order: tau -1, both orders named."""
    usual = list(ranking(data))
    task = OwnTask.of(file, load_deck("suite"), data)
    told = judged_on(task, data, runs({law: 2.0 - 0.1 * n for n, law in enumerate(usual)}))
    found = Agreement.of(told, data)
    assert not found.same
    assert found.tau == pytest.approx(-1.0)
    assert "does not rank the laws as the verdict does (Kendall's tau -1.00)" in found.text()
    assert list(found.own) == usual[::-1]


def test_a_task_is_run_in_the_conditions_that_no_search_has_seen(data, file):
    """Those of the verdict's unseen cells and calm for the yardstick; the verdict's data stay as they are."""
    before = json.dumps(data)
    task = OwnTask.of(file, load_deck("suite"), data)
    assert {condition_of(cell) for cell in task.cells} == {
        condition_of(cell) for cell in data["unseen_cells"]
    }
    assert not {condition_of(cell) for cell in task.cells} & {
        condition_of(cell) for cell in data["search_cells"]
    }
    assert set(task.scenarios) == {*task.cells, "own in calm"}
    judged_on(task, data, runs({}))
    assert json.dumps(data) == before


def test_a_ranking_needs_two_laws():
    """One law alone has no rank: no tau, and the sentence says so."""
    alone = Agreement("own", {"pid": 1.0}, {"pid": 1.2})
    assert math.isnan(alone.tau)
    assert alone.to_json()["kendall_tau"] is None
    assert "nothing to rank" in alone.text()


def test_what_cannot_be_ranked_is_refused(data, file):
    """A task of the deck itself, a law without a front, a deck without the conditions."""
    deck = load_deck("suite")
    with pytest.raises(BadInput, match="one of the deck's own tasks"):
        OwnTask.of("beside", deck, data)
    with pytest.raises(BadInput, match="has no front"):
        only_laws(data, ["nobody"])
    with pytest.raises(BadInput, match="which this deck has not"):
        OwnTask.of(file, load_deck("thesis"), data)


def test_the_command_ranks_two_laws_on_a_file(data, file, tmp_path):
    """Real runs: one point of each front of two laws, in two conditions; a line and the same as JSON."""
    small = only_laws(data, ["pid", "backstepping"])
    small["unseen_cells"] = ["beside in brake-left", "behind in late-camera"]
    small["plan"] = small["plan"] | {"search_seeds": [11]}
    small["fronts"] = [
        front | {"points": front["points"][-1:]} for front in small["fronts"] if front["seed"] == 11
    ]
    kept = tmp_path / "kept.json"
    kept.write_text(json.dumps(small))
    asked = ["--task", file, "--kept", str(kept), "--workers", "1", "--json"]
    run = CliRunner().invoke(command, asked, standalone_mode=False, catch_exceptions=False)
    document = json.loads(run.stdout)
    assert document["task"] == "own"
    assert document["same_ranking"] == (
        list(document["task_ranking"]) == list(document["verdict_ranking"])
    )
    cells = document["data"]["fronts"][0]["points"][0]["unseen"]
    assert set(cells) == {"own in brake-left", "own in late-camera"}
    assert all(0.0 < cell[0][0] < 10.0 for cell in cells.values())
