"""Intervals of a mean and of a median that hold as often as they say (docs/statistics.md).

The interval of the mean joins two: Student's t, right for normal and for heavy-tailed values, and
the studentised bootstrap (bootstrap-t), which follows skewness. Each end is the bootstrap's, but no
nearer to the mean than a share of Student's reach, and no further than three times that. How often
it holds the true mean was measured: `python -m tests.stats.coverage` prints it anew.
Sources: B. Efron, R. Tibshirani, An Introduction to the Bootstrap (1993), section 12.5;
P. Hall, The Bootstrap and Edgeworth Expansion (1992), section 3.10.3.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

if TYPE_CHECKING:
    from collections.abc import Hashable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Codes = NDArray[np.intp]

CONFIDENCE = 0.95
RESAMPLES = 5_000
# Below this the bootstrap has too few different resamples, from there on skewness no longer matters.
LEAST_FOR_BOOTSTRAP, MOST_FOR_BOOTSTRAP = 6, 500
_SEED = 8_10_4
# No end is nearer than this share of Student's reach: by the number of values, measured.
_LEAST_REACH = ((10, 0.85), (20, 0.95), (math.inf, 1.0))
_WIDER = ((10, 1.05), (math.inf, 1.0))  # the bootstrap of so few values falls a little short
_MOST_REACH = 3.0
_ROUNDING = 1e-12


@dataclass(frozen=True, slots=True)
class Interval:
    """An interval, 95 % unless said otherwise; NaN where there are too few values."""

    low: float
    high: float

    @property
    def contains_zero(self) -> bool:
        """Say whether no difference is among what the interval allows (also when it is unknown)."""
        return not (self.low > 0.0 or self.high < 0.0)


UNKNOWN = Interval(math.nan, math.nan)


@dataclass(frozen=True, slots=True)
class Coverage:
    """How often a 95 % interval of the mean was measured to hold it, as shares.

    `low` and `high` over normal, moderately skewed (exponential, lognormal with sigma 0.5) and
    heavy-tailed (t with 3 degrees of freedom, Laplace, contaminated normal) values; `skewed` for
    very skewed ones (lognormal with sigma 1).
    """

    low: float
    high: float
    skewed: float

    def text(self) -> str:
        """Return the figures in words."""
        return (
            f"an interval of 95 % held the mean in {100 * self.low:.0f} to {100 * self.high:.0f} % of "
            f"simulated studies, in {100 * self.skewed:.0f} % where differences were very skewed"
        )


# Up to here it is worth saying how far an interval is to be trusted.
FEW = 30
# By the least number of independent values.
_MEASURED = (
    (2, Coverage(0.87, 0.97, 0.82)),
    (6, Coverage(0.937, 0.964, 0.901)),
    (8, Coverage(0.942, 0.964, 0.904)),
    (10, Coverage(0.947, 0.971, 0.916)),
    (14, Coverage(0.948, 0.963, 0.923)),
    (20, Coverage(0.950, 0.966, 0.923)),
    (50, Coverage(0.948, 0.964, 0.940)),
)


def coverage_of(values: int) -> Coverage:
    """Return what was measured for this many independent values (at least 2)."""
    return [coverage for least, coverage in _MEASURED if values >= least][-1]


def mean_interval(values: Array) -> Interval:
    """Return the 95 % interval of the mean of independent values, the same for the same values."""
    low, high = mean_intervals(np.asarray(values, np.float64)[None, :])[0]
    return Interval(float(low), float(high))


def mean_intervals(samples: Array) -> Array:
    """Return the interval's ends (k x 2) of each of k samples of n values (k x n)."""
    size = samples.shape[1]
    if size < 2:
        return np.full((samples.shape[0], 2), np.nan)
    mean = samples.mean(axis=1)
    reach = student_reach(samples)
    ends = np.stack([mean - reach, mean + reach], axis=1)
    if LEAST_FOR_BOOTSTRAP <= size < MOST_FOR_BOOTSTRAP:
        spread = reach > 0.0
        share, wider = (next(x for n, x in table if size < n) for table in (_LEAST_REACH, _WIDER))
        least, most = share * reach[spread], _MOST_REACH * reach[spread]
        below, above = np.clip(wider * _bootstrap_reach(samples[spread]), least, most)
        ends[spread] = np.stack([mean[spread] - below, mean[spread] + above], axis=1)
    return ends


def student_reach(samples: Array) -> Array:
    """Return half of Student's 95 % interval of each sample's mean; 0 for values all alike."""
    size = samples.shape[1]
    spread = samples.std(axis=1, ddof=1)
    spread[spread <= _ROUNDING * np.abs(samples).max(axis=1)] = 0.0
    quantile = float(scipy.stats.t.ppf(0.5 + 0.5 * CONFIDENCE, size - 1))
    return np.asarray(quantile * spread / math.sqrt(size), np.float64)


def _bootstrap_reach(samples: Array) -> Array:
    """Return the reach below and above each mean (2 x k) by the studentised bootstrap.

    In whatever order the values are given: resamples are drawn of them sorted, the longer tail above.
    """
    size = samples.shape[1]
    counts = _resamples(size)
    away = np.sort(samples - samples.mean(axis=1, keepdims=True), axis=1)
    turned = (away**3).sum(axis=1) < 0.0
    away[turned] = -away[turned, ::-1]
    error = away.std(axis=1, ddof=1) / math.sqrt(size)
    found = np.empty((2, samples.shape[0]))
    low = int(0.5 * (1.0 - CONFIDENCE) * (RESAMPLES + 1)) - 1
    high = RESAMPLES - 1 - low
    for first in range(0, samples.shape[0], _BATCH):
        rows = slice(first, first + _BATCH)
        means = (away[rows] @ counts) / size
        variance = (away[rows] ** 2 @ counts) / size - means**2
        # A resample of one value alone has no spread: as far as can be, on the side of its mean.
        errors = np.sqrt(np.maximum(variance, 0.0) / (size - 1))
        ratios = means / np.maximum(errors, 1e-6 * error[rows, None])
        ratios.partition((low, high), axis=1)
        found[0, rows] = ratios[:, high] * error[rows]
        found[1, rows] = -ratios[:, low] * error[rows]
    found[:, turned] = found[::-1, turned]
    return found


