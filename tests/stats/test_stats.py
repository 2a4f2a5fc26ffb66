"""Intervals hold what they promise, and claim nothing where there is nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hil.analysis.stats import adjusted, level, paired


def test_interval_and_effect_are_those_of_a_hand_calculation() -> None:
    """Differences 1, 2, 3, 4, 5: mean 3, sd sqrt(2.5), t(0.975, 4) = 2.776445 (Student's table).

    Five are too few to resample: the interval is Student's.
    """
    result = paired([0.0] * 5, [1.0, 2.0, 3.0, 4.0, 5.0])
    reach = 2.776445 * math.sqrt(2.5 / 5)
    assert result.mean == 3.0
    assert result.sd == pytest.approx(math.sqrt(2.5))
    assert result.interval.low == pytest.approx(3.0 - reach, abs=1e-5)
    assert result.interval.high == pytest.approx(3.0 + reach, abs=1e-5)
    # Hedges' correction with 4 degrees of freedom: 1 - 3/15.
    assert result.effect == pytest.approx(3.0 / math.sqrt(2.5) * 0.8)
    assert result.lower_share == 0.0
    assert result.certain


def test_law_against_itself_is_no_difference() -> None:
    """Negative control: equal values give the interval [0, 0], which contains zero."""
    values = [1.0, 4.0, 2.0, 8.0, 5.0, 7.0, 1.5]
    result = paired(values, values)
    assert (result.interval.low, result.interval.high) == (0.0, 0.0)
    assert result.interval.contains_zero
    assert not result.certain
    assert result.effect == 0.0
    assert result.rank_p == 1.0


@pytest.mark.filterwarnings("error")
def test_differences_equal_but_for_rounding_are_equal() -> None:
    """0.1 + 0.2 is not 0.3 by one unit in the last place: no warning, no effect, no difference."""
    one = [0.3, 0.3, 0.7, 1.1, 2.3, 0.3, 0.9]
    other = [0.1 + 0.2, 0.3, 0.7, 1.1, 2.3, 0.1 + 0.2, 0.9]
    assert one != other
    result = paired(one, other)
    assert (result.interval.low, result.mean, result.interval.high) == (0.0, 0.0, 0.0)
    assert result.effect == 0.0
    shifted = paired(one, [value + 0.1 for value in one])
    assert shifted.interval.low == shifted.interval.high == pytest.approx(0.1)
    assert math.isinf(shifted.effect)


def test_two_pairs_have_no_effect_size() -> None:
    """With one degree of freedom Hedges' correction is 0: no size, and not one of 0; three have one."""
    assert math.isnan(paired([1.0, 2.0], [1.5, 3.0]).effect)
    assert paired([1.0, 2.0], [1.5, 3.0]).mean == 0.75
    # Differences 0.5, 1, 0.75: mean 0.75, sd 0.25, correction 1 - 3/7.
    assert paired([1.0, 2.0, 3.0], [1.5, 3.0, 3.75]).effect == pytest.approx(3.0 * 4.0 / 7.0)


def test_copies_of_a_seed_are_no_further_evidence() -> None:
    """Six seeds at twenty points that hardly differ are six tapes: the interval of the six."""
    rng = np.random.default_rng(4)
    six = rng.normal(0.3, 1.0, 6)
    difference = np.repeat(six, 20) + 1e-6 * rng.normal(size=120)
    tapes = [(seed, 0) for seed in range(6) for _ in range(20)]
    found, alone = paired([0.0] * 120, difference.tolist(), tapes), paired([0.0] * 6, six.tolist())
    assert (found.pairs, found.tapes) == (120, 6)
    assert found.interval.low == pytest.approx(alone.interval.low, abs=1e-4)
    assert found.interval.high == pytest.approx(alone.interval.high, abs=1e-4)
    as_pairs = paired([0.0] * 120, difference.tolist())
    assert found.interval.high - found.interval.low > 3 * (
        as_pairs.interval.high - as_pairs.interval.low
    )


def test_one_seed_has_no_interval() -> None:
    """Many points with one seed say nothing of other seeds."""
    result = paired([0.0] * 9, [1.0, 2.0, 3.0] * 3, [(1, 0)] * 9)
    assert (result.pairs, result.tapes, result.mean) == (9, 1, 2.0)
    assert math.isnan(result.interval.low)
    assert not result.certain
    assert math.isnan(level([1.0, 2.0], [(1, 0)] * 2)[1].low)


def test_none_of_a_few_that_fails_is_no_proof() -> None:
    """Of 10 pairs none differs: the share's difference is 0, within what 10 can show.

    Agresti and Min: 12 pairs, half a pair each way: 1.96 sqrt((1/12)/12) = 0.1633.
    """
    result = paired([1.0] * 10, [1.0] * 10, shares=True)
    assert result.interval.high == pytest.approx(0.1633, abs=1e-4)
    assert result.interval.low == -result.interval.high
    assert paired([0.0] * 10, [1.0] * 10, shares=True).certain


def test_pairing_finds_what_scatter_between_seeds_hides() -> None:
    """A shift of 0.2 under a common scatter of 5 is certain when paired, and lost when not."""
    rng = np.random.default_rng(1)
    common = rng.normal(0.0, 5.0, 30)
    one, two = common + rng.normal(0, 0.1, 30), common + 0.2 + rng.normal(0, 0.1, 30)
    assert paired(one.tolist(), two.tolist()).certain
    assert not paired(one.tolist(), rng.permutation(two).tolist()).certain


def test_pairs_without_a_value_are_left_out_and_counted() -> None:
    """A settling time that does not exist cannot be averaged: its pair goes, and is counted."""
    result = paired([1.0, math.nan, 3.0], [2.0, 2.0, math.nan])
    assert (result.pairs, result.left_out) == (1, 2)
    assert math.isnan(result.interval.low)
    assert not result.certain
    assert paired([math.nan], [1.0]).pairs == 0


def test_interval_is_the_same_each_time_and_says_how_sure_it_is() -> None:
    """Resampling is seeded; JSON has the interval, the median's, and what was measured of them."""
    values = np.random.default_rng(3).exponential(1.0, 25).tolist()
    one, two = paired([0.0] * 25, values), paired([0.0] * 25, values)
    assert one == two
    assert one.coverage is not None
    assert one.coverage.skewed < one.coverage.low < 0.96
    tree = one.to_json()
    assert tree["interval_95"] == [one.interval.low, one.interval.high]
    assert tree["median_coverage"] >= 0.95
    assert tree["coverage"]["low"] == one.coverage.low


def test_battery_explains_a_difference() -> None:
    """Differences made of 2 per volt alone are no difference at equal battery voltage."""
    volts = [0.1, -0.2, 0.3, 0.05, -0.1, 0.25]
    noise = [0.001, -0.001, 0.0, 0.001, -0.002, 0.001]
    found = adjusted([2.0 * v + e for v, e in zip(volts, noise, strict=True)], volts)
    assert found is not None
    assert found.slope == pytest.approx(2.0, abs=0.02)
    assert found.interval.contains_zero
    assert adjusted([1.0, 2.0, 3.0, 4.0], [0.0, 0.0, 0.0, 0.0]) is None
