"""Paired differences with their intervals: how much better, and how sure (docs/statistics.md).

Two arms of an experiment that share seeds are compared seed by seed, so that what both met alike
(noise, delays, losses) cancels. All differences are other - baseline. The intervals are scipy's:
Student's t, and the bias-corrected and accelerated bootstrap (BCa), which does not take the
differences to be normal. Nothing here draws an unseeded number.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import stats

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

CONFIDENCE = 0.95
_RESAMPLES = 5_000
# Below this the bootstrap has too few different resamples to say anything about the tails.
_LEAST_FOR_BOOTSTRAP = 6
_SEED = 8_10_4


@dataclass(frozen=True, slots=True)
class Interval:
    """A 95 % interval; NaN where there are too few values."""

    low: float
    high: float

    @property
    def contains_zero(self) -> bool:
        """Say whether no difference is among what the interval allows (also when it is unknown)."""
        return not (self.low > 0.0 or self.high < 0.0)


UNKNOWN = Interval(math.nan, math.nan)


@dataclass(frozen=True, slots=True)
class Paired:
    """Differences other - baseline over `pairs` pairs; `left_out` pairs lacked a finite value.

    `effect` is Hedges' g_z: the mean difference over the standard deviation of the differences,
    corrected for small samples; infinite when every pair differs alike. `lower_share` is the share
    of pairs in which the other is lower, ties counted half. `rank_p` is Wilcoxon's signed-rank p.
    """

    pairs: int
    left_out: int
    baseline_mean: float
    other_mean: float
    mean: float
    median: float
    sd: float
    t: Interval
    bca: Interval
    effect: float
    lower_share: float
    rank_p: float

    @property
    def interval(self) -> Interval:
        """Return the interval to quote: BCa, or t where there are too few pairs for it."""
        return self.t if math.isnan(self.bca.low) else self.bca

    @property
    def certain(self) -> bool:
        """Say whether the interval is known and does not contain zero."""
        return not self.interval.contains_zero

    def to_json(self) -> dict[str, Any]:
        """Return the comparison for a JSON document, what is not finite as null."""
        tree = asdict(self)
        for name in ("t", "bca"):
            tree[f"{name}_95"] = [_finite(value) for value in tree.pop(name).values()]
        plain = {k: _finite(v) if isinstance(v, float) else v for k, v in tree.items()}
        return plain | {"contains_zero": self.interval.contains_zero}


def paired(baseline: Sequence[float], other: Sequence[float]) -> Paired:
    """Compare two arms pair by pair (same length, same order); needs 2 pairs for an interval."""
    one, two = np.asarray(baseline, np.float64), np.asarray(other, np.float64)
    known = np.isfinite(one) & np.isfinite(two)
    left_out = int(known.size - known.sum())
    one, two = one[known], two[known]
    difference = two - one
    if difference.size == 0:
        return Paired(0, left_out, *(math.nan,) * 5, UNKNOWN, UNKNOWN, *(math.nan,) * 3)
    spread = float(difference.std(ddof=1)) if difference.size > 1 else math.nan
    return Paired(
        pairs=int(difference.size),
        left_out=left_out,
        baseline_mean=float(one.mean()),
        other_mean=float(two.mean()),
        mean=float(difference.mean()),
        median=float(np.median(difference)),
        sd=spread,
        t=t_interval(difference),
        bca=bca_interval(difference),
        effect=_hedges(difference, spread),
        lower_share=float((difference < 0).mean() + 0.5 * (difference == 0).mean()),
        rank_p=_rank_p(difference),
    )


def t_interval(values: Array) -> Interval:
    """Return Student's 95 % interval of the mean."""
    if values.size < 2:
        return UNKNOWN
    mean, error = float(values.mean()), float(stats.sem(values))
    if error == 0.0:
        return Interval(mean, mean)
    low, high = stats.t.interval(CONFIDENCE, values.size - 1, loc=mean, scale=error)
    return Interval(float(low), float(high))


def bca_interval(values: Array) -> Interval:
    """Return the BCa bootstrap's 95 % interval of the mean, the same for the same values."""
    if values.size < _LEAST_FOR_BOOTSTRAP:
        return UNKNOWN
    if np.ptp(values) == 0.0:
        return Interval(float(values[0]), float(values[0]))
    found = stats.bootstrap(
        (values,),
        np.mean,
        confidence_level=CONFIDENCE,
        n_resamples=_RESAMPLES,
        method="BCa",
        vectorized=True,
        rng=np.random.default_rng(_SEED),
    ).confidence_interval
    return Interval(float(found.low), float(found.high))


def _hedges(difference: Array, spread: float) -> float:
    count, mean = difference.size, float(difference.mean())
    if count < 2:
        return math.nan
    if spread == 0.0:
        return 0.0 if mean == 0.0 else math.copysign(math.inf, mean)
    return mean / spread * (1.0 - 3.0 / (4.0 * (count - 1) - 1.0))


def _rank_p(difference: Array) -> float:
    if difference.size < 2 or not difference.any():
        return math.nan if difference.size < 2 else 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # ties make the p approximate, which it may be
        return float(stats.wilcoxon(difference).pvalue)


@dataclass(frozen=True, slots=True)
class Adjusted:
    """The mean difference at equal covariate: intercept of difference on covariate difference."""

    mean: float
    interval: Interval
    slope: float

    def to_json(self) -> dict[str, Any]:
        """Return the adjustment for a JSON document."""
        low, high = self.interval.low, self.interval.high
        return {
            "mean": _finite(self.mean),
            "t_95": [_finite(low), _finite(high)],
            "slope": _finite(self.slope),
        }


def adjusted(difference: Sequence[float], covariate: Sequence[float]) -> Adjusted | None:
    """Take a covariate's part out of paired differences; None below 4 pairs or when it is constant.

    `covariate` is other - baseline of, for example, the battery's mean voltage in V.
    """
    y, x = np.asarray(difference, np.float64), np.asarray(covariate, np.float64)
    known = np.isfinite(y) & np.isfinite(x)
    y, x = y[known], x[known]
    if y.size < 4 or np.ptp(x) == 0.0:
        return None
    fit = stats.linregress(x, y)
    reach = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, y.size - 2)) * float(fit.intercept_stderr)
    middle = float(fit.intercept)
    return Adjusted(middle, Interval(middle - reach, middle + reach), float(fit.slope))


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
