"""Intervals hold what they promise, and claim nothing where there is nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hil.analysis.stats import adjusted, bca_interval, paired, t_interval


def test_interval_and_effect_are_those_of_a_hand_calculation() -> None:
    """Differences 1, 2, 3, 4, 5: mean 3, sd sqrt(2.5), t(0.975, 4) = 2.776445 (Student's table)."""
    result = paired([0.0] * 5, [1.0, 2.0, 3.0, 4.0, 5.0])
    reach = 2.776445 * math.sqrt(2.5 / 5)
    assert result.mean == 3.0
    assert result.sd == pytest.approx(math.sqrt(2.5))
    assert result.t.low == pytest.approx(3.0 - reach, abs=1e-5)
    assert result.t.high == pytest.approx(3.0 + reach, abs=1e-5)
    # Hedges' correction with 4 degrees of freedom: 1 - 3/15.
    assert result.effect == pytest.approx(3.0 / math.sqrt(2.5) * 0.8)
    assert result.lower_share == 0.0
    assert result.certain


def test_law_against_itself_is_no_difference() -> None:
    """Negative control: equal values give the interval [0, 0], which contains zero."""
    values = [1.0, 4.0, 2.0, 8.0, 5.0, 7.0, 1.5]
    result = paired(values, values)
    assert (result.t.low, result.t.high) == (0.0, 0.0)
    assert (result.bca.low, result.bca.high) == (0.0, 0.0)
    assert result.interval.contains_zero
    assert not result.certain
    assert result.effect == 0.0
    assert result.rank_p == 1.0


def test_intervals_cover_as_often_as_they_say() -> None:
    """Of 300 experiments of 20 normal differences each, about 95 % of the intervals hold the mean.

    Binomial with 0.95: sd 1.26 %; BCa is known to fall some percent short at 20 values.
    """
    rng = np.random.default_rng(7)
    held = {"t": 0, "bca": 0}
    for _ in range(300):
        values = rng.normal(0.3, 1.0, 20)
        for name, interval in (("t", t_interval(values)), ("bca", bca_interval(values))):
            held[name] += interval.low <= 0.3 <= interval.high
    assert 0.91 <= held["t"] / 300 <= 0.985
    assert 0.88 <= held["bca"] / 300 <= 0.985


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
    assert math.isnan(result.t.low)
    assert not result.certain
    assert paired([math.nan], [1.0]).pairs == 0


def test_bootstrap_is_the_same_each_time() -> None:
    """Resampling is seeded: one set of values has one interval."""
    values = np.random.default_rng(3).exponential(1.0, 25)
    assert bca_interval(values) == bca_interval(values)
    assert not math.isnan(bca_interval(values).low)
    assert math.isnan(bca_interval(values[:5]).low)  # too few to resample


def test_battery_explains_a_difference() -> None:
    """Differences made of 2 per volt alone are no difference at equal battery voltage."""
    volts = [0.1, -0.2, 0.3, 0.05, -0.1, 0.25]
    noise = [0.001, -0.001, 0.0, 0.001, -0.002, 0.001]
    found = adjusted([2.0 * v + e for v, e in zip(volts, noise, strict=True)], volts)
    assert found is not None
    assert found.slope == pytest.approx(2.0, abs=0.02)
    assert found.interval.contains_zero
    assert adjusted([1.0, 2.0, 3.0, 4.0], [0.0, 0.0, 0.0, 0.0]) is None
