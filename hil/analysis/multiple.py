"""What many figures and few pairs allow to say: false discoveries, equivalence, power, tails.

Differences are other - baseline throughout, lower is better.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from hil.analysis.intervals import CONFIDENCE, Interval, mean_interval
from hil.core.errors import BadInput

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

FALSE_DISCOVERY_RATE = 0.05
TAIL = 0.05


def adjusted_p(p_values: Sequence[float]) -> list[float]:
    """Return p values adjusted over a whole table (Benjamini and Hochberg); unknown ones stay NaN."""
    values = np.asarray(p_values, np.float64)
    known = np.isfinite(values)
    result = np.full(values.shape, math.nan)
    if known.any():
        result[known] = scipy.stats.false_discovery_control(values[known], method="bh")
    return [float(value) for value in result]


def discoveries(p_values: Sequence[float], rate: float = FALSE_DISCOVERY_RATE) -> list[bool]:
    """Say of each p whether it stands when of all that stand at most `rate` are false, on average."""
    return [bool(value <= rate) for value in adjusted_p(p_values)]


@dataclass(frozen=True, slots=True)
class Equivalence:
    """Whether a mean difference lies within +-margin, and whether it is no worse than the margin.

    `interval` is the 90 % one of the mean, whose place decides both at 5 % (two one-sided t tests);
    `p` is the larger of theirs, `p_worse` that of "worse by the margin or more".
    """

    margin: float
    interval: Interval
    p: float
    p_worse: float

    @property
    def equivalent(self) -> bool:
        """Say whether the two are equal within the margin."""
        return self.p <= 1.0 - CONFIDENCE

    @property
    def no_worse(self) -> bool:
        """Say whether the other is worse by less than the margin."""
        return self.p_worse <= 1.0 - CONFIDENCE

    def to_json(self) -> dict[str, Any]:
        """Return it for a JSON document."""
        return {
            "margin": self.margin,
            "interval_90": [_finite(self.interval.low), _finite(self.interval.high)],
            "p": _finite(self.p),
            "equivalent": self.equivalent,
            "no_worse": self.no_worse,
        }


def equivalence(difference: Sequence[float], margin: float) -> Equivalence:
    """Test whether paired differences are within +-margin; raises BadInput for a margin of none.

    Source: D. Schuirmann, J. Pharmacokinet. Biopharm. 15 (1987) 657.
    """
    if not (math.isfinite(margin) and margin > 0.0):
        raise BadInput(f"margin = {margin:g}: must be above 0, in the figure's unit")
    values = np.asarray(difference, np.float64)
    values = values[np.isfinite(values)]
    if values.size < 2:
        return Equivalence(margin, Interval(math.nan, math.nan), math.nan, math.nan)
    mean, freedom = float(values.mean()), values.size - 1
    error = float(values.std(ddof=1)) / math.sqrt(values.size)
    reach = float(scipy.stats.t.ppf(CONFIDENCE, freedom)) * error
    if error == 0.0:
        above, below = float(mean >= margin), float(mean <= -margin)
    else:
        above = float(scipy.stats.t.cdf((mean - margin) / error, freedom))
        below = float(scipy.stats.t.sf((mean + margin) / error, freedom))
    return Equivalence(margin, Interval(mean - reach, mean + reach), max(above, below), above)


def probability_of_improvement(baseline: Sequence[float], other: Sequence[float]) -> float:
    """Return how likely a run of the other is below a run of the baseline, ties counted half.

    Over all pairs of runs, not seed by seed (Mann and Whitney's U over its largest value): what a
    reader meets who runs each once. NaN without values.
    """
    one, two = (np.asarray(x, np.float64) for x in (baseline, other))
    one, two = np.sort(one[np.isfinite(one)]), two[np.isfinite(two)]
    if one.size == 0 or two.size == 0:
        return math.nan
    above = one.size - np.searchsorted(one, two, "right")
    ties = np.searchsorted(one, two, "right") - np.searchsorted(one, two, "left")
    return float((above + 0.5 * ties).sum() / (one.size * two.size))


def cvar(values: Sequence[float], tail: float = TAIL) -> float:
    """Return the mean of the worst (largest) share `tail` of the values; NaN without values.

    The value at the edge counts by its part, so that the figure does not jump with the count.
    Source: R. Rockafellar, S. Uryasev, J. Risk 2 (2000) 21.
    """
    known = np.asarray(values, np.float64)
    known = np.sort(known[~np.isnan(known)])[::-1]
    if known.size == 0:
        return math.nan
    weight = tail * known.size
    whole = math.floor(weight + 1e-12)
    part = weight - whole
    if whole == 0:
        return float(known[0])
    total = float(known[:whole].sum()) + (part * float(known[whole]) if part > 1e-12 else 0.0)
    return total / weight


def power(effect: float, pairs: int) -> float:
    """Return how often `pairs` pairs show a mean difference of `effect` standard deviations.

    Of the paired differences; two-sided t test at 5 %, normal differences.
    """
    if pairs < 2:
        return 0.0
    if abs(effect) > MOST_EFFECT:
        return 1.0
    edge = float(scipy.stats.t.ppf(0.5 + 0.5 * CONFIDENCE, pairs - 1))
    shift = abs(effect) * math.sqrt(pairs)
    above = float(scipy.stats.nct.sf(edge, pairs - 1, shift))
    below = float(scipy.stats.nct.cdf(-edge, pairs - 1, shift))
    return above + (below if math.isfinite(below) else 0.0)


MOST_PAIRS = 10_000_000
# Two pairs show as many standard deviations in all but one of a thousand studies; SciPy tells no more.
MOST_EFFECT = 1e4


def pairs_needed(difference: float, sd: float, wanted: float = 0.8) -> int:
    """Return the least pairs that show a mean difference with probability `wanted`; raises BadInput."""
    if not (
        difference and math.isfinite(difference) and 0.0 < sd < math.inf and 0.05 < wanted < 1.0
    ):
        raise BadInput(
            f"difference = {difference:g}, sd = {sd:g}, power = {wanted:g}: needs a difference other "
            "than 0, an sd above 0 (of the paired differences) and a power between 0.05 and 1"
        )
    effect = abs(difference) / sd
    if effect > MOST_EFFECT:
        return 2
    normal = (scipy.stats.norm.ppf(0.5 + 0.5 * CONFIDENCE) + scipy.stats.norm.ppf(wanted)) / effect
    if normal**2 > MOST_PAIRS:
        raise BadInput(f"difference = {difference:g}: needs more than {MOST_PAIRS:,} pairs")
    pairs = max(int(normal**2), 2)
    while power(effect, pairs) >= wanted and pairs > 2:
        pairs -= 1
    while power(effect, pairs) < wanted:
        pairs += 1
    return pairs


def difference_seen(sd: float, pairs: int, wanted: float = 0.8) -> float:
    """Return the least mean difference that `pairs` pairs show with probability `wanted`."""
    if pairs < 2:
        return math.inf
    effect = scipy.optimize.brentq(lambda x: power(x, pairs) - wanted, 1e-6, 60.0)
    return float(effect) * sd


# Looks of `stop_at`: pairs at which the width is looked at, each half as many again as the one before.
FIRST_LOOK = 24
_GROWTH = 1.5
# The half width at a look must be below this share of what was asked. Without it, stopping at widths
# that are small by chance lets intervals hold the mean less often than they say (docs/statistics.md).
STOP_SHARE = 0.94


def looks(most: int) -> list[int]:
    """Return the numbers of pairs at which `--until-interval` looks, up to `most`."""
    found = [min(FIRST_LOOK, most)]
    while found[-1] < most:
        found.append(min(math.ceil(found[-1] * _GROWTH), most))
    return found


def narrow_enough(differences: Sequence[float], half_width: float) -> bool:
    """Say whether the interval of the mean is narrow enough to stop at this look.

    Only its width is looked at, never whether it holds zero, and only at the pairs of `looks`.
    """
    values = np.asarray(differences, np.float64)
    values = values[np.isfinite(values)]
    if values.size < min(FIRST_LOOK, len(differences)) or values.size < 6:
        return False
    ends = mean_interval(values)
    mean = float(values.mean())
    return max(ends.high - mean, mean - ends.low) <= STOP_SHARE * half_width


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