_BATCH = 200


@functools.lru_cache(maxsize=2)
def _resamples(size: int) -> Array:
    """Return how often each value is in each resample (size x RESAMPLES), the same each time."""
    rng = np.random.default_rng(_SEED)
    counts = rng.multinomial(size, np.full(size, 1.0 / size), size=RESAMPLES)
    return np.ascontiguousarray(counts.T, np.float64)


def share_interval(baseline: Array, other: Array) -> Interval:
    """Return the 95 % interval of the difference of two paired shares; values are 0 or 1.

    Wald's with half a pair added to each of the four cells, which holds for few pairs and for none
    that differ. Source: A. Agresti, Y. Min, Statistics in Medicine 24 (2005) 729, section 3.
    """
    size = baseline.size + 2.0
    gained, lost = float((other > baseline).sum()) + 0.5, float((other < baseline).sum()) + 0.5
    middle = (gained - lost) / size
    error = math.sqrt(((gained + lost) / size - middle**2) / size)
    reach = float(scipy.stats.norm.ppf(0.5 + 0.5 * CONFIDENCE)) * error
    return Interval(max(middle - reach, -1.0), min(middle + reach, 1.0))


def median_interval(values: Array) -> tuple[Interval, float]:
    """Return an interval of the median and how often it holds it, whatever the values' distribution.

    Its ends are values (the sign test's interval): the narrowest that holds at least 95 %. Unknown
    below 6 values, where none does.
    """
    size = values.size
    rank = int(scipy.stats.binom.ppf(0.5 * (1.0 - CONFIDENCE), size, 0.5)) if size else 0
    if rank < 1 or size < 6:
        return UNKNOWN, math.nan
    ordered = np.sort(values)
    holds = 1.0 - 2.0 * float(scipy.stats.binom.cdf(rank - 1, size, 0.5))
    return Interval(float(ordered[rank - 1]), float(ordered[size - rank])), holds


def codes_of(names: Sequence[Hashable] | Codes) -> Codes:
    """Return each name's number, in order of their first."""
    if not isinstance(names, np.ndarray):
        index = {name: number for number, name in enumerate(dict.fromkeys(names))}
        return np.array([index[name] for name in names], np.intp)
    _, first, place = np.unique(names, return_index=True, return_inverse=True)
    number = np.empty(first.size, np.intp)
    number[np.argsort(first, kind="stable")] = np.arange(first.size)
    return number[place]


def by_group(values: Array, groups: Sequence[Hashable] | Codes) -> Array:
    """Return one value a group, whose mean is that of all values: what varies from group to group.

    Groups of equal size: their means. Else the ratio estimator's linearisation, mean + G (sum of the
    group's deviations from the mean) / n. Source: W. Cochran, Sampling Techniques (1977), section 6.
    """
    mean = float(values.mean())
    sums = np.bincount(codes_of(groups), weights=values - mean)
    return np.asarray(mean + sums * sums.size / values.size, np.float64)


def crossed_interval(
    values: Array, rows: Sequence[Hashable] | Codes, columns: Sequence[Hashable] | Codes
) -> Interval:
    """Return the 95 % interval of the mean of values with a row and a column in common.

    Rows and columns are drawn alike (seeds and draws of a campaign): variances of the mean by row and
    by column are added, that within a cell, which is in both, is taken off once; degrees of freedom
    by Satterthwaite. Source: A. Cameron, J. Gelbach, D. Miller, J. Bus. Econ. Stat. 29 (2011) 238.
    """
    mean = float(values.mean())
    rows, columns = codes_of(rows), codes_of(columns)
    parts = [by_group(values, names) for names in (rows, columns)]
    if min(part.size for part in parts) < 2:
        return mean_interval(max(parts, key=len))
    by_row, by_column = (float(part.var(ddof=1)) / part.size for part in parts)
    within = _within_cells(values, rows, columns)
    variance = max(by_row + by_column - within, by_row, by_column)
    if variance == 0.0:
        return Interval(mean, mean)
    freedom = (by_row + by_column) ** 2 / (
        by_row**2 / (parts[0].size - 1) + by_column**2 / (parts[1].size - 1)
    )
    reach = float(scipy.stats.t.ppf(0.5 + 0.5 * CONFIDENCE, freedom)) * math.sqrt(variance)
    return Interval(mean - reach, mean + reach)


def _within_cells(values: Array, rows: Codes, columns: Codes) -> float:
    """Return what of the mean's variance is neither its row's nor its column's."""
    cell = codes_of(rows * (int(columns.max()) + 1) + columns)
    cells = by_group(values, cell)
    rest = cells - cells.mean()
    _, first = np.unique(cell, return_index=True)
    for names in (rows, columns):
        place = codes_of(names[first])
        sums = np.bincount(place, weights=rest)
        rest = rest - (sums / np.bincount(place))[place]
    freedom = cells.size - int(rows.max()) - int(columns.max()) - 1
    return float(rest @ rest) / max(freedom, 1) / cells.size
