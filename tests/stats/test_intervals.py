"""Intervals hold the truth as often as they say, measured by simulated studies."""

from __future__ import annotations

import math
import tracemalloc

import numpy as np
import pytest

from hil.analysis.intervals import (
    MOST_FOR_BOOTSTRAP,
    by_group,
    coverage_of,
    mean_interval,
    mean_intervals,
    median_interval,
    student_reach,
)
from hil.analysis.stats import paired
from tests.stats.coverage import USUAL, VERY_SKEWED, coverage, crossed_coverage

STUDIES = 1200
# 1.5 points, and three standard deviations of a share of 0.95 in so many studies.
SLACK = 0.015 + 3.0 * math.sqrt(0.95 * 0.05 / STUDIES)


@pytest.mark.parametrize("size", [6, 10, 20, 50])
@pytest.mark.parametrize("name", USUAL)
def test_interval_of_a_mean_holds_it_19_times_in_20(name: str, size: int) -> None:
    """Normal, skewed and heavy-tailed differences; `python -m tests.stats.coverage` takes more sizes."""
    assert coverage(USUAL[name], size, STUDIES) == pytest.approx(0.95, abs=SLACK)


@pytest.mark.parametrize("size", [6, 10, 30])
def test_where_95_percent_cannot_be_had_the_figure_is_said(size: int) -> None:
    """Very skewed differences: what is stated is what is measured, and Student's t is far worse."""
    draw = VERY_SKEWED["lognormal, sigma 1"]
    found = coverage(draw, size, STUDIES)
    assert found == pytest.approx(coverage_of(size).skewed, abs=SLACK)
    samples = draw(np.random.default_rng((1, size)), (STUDIES, size))
    student = float(np.mean(np.abs(samples.mean(axis=1)) <= student_reach(samples)))
    assert found > student + 0.03


@pytest.mark.parametrize("size", [6, 11, 40])
def test_interval_of_a_median_holds_it_whatever_the_distribution(size: int) -> None:
    """Its stated coverage is that of the sign test, for lognormal as for normal values."""
    rng = np.random.default_rng(size)
    for values in (
        rng.lognormal(0.0, 1.5, (STUDIES, size)) - 1.0,
        rng.normal(size=(STUDIES, size)),
    ):
        found = [median_interval(row) for row in values]
        held = np.mean([span.low <= 0.0 <= span.high for span, _ in found])
        assert found[0][1] >= 0.95
        assert held == pytest.approx(found[0][1], abs=0.02)
    # Of six values all lie on one side of the median once in 32.
    assert median_interval(np.arange(6.0))[1] == pytest.approx(1 - 2 / 64)
    assert math.isnan(median_interval(np.arange(5.0))[1])


@pytest.mark.parametrize(
    ("seeds", "draws", "sds"),
    [
        (20, 1, (1, 0, 1)),
        (1, 20, (0, 1, 1)),
        (6, 6, (1, 1, 1)),
        (10, 5, (1, 0, 0)),
        (10, 20, (0, 1, 1)),
    ],
)
def test_seeds_and_draws_in_common(seeds: int, draws: int, sds: tuple[float, float, float]) -> None:
    """What a seed does at every draw, and a draw under every seed, is not averaged away by pairs.

    Negative control: taken for independent pairs the interval misses far more often.
    """
    studies = 600
    slack = 0.025 + 3.0 * math.sqrt(0.95 * 0.05 / studies)
    assert crossed_coverage(seeds, draws, sds, studies) == pytest.approx(0.95, abs=slack)


def test_points_of_one_seed_taken_for_pairs_would_miss() -> None:
    """8 seeds at 12 points: over the seeds the interval holds, over the 96 pairs it does not."""
    rng = np.random.default_rng(2)
    held = {"tapes": 0, "pairs": 0}
    tapes = [(seed, 0) for seed in range(8) for _ in range(12)]
    for _ in range(100):
        values = (np.repeat(rng.normal(size=8), 12) + 0.5 * rng.normal(size=96)).tolist()
        for name, given in (("tapes", tapes), ("pairs", None)):
            interval = paired([0.0] * 96, values, given).interval
            held[name] += interval.low <= 0.0 <= interval.high
    assert held["tapes"] / 100 > 0.88
    assert held["pairs"] / 100 < 0.6


def test_groups_of_unequal_size_keep_the_mean() -> None:
    """The mean of the groups' values is that of all values, also when pairs were left out."""
    values = np.array([1.0, 2.0, 3.0, 10.0, 20.0])
    own = by_group(values, ["a", "a", "a", "b", "b"])
    assert own.mean() == pytest.approx(values.mean())
    assert by_group(values[:4], [1, 1, 2, 2]).tolist() == [1.5, 6.5]


@pytest.mark.parametrize("size", [2, 5, 6, 9, 15, 40, MOST_FOR_BOOTSTRAP])
def test_an_interval_knows_no_order_and_no_side(size: int) -> None:
    """Values shuffled have the same interval, negated the mirrored one, shifted and scaled it moves along."""
    rng = np.random.default_rng(size)
    values = np.exp(rng.normal(0.0, 0.8, size))
    found = mean_interval(values)
    ends = pytest.approx((found.low, found.high), rel=1e-9)
    for _ in range(3):
        shuffled = mean_interval(rng.permutation(values))
        assert (shuffled.low, shuffled.high) == ends
    mirrored = mean_interval(-rng.permutation(values))
    assert (-mirrored.high, -mirrored.low) == ends
    moved = mean_interval(3.0 + 10.0 * rng.permutation(values))
    assert ((moved.low - 3.0) / 10.0, (moved.high - 3.0) / 10.0) == ends


def test_rows_of_a_table_are_samples_of_their_own() -> None:
    """Many samples at once give what each gives alone; equal values give their value."""
    samples = np.random.default_rng(1).exponential(size=(5, 12))
    samples[3] = 0.7
    ends = mean_intervals(samples)
    for row, (low, high) in zip(samples, ends, strict=True):
        alone = mean_interval(row)
        assert (alone.low, alone.high) == pytest.approx((low, high))
    assert ends[3].tolist() == pytest.approx([0.7, 0.7])
    # Skewed to the right: the upper end is the further one.
    assert ends[0, 1] - samples[0].mean() > samples[0].mean() - ends[0, 0]


def test_memory_does_not_grow_with_the_pairs() -> None:
    """10,000 pairs need less than 40 MB; the largest that are resampled as little."""
    rng = np.random.default_rng(1)
    for size in (MOST_FOR_BOOTSTRAP - 1, 10_000):
        values = rng.normal(size=size)
        tracemalloc.start()
        mean_interval(values)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 64e6, size
