"""`hil tune` from the command line: search, verdict, file; with made-up runs in real workers."""

import json
import math
import tomllib
from importlib.resources import files

import click
import pytest
from click.testing import CliRunner

import hil.study.tune_work
from hil.analysis.stats import paired
from hil.cli.tune import _cell, command
from hil.config.gains import Gains
from hil.config.load import load_scenario
from hil.core.errors import BadInput
from hil.core.figures import BY_NAME
from hil.study.campaign.results import program
from hil.study.tune import Plan, case_scenario
from hil.study.tune_work import Journal, identity_of, load_tasks
from hil.study.work_folder import sole_writer
from tests.laws.test_tune import STILL, distance


class Bowl:
    """Stands in for the twin; a worker process imports it from here."""

    def __init__(self, target, camera, tasks):
        self.name = (target, camera, *tasks)

    def __call__(self, trial):
        luck = 1e-3 * trial.seed * (trial.outer == "pid")
        return STILL | {"iae_m_s": 1.0 + distance(trial.outer, trial.gains) + luck}


@pytest.fixture(autouse=True)
def bowl(monkeypatch):
    monkeypatch.setattr("hil.study.tune.OnTarget", Bowl)


def test_gain_set_holds_what_was_found_and_how_it_was_judged(tmp_path):
    """The file reads back, better than the start, with the verdict that stdout has too."""
    out = tmp_path / "set.toml"
    asked = ["--candidates", "51", "--held-out", "6", "--workers", "2", "--out", str(out), "--json"]
    run = CliRunner().invoke(command, asked, standalone_mode=False, catch_exceptions=False)
    document = json.loads(run.stdout)
    gains = Gains.model_validate(tomllib.loads(out.read_text(encoding="utf-8")))
    assert gains.model_dump() == document["gains"]
    assert gains.origin["cost_pid"] < gains.origin["start_cost_pid"]
    assert gains.origin["held_out"].endswith("seeds 1000 to 1005")
    verdict = document["verdict"]["asg-ism - pid"]["all"]["cost"]
    assert verdict["pairs"] == 18
    assert verdict["mean"] == pytest.approx(
        gains.origin["held_out_cost_asg-ism"] - gains.origin["held_out_cost_pid"], abs=2e-4
    )


def test_a_file_that_exists_is_not_written_over(tmp_path):
    """It is refused before anything runs."""
    out = tmp_path / "set.toml"
    out.write_text("mine")
    with pytest.raises(BadInput, match="exists already"):
        CliRunner().invoke(
            command, ["--out", str(out)], standalone_mode=False, catch_exceptions=False
        )
    assert out.read_text() == "mine"


def test_a_folder_that_is_not_there_is_named_before_the_search(tmp_path):
    """A search of minutes does not end in a file that cannot be written."""
    out = tmp_path / "none" / "set.toml"
    with pytest.raises(BadInput, match="no folder"):
        CliRunner().invoke(
            command, ["--out", str(out)], standalone_mode=False, catch_exceptions=False
        )


ASKED = ["--candidates", "21", "--held-out", "2", "--workers", "1", "--json"]


def test_search_that_was_stopped_goes_on(tmp_path, monkeypatch):
    """Ctrl-C in mid-search keeps its runs; the same command makes the rest and the same file."""
    whole, again = tmp_path / "whole.toml", tmp_path / "again.toml"
    invoke([*ASKED, "--out", str(whole)])
    made = hil.study.tune_work.Journal.make
    calls = []

    def stopping(self, trials, run, done):
        calls.append(len(trials))
        if len(calls) == 3:
            raise KeyboardInterrupt
        return made(self, trials, run, done)

    monkeypatch.setattr(hil.study.tune_work.Journal, "make", stopping)
    stopped = invoke([*ASKED, "--out", str(again)], expected=click.Abort)
    assert "the same command goes on" in stopped.stderr
    assert not again.exists()
    journal = tmp_path / "again.toml.search"
    kept = journal.read_text(encoding="utf-8").splitlines()
    assert len(kept) == 1 + sum(calls[:2])
    # A torn last line and a damaged one cost their own runs only.
    kept[5] = kept[5].replace("1", "2", 1)
    journal.write_text("\n".join(kept)[:-20], encoding="utf-8")
    monkeypatch.setattr(hil.study.tune_work.Journal, "make", made)
    run = invoke([*ASKED, "--out", str(again)])
    assert "2 damaged lines; their runs are made again" in run.stderr
    assert f"{sum(calls[:2]) - 2} runs are there already" in run.stderr
    assert again.read_bytes() == whole.read_bytes()
    assert sorted(item.name for item in tmp_path.iterdir()) == ["again.toml", "whole.toml"]


