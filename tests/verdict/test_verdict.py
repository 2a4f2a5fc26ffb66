"""The verdict: from runs to data, from data to words, and README's numbers."""

import copy
import json
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from hil.cli.verdict import command
from hil.core.errors import BadInput
from hil.study import verdict_page
from hil.study import verdict_words as words
from hil.study.suite import KEPT
from hil.study.verdict import (
    SHORT,
    Field,
    VerdictPlan,
    repeated_texts,
    shipped_gains,
    shipped_text,
    verdict_data,
)
from tests.verdict.pages import pages
from tests.verdict.shipped import FILES, judged_anew

ROOT = Path(__file__).resolve().parents[2]
PLAN = VerdictPlan(
    candidates=16, search_cells=2, search_seeds=(1, 2), picked=3, unseen_cells=30, ablation_cells=6
)
LAWS = ("pid", "asg-ism", "backstepping")


def runs(better):
    """Return made-up runs: louder is more accurate, and `better` laws by that factor at any calm."""

    def make(jobs):
        found = []
        for place, job in enumerate(jobs):
            gains = (
                {}
                if job.gains is None
                else getattr(job.gains, job.outer.replace("-", "_")).model_dump()
            )
            loud = gains.get("k1_s", gains.get("kd2_s", 6.0) / 6.0)
            luck = 1.0 + 0.02 * (len(job.cell) % 7 + place % 2)
            error = luck * better.get(job.outer, 1.0) / loud
            values = dict.fromkeys(KEPT, loud)
            found.append(values | {"iae_m_s": error, "delta1_worst_last_second_m": 0.005 * error})
        return found

    return make


@pytest.fixture(scope="module")
def told():
    """Make data of a field in which ASG-ISM is 30 % better at any calm, and one in which nobody is."""
    field = Field.of("suite", PLAN, LAWS)

    def data_of(better):
        parts = {"revision": "r", "command": "c", "parts": lambda _law: ("hold",)}
        *_, data = verdict_data(field, PLAN, runs(better), **parts)
        return json.loads(json.dumps(data))

    return {
        "wins": data_of({"asg-ism": 0.7}),
        "level": data_of({}),
        "loses": data_of({"asg-ism": 1.5}),
    }


def test_a_law_that_is_better_at_equal_calm_is_said_to_be(told):
    """By about 30 %, in the first line and in the table, with every seed of the search."""
    data = told["wins"]
    rows = [row for row in words.table_of(data) if row.law == "asg-ism" and row.level == 1.0]
    assert rows[0].stands
    assert rows[0].percent[0] == pytest.approx(-30, abs=6)
    assert "asg-ism is" in words.first_line(data)
    assert "more accurate than PID on unseen tasks" in words.first_line(data)


def test_where_none_wins_the_first_line_says_so(told):
    """Also where one is shown to lose, who is named."""
    assert words.first_line(told["level"]).startswith(
        "No sliding-mode law is shown to be more accurate"
    )
    lost = words.first_line(told["loses"])
    assert lost.startswith("No sliding-mode law")
    assert "less accurate: asg-ism" in lost


def test_a_verdict_that_flips_with_the_search_is_none(told):
    """With the second seed's front of ASG-ISM made twice as bad, no difference is shown."""
    data = copy.deepcopy(told["wins"])
    for front in data["fronts"]:
        if front["law"] == "asg-ism" and front["seed"] == 2:
            for point in front["points"]:
                for cell in point["unseen"].values():
                    for run in cell:
                        run[0] *= 2.0
    row = next(r for r in words.table_of(data) if r.law == "asg-ism" and r.level == 1.0)
    assert not row.stands
    assert row.text().startswith(words.NONE_SHOWN)


def test_a_law_that_is_never_that_calm_has_no_number(told):
    """Below the calm of its calmest point there is nothing to compare."""
    front = copy.deepcopy(told["level"]["fronts"][0])
    cells = told["level"]["unseen_cells"]
    assert words.at_calm(front, 1e-3, cells) is None
    assert set(words.at_calm(front, 10.0, cells)) == set(cells)


def test_between_two_points_accuracy_is_mixed():
    """Half-way in the logarithm of calm, half-way in that of accuracy."""

    def point(accuracy, calm):
        return {"search": [accuracy, calm, 1.0], "unseen": {"a in b": [[accuracy, calm, 1.0]]}}

    front = {"points": [point(1.0, 4.0), point(4.0, 1.0)]}
    assert words.at_calm(front, 2.0, ["a in b"])["a in b"] == pytest.approx(2.0)
    assert words.at_calm(front, 9.0, ["a in b"])["a in b"] == pytest.approx(1.0)


def test_data_hold_no_cell_that_a_search_has_seen(told):
    """Neither a task nor a condition is on both sides; seeds of the runs differ as well."""
    data = told["wins"]
    for part in (words.task_of, words.condition_of):
        one, two = ({part(cell) for cell in data[key]} for key in ("search_cells", "unseen_cells"))
        assert not one & two


def test_page_draws_every_law_and_says_the_first_line(told, tmp_path):
    """Fronts of all laws, by their names."""
    file = tmp_path / "verdict.html"
    verdict_page.write(file, told["wins"])
    text = file.read_text(encoding="utf-8")
    assert "<svg" in text
    assert all(law in text for law in LAWS)
    assert "more accurate than PID" in text


def test_short_is_a_fraction_of_the_whole():
    """CI's budget is below a fifteenth of the runs of the default."""
    assert SHORT.runs(8, 60) < VerdictPlan().runs(8, 60) / 15


