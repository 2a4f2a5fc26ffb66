"""The gain procedure: same budget, same runs, known optimum, file round trip."""

import math
import tomllib
from collections import Counter

import pytest

from hil.analysis.costs import COST_FAILED, COST_WEIGHTS, USUAL
from hil.config.control import ControlConfig
from hil.config.gains import Gains
from hil.config.load import load_scenario
from hil.study.tune import (
    CASES,
    PUSHES,
    SEARCH,
    Case,
    Plan,
    case_scenario,
    decode,
    near_bounds,
    tune,
    with_values,
    write_gain_set,
)
from hil.study.tuning_verdict import (
    ALL_SCENARIOS,
    HELD_OUT_SCENARIOS,
    held_out_trials,
    judge,
    with_verdict,
)

BASE = ControlConfig().active_gains
A, B = Case("a", "calm", "pid"), Case("b", "calm", "pid")
PLAN = Plan(cases=(A, B), seeds=(1, 2), candidates=121, population=10)
# Where the made-up cost below has its least value.
BEST = {"k1_s": 0.5, "sigma_m_s2": 0.1, "kp_s3": 40.0, "kd2_s": 20.0}


def distance(outer, gains):
    values = gains.model_dump()[outer.replace("-", "_")]
    return sum(math.log(values[n] / best) ** 2 for n, best in BEST.items() if n in values)


STILL = dict.fromkeys(COST_WEIGHTS, 0.0)


def bowl(trials):
    """Figures of runs whose error grows with the distance of the gains from BEST."""
    return [
        STILL | {"iae_m_s": 1.0 + distance(t.outer, t.gains) + (t.case == B) + 0.1 * t.seed}
        for t in trials
    ]


@pytest.fixture(scope="module")
def tuned():
    runs = Counter()

    def counting(trials):
        runs.update((t.outer, t.case, t.seed) for t in trials)
        return bowl(trials)

    return tune(BASE, counting, PLAN, target="bowl", revision="none"), runs


def test_both_laws_get_the_same_candidates_on_the_same_runs(tuned):
    """121 candidates each, every one on both cases with both seeds."""
    gains, runs = tuned
    assert set(runs.values()) == {121}
    assert len(runs) == 2 * 2 * 2
    assert gains.origin["candidates_pid"] == gains.origin["candidates_asg-ism"] == 121


def test_it_finds_the_least_of_a_bowl(tuned):
    """Two gains of each law come within 15 % of where the cost is least."""
    gains, _ = tuned
    assert gains.pid.kp_s3 == pytest.approx(40.0, rel=0.15)
    assert gains.pid.kd2_s == pytest.approx(20.0, rel=0.15)
    assert gains.asg_ism.k1_s == pytest.approx(0.5, rel=0.15)
    assert gains.asg_ism.sigma_m_s2 == pytest.approx(0.1, rel=0.15)
    # The mean over cases adds 0.5 and over seeds 0.15 to the bowl's least of 1.
    assert gains.origin["cost_pid"] == pytest.approx(1.65, abs=0.05)


def test_the_search_is_repeatable():
    """The same plan gives the same gains, bit for bit."""
    plan = Plan(cases=(A,), seeds=(1,), candidates=41)
    runs = [tune(BASE, bowl, plan, target="bowl", revision="none") for _ in range(2)]
    assert runs[0] == runs[1]


def test_a_run_without_figures_costs_most():
    """A missing, NaN or huge figure is the failure cost, no more and no less."""
    calm = {
        "iae_m_s": 1.5,
        "settling_20mm_s": 4.0,
        "delta1_worst_last_second_m": 0.001,
        "eta1_variation_m_s": 0.6,
        "theta_dot_variation_rad_s": 7.0,
    }
    assert USUAL.of(calm) == pytest.approx(1.5 + 0.4 + 0.05 + 0.12 + 0.14)
    assert USUAL.of({}) == COST_FAILED
    assert USUAL.of({**calm, "settling_20mm_s": math.nan}) == COST_FAILED
    assert USUAL.of({**calm, "iae_m_s": 1e6}) == COST_FAILED


def test_written_gains_are_the_ones_evaluated(tuned, tmp_path):
    """The file reads back as the same set: values are rounded before they are tried."""
    gains, _ = tuned
    write_gain_set(tmp_path / "set.toml", gains)
    read = tomllib.loads((tmp_path / "set.toml").read_text(encoding="utf-8"))
    assert Gains.model_validate(read) == gains


def test_a_gain_set_names_the_schema_only_where_it_lies(tuned, tmp_path):
    """Beside the schemas it names them, elsewhere it has no note that leads nowhere."""
    gains, _ = tuned
    (tmp_path / "schemas").mkdir()
    (tmp_path / "gains").mkdir()
    (tmp_path / "schemas" / "gains.json").write_text("{}")
    write_gain_set(tmp_path / "gains" / "set.toml", gains)
    write_gain_set(tmp_path / "set.toml", gains)
    assert (
        (tmp_path / "gains" / "set.toml").read_text().startswith("#:schema ../schemas/gains.json")
    )
    assert "#:schema" not in (tmp_path / "set.toml").read_text()