def test_what_another_search_left_is_not_mixed_in(tmp_path):
    """Another seed of the search is another search; nor do two commands write one file."""
    out = tmp_path / "set.toml"
    tasks = load_tasks((), None)
    plan = Plan(cases=tasks.cases(), candidates=21)
    with Journal(tmp_path / "set.toml.search", identity_of(tasks, plan, "pose", program())):
        pass
    refused = invoke([*ASKED, "--seed", "2", "--out", str(out)], expected=BadInput)
    assert "its seed differs: 1, now 2" in str(refused.exception)
    with sole_writer(tmp_path / "set.toml.lock", "test"):
        refused = invoke([*ASKED, "--out", str(out)], expected=BadInput)
    assert "is writing there" in str(refused.exception)


def test_gains_for_a_robot_and_tasks_of_ones_own(tmp_path):
    """A deck of own scenarios with an own robot: cases, verdict and origin are theirs."""
    robot = files("hil").joinpath("data/robots/thesis-4wd.toml").read_text(encoding="utf-8")
    heavy = robot.replace('"thesis-4wd"', '"heavy"').replace("mass_kg = 2.8 ", "mass_kg = 5.6 ")
    (tmp_path / "heavy.toml").write_text(heavy, encoding="utf-8")
    (tmp_path / "own.toml").write_text(
        'base = "circle"\nname = "own"\nduration_s = 4\n', encoding="utf-8"
    )
    tasks = load_tasks(["scenario-2", str(tmp_path / "own.toml")], str(tmp_path / "heavy.toml"))
    assert {task.robot.mass_kg for task in tasks.scenarios.values()} == {5.6}
    cases = [str(case) for case in tasks.cases()]
    assert len(cases) == len(set(cases)) == 7
    assert "scenario-2 beside over pid" in cases
    assert not any(case.startswith("own beside") for case in cases)
    # Twice the weight is pushed twice as hard.
    pushed = case_scenario(tasks.cases()[1], tasks.base, tasks.scenarios["scenario-2"])
    assert [push.amplitude for push in pushed.disturbances] == [6.0, 0.3]
    (tmp_path / "deck.toml").write_text('scenarios = ["scenario-2"]', encoding="utf-8")
    out = tmp_path / "set.toml"
    words = [str(tmp_path / "deck.toml"), "--robot", str(tmp_path / "heavy.toml")]
    document = json.loads(invoke([*words, *ASKED, "--out", str(out)]).stdout)
    assert list(document["verdict"]["asg-ism - pid"]) == ["all", "scenario-2"]
    assert document["gains"]["origin"]["robot"] == "heavy"
    assert document["gains"]["origin"]["held_out"].startswith("scenario-2, seeds 1000")


def test_a_robot_is_taken_as_a_run_takes_it(tmp_path):
    """With its board, below what is set besides and below the conditions of a deck."""
    (tmp_path / "mine.toml").write_text('base = "diff-2wd"\n[board]\nPWM_MAX = 0.8\n')
    mine, more = str(tmp_path / "mine.toml"), ["robot.mass_kg=3.13", "duration_s=4"]
    (task,) = load_tasks(["scenario-1"], mine, more).scenarios.values()
    assert task == load_scenario("scenario-1", [f"robot.file={mine}", *more])
    assert task.robot.mass_kg == 3.13
    assert task.board["PWM_MAX"] == pytest.approx(0.8)
    unseen = load_tasks(["suite"], mine).unseen
    assert unseen["beside-in-coarse-encoder"].robot.encoder_counts_per_turn == 120
    assert unseen["beside-in-sagging-battery"].robot.battery.charge_start_ratio == 0.3
    assert {task.robot.name for task in unseen.values()} == {task.robot.name}
    with pytest.raises(BadInput, match="both name the robot"):
        load_tasks(["scenario-1"], mine, ["robot.file=thesis-4wd"])


def test_tasks_that_cannot_be_told_apart_are_refused(tmp_path):
    """As are a robot and a scenario that are not there."""
    for words, said in (
        (["scenario-1", "scenario-1"], "is taken"),
        (["scenario-9"], "no such file"),
        (["--robot", "none.toml"], "no such file"),
        (["--set", "robot.mass_kg=-1"], "mass_kg"),
    ):
        out = str(tmp_path / "set.toml")
        refused = invoke([*words, "--out", out], expected=BadInput)
        assert said in str(refused.exception)
    assert not list(tmp_path.iterdir())


def invoke(words, expected=None):
    run = CliRunner().invoke(command, words, standalone_mode=False)
    if expected is None and run.exception is not None:
        raise run.exception
    if expected is not None:
        assert isinstance(run.exception, expected), run.exception
    return run


def test_a_figure_that_a_law_does_not_have_is_a_dash():
    """No pair has a difference of it: a dash, and no sign before one; a difference keeps its sign."""
    metric = BY_NAME["control_energy_m2_s3"]
    assert _cell(paired([0.3, 0.4, 0.5], [math.nan] * 3), metric) == "–"
    assert _cell(paired([0.3, 0.4, 0.5], [0.5, 0.5, 0.6]), metric).startswith("+0.13")