def test_verdict_from_the_command_line(tmp_path):
    """Real runs of one law, the smallest budget there is; PID, with which it is compared, comes by itself."""
    out = tmp_path / "verdict.json"
    asked = ["--outer", "backstepping", "--candidates", "4", "--search-cells", "1",
             "--search-seed", "1", "--points", "2", "--unseen-cells", "2", "--no-ablation",
             "--ablation-cells", "2", "--workers", "1", "--out", str(out), "--json"]  # fmt: skip
    run = CliRunner().invoke(command, asked, standalone_mode=False, catch_exceptions=False)
    document = json.loads(run.stdout)
    assert json.loads(out.read_text()) == document["data"]
    assert out.with_suffix(".html").exists()
    assert document["says"]["first_line"] == words.first_line(document["data"])
    assert document["data"]["laws"] == ["pid", "backstepping"]
    assert len(document["data"]["fronts"]) == 2
    kept = CliRunner().invoke(command, ["--kept", str(out)], standalone_mode=False)
    assert kept.output.startswith(document["says"]["first_line"])
    with pytest.raises(BadInput, match="exists already"):
        CliRunner().invoke(command, asked, standalone_mode=False, catch_exceptions=False)


def test_without_optuna_a_verdict_is_refused_before_anything_is_run(tmp_path, monkeypatch, capsys):
    """One line with the extra to install, no word of a law judged, and no folder left behind."""
    monkeypatch.setitem(sys.modules, "optuna", None)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadInput, match="needs Optuna; install it: pip install 'skid-steer-hil"):
        CliRunner().invoke(command, ["--short"], standalone_mode=False, catch_exceptions=False)
    assert list(tmp_path.iterdir()) == []
    assert capsys.readouterr().err == ""


def test_kept_data_that_are_none_are_refused(tmp_path):
    """In one line."""
    file = tmp_path / "x.json"
    file.write_text("{}")
    with pytest.raises(BadInput, match="is no data of `hil verdict`"):
        CliRunner().invoke(
            command, ["--kept", str(file)], standalone_mode=False, catch_exceptions=False
        )


def test_a_verdict_made_again_says_the_same_or_the_page_says_that_it_does_not(told):
    """Same first line: said so with its budget; another one: quoted."""
    same = words.repeated_line(told["level"], told["level"])
    assert same.startswith("Made again (seeds of the search 1, 2, ")
    assert same.endswith("it says the same.")
    other = words.repeated_line(told["level"], told["wins"])
    assert other.endswith(f"it says otherwise: {words.first_line(told['wins'])}")


def test_verdicts_made_again_have_other_seeds_and_are_compared_on_the_readme():
    """No seed of the search is in two, the laws are the same, and README tells what comes of it."""
    data = json.loads(shipped_text())
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert f"**{words.first_line(data)}**" in readme
    seeds = set(data["plan"]["search_seeds"])
    for again in map(json.loads, repeated_texts().values()):
        assert not seeds & set(again["plan"]["search_seeds"])
        seeds |= set(again["plan"]["search_seeds"])
        assert data["laws"] == again["laws"]
        assert words.repeated_line(data, again) in readme


def test_readme_and_docs_say_what_the_data_say():
    """README's first line and table, and the tables of docs/verdict.md, are made of the data that ship."""
    data = json.loads(shipped_text())
    for name, made in pages(data).items():
        assert (ROOT / name).read_text(encoding="utf-8") == made, "python -m tests.verdict.pages"
    changed = copy.deepcopy(data)
    changed["fronts"][0]["hypervolume"] += 0.2
    for name, made in pages(changed).items():  # negative control
        assert (ROOT / name).read_text(encoding="utf-8") != made


def test_the_gains_that_ship_are_those_the_data_judge():
    """In every file of a verdict: after new gains `python -m tests.verdict.shipped` judges them anew."""
    for file in FILES:
        data = json.loads(file.read_text(encoding="utf-8"))
        now = json.loads(json.dumps(shipped_gains(data["laws"])))
        assert data["shipped_gains"] == now, "python -m tests.verdict.shipped"
        assert set(data["shipped"]) == set(data["laws"])


def test_judging_the_gains_that_ship_anew_gives_the_data_that_are_there():
    """Two laws in one unseen cell, run now: the same scores, to the last digit that is kept."""
    data = json.loads(shipped_text())
    one = dict.fromkeys(("search_cells", "unseen_cells", "ablation_cells"), 1)
    few = {**data, "laws": ["backstepping", "pid"], "plan": {**data["plan"], **one}}
    few["shipped_gains"] = {}
    made = judged_anew(few)
    for law in few["laws"]:
        (cell,) = made["shipped"][law]
        assert made["shipped"][law][cell] == data["shipped"][law][cell]
    with pytest.raises(SystemExit, match="another one by now"):  # negative control
        judged_anew({**few, "yardstick": {**data["yardstick"], "ahead": {}}})


def test_the_table_of_shipped_gains_by_hand():
    """A law at half of PID's accuracy score everywhere is -50 % and stands; one that varies does not."""
    cells = [f"{task} in {condition}" for task in "abcde" for condition in "xyz"]
    far = {cell: [[2.0 if i % 2 else 0.5, 1.0, 1.0]] for i, cell in enumerate(cells)}
    data = {
        "unseen_cells": cells,
        "shipped": {
            "pid": {cell: [[1.0, 0.8, 0.5]] for cell in cells},
            "half": {cell: [[0.5 + 0.001 * i, 1.0, 1.0]] for i, cell in enumerate(cells)},
            "varied": far,
        },
    }
    lines = words.shipped_table(data)
    assert lines[2].startswith("| half | 0.51 | 1.00 | 1.00 | **-49 % (")
    assert lines[3] == "| pid | 1.00 | 0.80 | 0.50 |  |"
    assert lines[4].startswith("| varied | 1.20 | 1.00 | 1.00 | ")
    assert "**" not in lines[4]