def test_a_gain_at_the_edge_of_its_box_is_named():
    """Where the box decided and not the cost; in the middle of every box nothing is said."""
    middle = BASE
    for outer, box in SEARCH.items():
        middle = with_values(middle, outer, decode(box, [0.5] * len(box)))
    assert near_bounds(middle) == []
    (line,) = near_bounds(with_values(middle, "pid", {"kp_s3": SEARCH["pid"]["kp_s3"][2]}))
    assert line.startswith("pid kp_s3 = 200")


@pytest.mark.parametrize("outer", SEARCH)
def test_search_bounds_are_valid_gains(outer):
    """Both corners of the search box pass the bounds of the configuration."""
    size = len(SEARCH[outer])
    for corner in (0.0, 1.0):
        values = decode(SEARCH[outer], [corner] * size)
        gains = with_values(BASE, outer, values).model_dump()[outer.replace("-", "_")]
        assert {name: gains[name] for name in values} == values


def test_cases_are_scenarios_calm_pushed_late_and_beside():
    """Each case loads and takes the gains; a variant changes what its name says and nothing else."""
    gains = with_values(BASE, "pid", {"kp_s3": 12.5})
    for case in CASES:
        scenario, plain = case_scenario(case, gains), load_scenario(case.scenario)
        assert scenario.control.active_gains.pid.kp_s3 == 12.5
        assert scenario.disturbances == (PUSHES if case.variant == "pushed" else ())
        assert (scenario.link.latency_s > plain.link.latency_s) == (case.variant == "late")
        assert (scenario.camera.drop_ratio > plain.camera.drop_ratio) == (case.variant == "late")
        assert (scenario.start != plain.start) == (case.variant == "beside")
    variants = Counter(case.variant for case in CASES)
    assert variants == {"calm": 2, "pushed": 2, "late": 2, "beside": 2}
    assert Counter(case.inner for case in CASES) == {"asg-ism": 4, "pid": 4}


@pytest.mark.parametrize(("name", "side"), [("scenario-1", -1.0), ("scenario-2", 1.0)])
def test_beside_the_point_lies_on_the_side_to_turn_to(name, side):
    """The way to the point is at right angles to the heading: to the right in scenario 1."""
    scenario = case_scenario(Case(name, "beside", "pid"), BASE)
    start, goal = scenario.start, scenario.reference
    dx, dy = goal.x_m - start.x_m, goal.y_m - start.y_m
    ahead = math.cos(start.theta_rad) * dx + math.sin(start.theta_rad) * dy
    left = math.cos(start.theta_rad) * dy - math.sin(start.theta_rad) * dx
    assert ahead == pytest.approx(0.0, abs=1e-12)
    assert math.copysign(1.0, left) == side


def test_verdict_pairs_both_laws_by_seed(tuned):
    """ASG-ISM costs 0.3 less than PID with every seed of scenario 1 and 0.1 more in scenario 3."""
    gains, _ = tuned
    trials = held_out_trials(gains, 8)
    assert {t.seed for t in trials}.isdisjoint(Plan().seeds)
    assert Counter(t.outer for t in trials) == {"pid": 24, "asg-ism": 24}
    gap = {"scenario-1": -0.3, "scenario-2": 0.0, "scenario-3": 0.1}
    figures = [
        STILL | {"iae_m_s": 0.01 * t.seed + gap[t.case.scenario] * (t.outer == "asg-ism")}
        for t in trials
    ]
    verdict = judge(trials, figures)
    for scenario in HELD_OUT_SCENARIOS:
        result = verdict.differences[scenario]["cost"]
        assert result.pairs == 8
        assert result.mean == pytest.approx(gap[scenario], abs=1e-9)
        assert result.certain == (scenario != "scenario-2")
    assert verdict.differences[ALL_SCENARIOS]["cost"].mean == pytest.approx(-0.2 / 3)
    assert "-0.0667" in with_verdict(gains, verdict).origin["held_out_cost_difference"]


def test_a_failed_run_counts_in_the_verdict(tuned):
    """A run without figures costs most in its pair and is counted, not dropped."""
    trials = held_out_trials(tuned[0], 2)
    broken = next(i for i, t in enumerate(trials) if t.outer == "asg-ism")
    figures = [{} if i == broken else STILL for i in range(len(trials))]
    verdict = judge(trials, figures)
    assert verdict.failed == {"pid": 0, "asg-ism": 1}
    assert verdict.differences[ALL_SCENARIOS]["cost"].mean == pytest.approx(COST_FAILED / 6)
