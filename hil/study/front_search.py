"""The search for a front: gains of one law against three scores, with Optuna (docs/verdict.md).

Every law gets the same candidates, cells and seeds; gains are searched on logarithmic scales within the box
that the law declares, from the start that it declares. A search is deterministic by its seed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hil.analysis.fronts import front_of, share_of_box
from hil.core.errors import BadInput
from hil.core.registry import Box
from hil.study.suite import MOST, Scores
from hil.study.tune import decode

LEAST_SCORE = 0.1
# Candidates asked for at once, which run side by side.
BATCH = 8

Values = dict[str, float]
ScoresOf = Callable[[Sequence[Values]], Sequence[Scores]]


@dataclass(frozen=True, slots=True)
class Candidate:
    """Gains that were tried, and their scores on the cells of the search."""

    values: Values
    scores: Scores


@dataclass(frozen=True, slots=True)
class Front:
    """What one search of one law tried."""

    law: str
    seed: int
    tried: tuple[Candidate, ...]

    @property
    def best(self) -> list[Candidate]:
        """Return the candidates that no other dominates, the most accurate first."""
        places = front_of([one.scores for one in self.tried])
        return sorted((self.tried[i] for i in places), key=lambda one: one.scores)

    @property
    def volume(self) -> float:
        """Return its hypervolume: share of the box of scores from 0.1 to 10, on logarithmic scales."""
        return share_of_box([one.scores for one in self.best], LEAST_SCORE, MOST)

    def picked(self, count: int) -> list[Candidate]:
        """Return up to `count` candidates of the front, spread evenly over its calm.

        By their calm alone: of candidates of the front that a more accurate and calmer one leaves behind
        (they are on it by their effort) none is taken.
        """
        flat = front_of([one.scores[:2] for one in self.best])
        order = sorted((self.best[i] for i in flat), key=lambda one: one.scores.calm)
        if len(order) <= count:
            return order
        logs = [math.log(max(one.scores.calm, 1e-3)) for one in order]
        aims = [logs[0] + (logs[-1] - logs[0]) * i / (count - 1) for i in range(count)]
        places = {min(range(len(logs)), key=lambda i: abs(logs[i] - aim)) for aim in aims}
        return [order[i] for i in sorted(places)]


def single_best(front: Sequence[Candidate], calm_most: float = 1.0) -> Candidate:
    """Return the one set that a front is worth where one is needed, by a rule fixed before any search.

    Of the candidates with calm up to `calm_most` (as calm as the yardstick) the most accurate one; if
    none is that calm, the calmest.
    """
    calm = [one for one in front if one.scores.calm <= calm_most]
    if calm:
        return min(calm, key=lambda one: one.scores)
    return min(front, key=lambda one: one.scores.calm)


def start_of(box: Box) -> list[float]:
    """Return where a law's search begins, as a point of the unit cube."""
    return [math.log(middle / low) / math.log(high / low) for low, middle, high in box.values()]


def search_front(
    law: str,
    box: Box,
    scores_of: ScoresOf,
    *,
    candidates: int,
    seed: int,
    also: Sequence[Mapping[str, float]] = (),
) -> Front:
    """Return what a search of `candidates` candidates tried; `also` are tried after the start."""
    optuna = require_optuna()
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    study = optuna.create_study(directions=["minimize"] * 3, sampler=sampler(optuna, seed))
    names = list(box)
    first = [start_of(box), *(_point_of(box, values) for values in also)]
    for point in first:
        study.enqueue_trial(dict(zip(names, point, strict=True)))
    tried: list[Candidate] = []
    while len(tried) < candidates:
        trials = [study.ask() for _ in range(min(BATCH, candidates - len(tried)))]
        points = [[trial.suggest_float(name, 0.0, 1.0) for name in names] for trial in trials]
        values = [decode(box, point) for point in points]
        scores = scores_of(values)
        for trial, found in zip(trials, scores, strict=True):
            study.tell(trial, [math.log10(max(score, 1e-3)) for score in found])
        tried += [Candidate(v, s) for v, s in zip(values, scores, strict=True)]
    return Front(law, seed, tuple(tried))


def sampler(optuna: Any, seed: int) -> Any:
    """Return the sampler: of those compared the one with the largest fronts (docs/verdict.md)."""
    return optuna.samplers.NSGAIISampler(seed=seed, population_size=12)


def _point_of(box: Box, values: Mapping[str, float]) -> list[float]:
    """Return given gains as a point of the unit cube, moved inside where they are not."""
    point = []
    for name, (low, middle, high) in box.items():
        value = min(max(values.get(name, middle), low), high)
        point.append(math.log(value / low) / math.log(high / low))
    return point


def require_optuna() -> Any:
    """Return the module; raises BadInput where it is not installed."""
    try:
        import optuna  # noqa: PLC0415 - heavy, and not everybody has it
    except ImportError:
        raise BadInput(
            "a search over several scores needs Optuna; install it: pip install 'skid-steer-hil[search]'"
        ) from None
    return optuna
