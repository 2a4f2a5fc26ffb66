"""Tuning costs from files, and the kit that checks figures and costs: what they decide, what it finds."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import hil as api
from hil.analysis.costs import cost_of
from hil.config.load import load_scenario
from hil.study.tune import Plan, candidate_costs
from hil.tools.conformance import cost_report, figure_report
from tests.cli.command import hil
from tests.own.starts import cost_text, figure_text, template, written

COST = template("cost.py", "own-cost")
BRIEF = ("--set", "duration_s=1.0")


@pytest.mark.parametrize(
    ("body", "fails"),
    [
        ("return 3.0", "negative control"),
        ("return random.random()", "no unseeded random number"),
        ("return float(run.error_m[-1]) + 0.0 * time.time()", "no clock"),
        ("run.figures['ise_m2_s'] = 0.0; return float(run.error_m[-1])", "leaves the run as it is"),
        ("return float(run.error_m[5])", "short run"),
        ("return float(run.columns['s_x_m_s2'].max())", "finite"),
    ],
)
def test_the_kit_finds_what_is_wrong_with_a_figure(body: str, fails: str, tmp_path: Path):
    """Negative controls of the kit itself: each rule broken is named."""
    file = written(tmp_path / "checked.py", figure_text("checked_m", body))
    assert fails in figure_report(file).failures


@pytest.mark.parametrize(
    ("body", "fails"),
    [
        ("return -figures['iae_m_s']", "negative control"),
        ("return 1e3 * figures['iae_m_s']", "below the cost of a failed run"),
        ("import random; return figures['iae_m_s'] + random.random()", "no unseeded random number"),
        ("return figures['no_such_m']", "finite"),
        ("return 1.0 if figures['iae_m_s'] != figures['iae_m_s'] else 0.5", "without figures"),
    ],
)
def test_the_kit_finds_what_is_wrong_with_a_cost(body: str, fails: str, tmp_path: Path):
    """Negative controls of the kit itself: each rule broken is named."""
    file = written(tmp_path / "bad.py", cost_text("bad", body))
    assert fails in cost_report(file).failures


def test_what_new_writes_passes_the_kit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The starting points keep every rule as they are written, and are never written over."""
    monkeypatch.chdir(tmp_path)
    for kind in ("figure", "cost"):
        assert hil("new", kind, f"fresh_{kind}").status == 0
        assert "is there already" in hil("new", kind, f"fresh_{kind}").refusal
        assert hil("check", kind, f"fresh_{kind}.py").status == 0
    assert "taken" in hil("new", "figure", "ise_m2_s").refusal
    assert "taken" in hil("new", "cost", "usual").refusal


def test_a_cost_decides_what_is_found(tmp_path: Path):
    """Two candidates are ranked by it: the other way round by its negative, failed ones last by both."""
    costs = [
        cost_of(str(written(tmp_path / f"{name}.py", cost_text(name, body))))
        for name, body in (
            ("up", "return figures['iae_m_s']"),
            ("down", "return 5.0 - figures['iae_m_s']"),
        )
    ]
    gains = load_scenario("scenario-1").control.active_gains
    given = [{"iae_m_s": 1.0}, {"iae_m_s": 2.0}, {}, {"iae_m_s": math.nan}]
    ranks = []
    for cost in costs:
        plan = Plan(cases=Plan().cases[:1], seeds=(1,), cost=cost)
        found = candidate_costs("pid", [gains] * 4, lambda _trials: given, plan)
        assert found[2:] == [9.0, 9.0]
        ranks.append(found[0] < found[1])
    assert ranks == [True, False]


def test_a_search_belongs_to_its_cost(tmp_path: Path):
    """Origin and verdict tell it; a search left behind by one cost is not gone on with by another."""
    cost = written(tmp_path / "own.py", COST)
    out = tmp_path / "found.toml"
    words = ("tune", "scenario-1", "--outer", "pid", "--candidates", 11, "--held-out", 2, *BRIEF)
    done = hil(*words, "--cost", cost, "--out", out, "--json")
    assert done.status == 0, done.err
    assert done.json["gains"]["origin"]["cost"].startswith("own-cost (")
    assert not out.with_name("found.toml.search").exists()
    raising = written(
        tmp_path / "raising.py",
        COST.replace("own-cost", "raising").replace('figures["iae_m_s"]', 'figures["stray_m"]'),
    )
    other = tmp_path / "other.toml"
    refusal = hil(*words, "--cost", raising, "--out", other).err.splitlines()[-1]
    assert "tuning cost raising (raising.py, line 21): raised KeyError: 'stray_m'" in refusal
    assert not other.exists()
    again = hil(*words, "--out", other)
    assert "is what another search left (its procedure differs" in again.err.splitlines()[-1]


@pytest.mark.parametrize("failed", ["math.inf", "None", "'much'", "True"])
def test_a_cost_must_say_what_a_failed_run_costs(failed: str, tmp_path: Path):
    """A finite number: a search could not rank by another."""
    text = COST.replace("failed=50.0", f"failed={failed}").replace(
        "import hil", "import math\nimport hil"
    )
    assert (
        "needs a finite number" in hil("tune", "--cost", written(tmp_path / "c.py", text)).refusal
    )


def test_an_environment_rewards_by_a_cost_of_ones_own(tmp_path: Path):
    """The rewards of an episode add up to minus the cost of its run, all of it with the last step."""
    pytest.importorskip("gymnasium")
    cost = written(tmp_path / "own.py", COST)
    env = api.make_env("scenario-1", camera="pose", cost=str(cost), duration_s=0.5)
    env.reset()
    rewards, done = [], False
    while not done:
        _, reward, failed, cut, info = env.step(env.action_space.low * 0.0)
        rewards.append(reward)
        done = failed or cut
    env.close()
    assert rewards[:-1] == [0.0] * (len(rewards) - 1)
    assert -rewards[-1] == cost_of(str(cost)).of(info["figures"])
    assert -rewards[-1] < 50.0
