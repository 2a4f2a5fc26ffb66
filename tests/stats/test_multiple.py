"""False discoveries, equivalence, improvement, tails, power, and stopping at a width."""

import json
import tracemalloc

import numpy as np
import pytest
from click.testing import CliRunner

from hil.analysis import multiple
from hil.analysis.intervals import mean_interval, mean_intervals
from hil.analysis.stats import paired
from hil.cli.power import command as power_command
from hil.core.errors import BadInput
from hil.study.campaign.plan import Campaign, CampaignFile
from tests.cli.command import hil


def test_pairs_by_the_thousand_need_little_memory():
    """Statistics of 20,000 pairs, seeds given, stay below 40 MB; below 500 pairs too."""
    rng = np.random.default_rng(3)
    paired([0.0, 1.0, 3.0], [1.0, 1.0, 2.0])  # what is imported at the first call is not counted
    for pairs in (499, 20_000):
        one = rng.normal(size=pairs)
        two = one + rng.normal(0.1, 1.0, pairs)
        tracemalloc.start()
        found = paired(one, two, [(seed, 0) for seed in range(pairs)])
        peak_bytes = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak_bytes < 60e6
        assert found.interval.low < float((two - one).mean()) < found.interval.high


def test_false_discoveries_are_held_down_by_the_table():
    """Benjamini and Hochberg by hand: of 0.01, 0.02, 0.03, 0.5 with m = 4 three stand at 5 %."""
    p = [0.01, 0.5, 0.03, 0.02]
    assert multiple.adjusted_p(p) == pytest.approx([0.04, 0.5, 0.04, 0.04])
    assert multiple.discoveries(p) == [True, False, True, True]
    assert multiple.discoveries([0.04, 0.5, 0.6, 0.7]) == [False] * 4  # alone it would stand
    assert multiple.discoveries([float("nan"), 0.001]) == [False, True]


def test_few_of_what_is_found_among_noise_is_false():
    """Of 20 figures without any difference, a table says something in one study of twenty at most."""
    rng = np.random.default_rng(4)
    loud = sum(any(multiple.discoveries(rng.random(20))) for _ in range(400))
    plain = sum(bool((rng.random(20) < 0.05).any()) for _ in range(400))
    assert loud / 400 < 0.08
    assert plain / 400 > 0.5


def test_equivalence_is_shown_and_not_assumed():
    """Near and many is equivalent, near and few is not shown, far is not; worse by the margin is told."""
    rng = np.random.default_rng(5)
    near = rng.normal(0.0, 1.0, 400)
    assert multiple.equivalence(near, 0.3).equivalent
    assert not multiple.equivalence(near[:8], 0.3).equivalent
    assert not multiple.equivalence(near + 0.3, 0.3).equivalent
    assert multiple.equivalence(near - 5.0, 0.3).no_worse
    assert not multiple.equivalence(near - 5.0, 0.3).equivalent
    with pytest.raises(BadInput, match="margin = 0: must be above 0"):
        multiple.equivalence(near, 0.0)


def test_equivalence_errs_no_more_often_than_it_says():
    """At a true difference of just the margin it says "equivalent" in at most 5 % of studies."""
    rng = np.random.default_rng(6)
    said = sum(multiple.equivalence(rng.normal(0.5, 1.0, 40), 0.5).equivalent for _ in range(600))
    assert said / 600 < 0.075


def test_probability_of_improvement_counts_all_pairs_of_runs():
    """By hand: 1, 3 against 2, 3: two of four lower pairs are (1 of 3 vs 2; ties half)."""
    assert multiple.probability_of_improvement([2.0, 3.0], [1.0, 3.0]) == pytest.approx(0.625)
    assert multiple.probability_of_improvement([2.0], [1.0]) == 1.0
    assert np.isnan(multiple.probability_of_improvement([], [1.0]))


def test_the_worst_twentieth():
    """Of 1 to 100 the mean of 96 to 100; of 30 values one and a half count."""
    assert multiple.cvar(range(1, 101)) == pytest.approx(98.0)
    assert multiple.cvar(range(1, 31)) == pytest.approx((30 + 0.5 * 29) / 1.5)
    assert multiple.cvar([3.0]) == 3.0


def test_power_is_what_simulated_studies_show():
    """34 pairs show half a standard deviation in 80 % of studies (Cohen's table), and a simulation agrees."""
    assert multiple.pairs_needed(0.5, 1.0) == 34
    assert multiple.pairs_needed(-0.02, 0.04) == 34
    rng = np.random.default_rng(7)
    draws = rng.normal(0.5, 1.0, (4000, 34))
    t = draws.mean(1) / draws.std(1, ddof=1) * np.sqrt(34)
    assert float((np.abs(t) > 2.0345).mean()) == pytest.approx(multiple.power(0.5, 34), abs=0.02)
    assert multiple.difference_seen(2.0, 34) == pytest.approx(1.0, rel=0.01)
    with pytest.raises(BadInput, match="needs a difference other than 0"):
        multiple.pairs_needed(0.0, 1.0)


