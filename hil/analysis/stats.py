"""Paired differences with their intervals: how much better, and how sure (docs/statistics.md).

Two arms of an experiment that share seeds are compared seed by seed, so that what both met alike
(noise, delays, losses) cancels. All differences are other - baseline. The intervals are those of
hil/analysis/intervals.py. Nothing here draws an unseeded number.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Hashable, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from hil.analysis.intervals import (
    CONFIDENCE,
    UNKNOWN,
    Coverage,
    Interval,
    by_group,
    codes_of,
    coverage_of,
    crossed_interval,
    mean_interval,
    median_interval,
    share_interval,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.analysis.intervals import Codes

    Array = NDArray[np.float64]
    # Of an array the columns are seeds and draws.
    Tapes = Sequence["Tape"] | NDArray[np.int64]

# Differences that are equal up to this share of the values themselves are equal but for rounding.
_ROUNDING = 1e-12
# Names of what a pair has in common with others: its seed, and its draw of random values.
Tape = tuple[Hashable, Hashable]


@dataclass(frozen=True, slots=True)
class Paired:
    """Differences other - baseline over `pairs` pairs; `left_out` pairs lacked a finite value.

    `tapes` counts what the intervals rest on: pairs, or where several pairs met one seed (or one
    draw) the seeds, or of seeds and draws the fewer. `interval` is that of the mean, and `coverage`
    how often such an interval was measured to hold it; `median_interval` is that of the median over
    the tapes, which holds it in `median_coverage` of all studies however the differences are
    distributed. `effect` is Hedges' g_z: the mean difference over the standard
    deviation of the differences, corrected for small samples; infinite when every pair differs
    alike, NaN for two pairs, where the correction leaves nothing of it.
    `lower_share` is the share of pairs in which the other is lower, ties counted half.
    `rank_p` is Wilcoxon's signed-rank p, over the tapes.
    """

    pairs: int
    left_out: int
    tapes: int
    baseline_mean: float
    other_mean: float
    mean: float
    median: float
    sd: float
    interval: Interval
    median_interval: Interval
    median_coverage: float
    coverage: Coverage | None
    effect: float
    lower_share: float
    rank_p: float

    @property
    def certain(self) -> bool:
        """Say whether the interval is known and does not contain zero."""
        return not self.interval.contains_zero

    def to_json(self) -> dict[str, Any]:
        """Return the comparison for a JSON document, what is not finite as null."""
        tree = asdict(self)
        ends = {
            "interval_95": tree.pop("interval"),
            "median_interval": tree.pop("median_interval"),
        }
        plain = {k: _finite(v) if isinstance(v, float) else v for k, v in tree.items()}
        plain |= {name: [_finite(value) for value in end.values()] for name, end in ends.items()}
        return plain | {"contains_zero": self.interval.contains_zero}


def paired(
    baseline: Sequence[float] | Array,
    other: Sequence[float] | Array,
    tapes: Tapes | None = None,
    *,
    shares: bool = False,
) -> Paired:
    """Compare two arms pair by pair (same length, same order); needs 2 tapes for an interval.

    `tapes` names each pair's seed and draw, where pairs have some in common: then these are what
    was drawn at random, and not the pairs. `shares`: every value is 0 or 1.
    """
    one, two = np.asarray(baseline, np.float64), np.asarray(other, np.float64)
    known = np.isfinite(one) & np.isfinite(two)
    left_out = int(known.size - known.sum())
    one, two = one[known], two[known]
    if one.size == 0:
        return Paired(
            0, left_out, 0, *(math.nan,) * 5, UNKNOWN, UNKNOWN, math.nan, None, *(math.nan,) * 3
        )
    difference = _without_rounding(one, two)
    given = tapes is not None and len(tapes) > 0
    found = _of_tapes(difference, *_codes(tapes, known)) if given else _OfMean.of(difference)
    interval = _of_shares(found, one, two) if shares else found.interval
    median, median_holds = UNKNOWN, math.nan
    if not found.crossed:
        median, median_holds = median_interval(found.own)
    spread = float(difference.std(ddof=1)) if difference.size > 1 else math.nan
    spread = 0.0 if spread > 0.0 and np.ptp(difference) == 0.0 else spread
    return Paired(
        pairs=int(difference.size),
        left_out=left_out,
        tapes=int(found.own.size),
        baseline_mean=float(one.mean()),
        other_mean=float(two.mean()),
        mean=float(difference.mean()),
        median=float(np.median(difference)),
        sd=spread,
        interval=interval,
        median_interval=median,
        median_coverage=median_holds,
        coverage=coverage_of(found.own.size) if found.measured and not shares else None,
        effect=_hedges(difference, spread),
        lower_share=float((difference < 0).mean() + 0.5 * (difference == 0).mean()),
        rank_p=_rank_p(found.own),
    )


def level(values: Sequence[float] | Array, tapes: Tapes) -> tuple[float, Interval]:
    """Return the mean of one arm's known values and its 95 % interval; `tapes` as of `paired`."""
    found = np.asarray(values, np.float64)
    known = np.isfinite(found)
    if not known.any():
        return math.nan, UNKNOWN
    return float(found[known].mean()), _of_tapes(found[known], *_codes(tapes, known)).interval


def _codes(tapes: Tapes | None, known: NDArray[np.bool_]) -> tuple[Codes, Codes]:
    """Return the seed and the draw of each known pair, numbered in order of their first."""
    assert tapes is not None
    if len(tapes) != known.size:
        raise ValueError(f"{len(tapes)} tapes of {known.size} pairs")
    if isinstance(tapes, np.ndarray):
        return codes_of(tapes[known, 0]), codes_of(tapes[known, 1])
    chosen = [tape for tape, here in zip(tapes, known, strict=True) if here]
    return codes_of([tape[0] for tape in chosen]), codes_of([tape[1] for tape in chosen])


def _without_rounding(one: Array, two: Array) -> Array:
    """Return two - one; differences that rounding alone tells apart are made equal."""
    difference = two - one
    rounding = _ROUNDING * float(max(np.abs(one).max(), np.abs(two).max()))
    if float(np.ptp(difference)) <= rounding:
        mean = float(difference.mean())
        return np.full_like(difference, 0.0 if abs(mean) <= rounding else mean)
    return difference


@dataclass(frozen=True, slots=True)
class _OfMean:
    """The interval of a mean, and one value for each independent tape that it rests on."""

    interval: Interval
    own: Array
    crossed: bool = False

    @classmethod
    def of(cls, own: Array) -> _OfMean:
        return cls(mean_interval(own), own)

    @property
    def measured(self) -> bool:
        return not self.crossed and self.own.size >= 2


def _of_tapes(values: Array, seeds: Codes, draws: Codes) -> _OfMean:
    """Return the mean's interval where pairs share seeds or draws."""
    several = [names for names in (seeds, draws) if names.max() > 0]
    if not several:
        return _OfMean.of(values[:1])
    fewer = by_group(values, min(several, key=np.max))
    if len(several) == 1:
        return _OfMean.of(fewer)
    return _OfMean(crossed_interval(values, seeds, draws), fewer, crossed=True)


def _of_shares(found: _OfMean, one: Array, two: Array) -> Interval:
    """Return the interval where values are 0 or 1: that none of a few runs fails proves little."""
    if math.isnan(found.interval.low):
        return UNKNOWN
    share = share_interval(one, two)
    if found.own.size == one.size:
        return share
    low, high = min(found.interval.low, share.low), max(found.interval.high, share.high)
    return Interval(low, high)


def _hedges(difference: Array, spread: float) -> float:
    count, mean = difference.size, float(difference.mean())
    if count < 2:
        return math.nan
    if spread == 0.0:
        return 0.0 if mean == 0.0 else math.copysign(math.inf, mean)
    if count == 2:  # the exact correction for one degree of freedom is 0
        return math.nan
    return mean / spread * (1.0 - 3.0 / (4.0 * (count - 1) - 1.0))


def _rank_p(difference: Array) -> float:
    if difference.size < 2 or not difference.any():
        return math.nan if difference.size < 2 else 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # ties make the p approximate, which it may be
        return float(scipy.stats.wilcoxon(difference).pvalue)


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
    fit = scipy.stats.linregress(x, y)
    reach = float(scipy.stats.t.ppf(0.5 + 0.5 * CONFIDENCE, y.size - 2)) * float(
        fit.intercept_stderr
    )
    middle = float(fit.intercept)
    return Adjusted(middle, Interval(middle - reach, middle + reach), float(fit.slope))


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