def test_power_command_says_how_many_pairs():
    """`hil power --json` gives the number and what another number would show."""
    asked = ["--difference", "0.02", "--sd", "0.04", "--pairs", "10", "--json"]
    run = CliRunner().invoke(power_command, asked, standalone_mode=False, catch_exceptions=False)
    document = json.loads(run.stdout)
    assert document["pairs"] == 34
    assert document["asked"]["power"] < 0.4
    assert document["asked"]["difference_seen"] > 0.02


def test_looks_are_few_and_end_at_the_most():
    """Each has half as many again as the one before; the last is the most that is allowed."""
    assert multiple.looks(100) == [24, 36, 54, 81, 100]
    assert multiple.looks(8) == [8]


def coverage(draw, mean, half_width, studies=600, most=121):
    """Return how often intervals at which the rule stops hold the mean, and the mean of the pairs."""
    values = draw(np.random.default_rng(11), (studies, most))
    going, held, pairs = np.ones(studies, bool), 0, 0
    for count in multiple.looks(most):
        ends = mean_intervals(values[going][:, :count])
        middle = values[going][:, :count].mean(axis=1)
        half = np.maximum(ends[:, 1] - middle, middle - ends[:, 0])
        stops = (half <= multiple.STOP_SHARE * half_width) | (count == most)
        held += int(((ends[:, 0] <= mean) & (ends[:, 1] >= mean))[stops].sum())
        pairs += count * int(stops.sum())
        going[np.flatnonzero(going)[stops]] = False
    return held / studies, pairs / studies


def test_the_rule_is_the_one_that_is_simulated():
    """It stops at half widths up to the share of what was asked, not beyond."""
    values = np.random.default_rng(13).normal(size=36)
    ends = mean_interval(values)
    half = max(ends.high - values.mean(), values.mean() - ends.low)
    assert multiple.narrow_enough(values, 1.001 * half / multiple.STOP_SHARE)
    assert not multiple.narrow_enough(values, 0.999 * half / multiple.STOP_SHARE)


@pytest.mark.parametrize(
    ("draw", "mean", "least"),
    [
        (lambda rng, shape: rng.normal(size=shape), 0.0, 0.925),
        (lambda rng, shape: rng.exponential(size=shape), 1.0, 0.905),
    ],
)
def test_stopping_at_a_width_keeps_coverage(draw, mean, least):
    """95 % intervals at which the rule stops hold the mean about as often as of a fixed number of pairs."""
    held, pairs = coverage(draw, mean, 0.45)
    assert held >= least  # 600 studies: standard error 0.9 %
    assert 20 < pairs < 70


def test_stopping_where_zero_is_excluded_would_not():
    """Negative control: stopping as soon as the interval is free of zero errs twice as often as it says."""
    values = np.random.default_rng(12).normal(size=(300, 81))
    wrong = np.zeros(300, bool)
    for count in multiple.looks(81):
        ends = mean_intervals(values[:, :count])
        wrong |= (ends[:, 0] > 0.0) | (ends[:, 1] < 0.0)
    assert wrong.mean() > 0.10


def drawn_by(sampling):
    tree = {
        "name": "x", "scenario": "scenario-1", "draws": 32, "sampling": sampling,
        "random": {
            "robot.mass_kg": {"kind": "uniform", "low": 2.0, "high": 3.0},
            "link.latency_s": {"kind": "loguniform", "low": 0.01, "high": 0.1},
            "camera.latency_s": {"kind": "normal", "mean": 0.06, "sd": 0.02, "low": 0.02, "high": 0.1},
        },
    }  # fmt: skip
    campaign = Campaign(CampaignFile.model_validate(tree), {})
    return [campaign.drawn(draw) for draw in range(32)]


@pytest.mark.parametrize("sampling", ["sobol", "latin"])
def test_campaigns_draw_evenly_where_they_are_asked_to(sampling):
    """Of 32 draws of a uniform value one lies in each 32nd; the others keep their medians."""
    draws = drawn_by(sampling)
    assert draws == drawn_by(sampling)
    places = {int((point["robot.mass_kg"] - 2.0) * 32) for point in draws}
    assert places == set(range(32))
    below = sum(point["link.latency_s"] < 0.01 * 10**0.5 for point in draws)
    assert below == 16
    assert sum(point["camera.latency_s"] < 0.06 for point in draws) == 16
    plain = {int((point["robot.mass_kg"] - 2.0) * 32) for point in drawn_by("random")}
    assert len(plain) < 28


@pytest.mark.parametrize(
    ("difference", "sd", "pairs"), [("-0.1", "1e-300", 2), ("1e300", "1e-3", 2), ("1", "inf", None)]
)
def test_power_of_differences_beyond_all_measure(difference, sd, pairs):
    """A difference of more deviations than SciPy can follow needs two pairs; an sd must be finite."""
    done = hil("power", "--difference", difference, "--sd", sd, "--json")
    if pairs is None:
        assert "sd = inf" in done.refusal
    else:
        assert (done.json["pairs"], done.json["power_at_pairs"]) == (pairs, 1.0)
