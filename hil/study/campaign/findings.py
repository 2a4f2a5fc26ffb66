"""What a campaign says: along each varied value, every arm's figures and the paired differences.

Rows of one point, draw and seed are a pair: they met the same noise. Along one value, all others
are averaged over. Seeds and draws are common to all points: it is these that the intervals take to
be drawn at random, and not the pairs. Drawn values are grouped into bins of equal count.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.analysis.intervals import Interval
from hil.analysis.stats import Paired, Tape, level, paired
from hil.report.arms import Arm, arm_names, law_rank
from hil.study.campaign.plan import HOLDS, Campaign, metric_of

if TYPE_CHECKING:
    import pyarrow as pa
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_BINS = 8


@dataclass(frozen=True, slots=True)
class Station:
    """One place on an axis: the value (middle of a bin), and the rows of its pairs."""

    value: float | str
    pairs: NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Outcomes:
    """A campaign's results as arrays: pairs x arms, the baseline first."""

    campaign: Campaign
    arms: tuple[Arm, ...]
    labels: tuple[str, ...]
    points: dict[str, NDArray[Any]]
    figures: dict[str, Array]
    complete: NDArray[np.bool_]
    tapes: tuple[Tape, ...]

    @property
    def numeric_axes(self) -> list[str]:
        """Return the names of the varied values that are numbers."""
        return [name for name, values in self.points.items() if values.dtype.kind == "f"]

    def stations(self, axis: str) -> list[Station]:
        """Return the places on an axis in ascending order."""
        values = self.points[axis]
        distinct = np.unique(values)
        if axis in self.campaign.file.random and distinct.size > _BINS:
            edges = np.quantile(values, np.linspace(0.0, 1.0, _BINS + 1))
            bin_of = np.clip(np.searchsorted(edges, values, "right") - 1, 0, _BINS - 1)
            groups = [np.flatnonzero(bin_of == number) for number in range(_BINS)]
            return [Station(float(np.median(values[g])), g) for g in groups if g.size]
        return [
            Station(
                value.item() if hasattr(value, "item") else value, np.flatnonzero(values == value)
            )
            for value in distinct
        ]

    def level(self, figure: str, arm: int, pairs: NDArray[np.intp]) -> tuple[float, Interval]:
        """Return an arm's mean over the pairs that have the figure, and its 95 % interval."""
        return level(self.figures[figure][pairs, arm].tolist(), [self.tapes[i] for i in pairs])

    def difference(self, figure: str, arm: int, pairs: NDArray[np.intp]) -> Paired:
        """Return the paired difference of an arm to the baseline."""
        values = self.figures[figure][pairs]
        return paired(
            values[:, 0].tolist(),
            values[:, arm].tolist(),
            [self.tapes[i] for i in pairs],
            shares=figure == HOLDS.name,
        )


def outcomes_of(campaign: Campaign, table: pa.Table) -> Outcomes:
    """Return a whole campaign's results as arrays."""
    arms = list(itertools.product(campaign.file.outer, campaign.file.inner))
    order = sorted(range(len(arms)), key=lambda i: [law_rank(law) for law in arms[i]])
    names = arm_names([arms[i] for i in order])
    count = len(arms)

    def by_pair(name: str) -> NDArray[Any]:
        values: NDArray[Any] = table.column(name).to_numpy()
        return values.reshape(-1, count)

    return Outcomes(
        campaign,
        tuple(arms[i] for i in order),
        tuple(names[arms[i]] for i in order),
        {axis: by_pair(axis)[:, 0] for axis in campaign.axes},
        {
            name: by_pair(name).astype(np.float64)[:, order]
            for name in (*campaign.figures, HOLDS.name)
        },
        (by_pair("outcome") == "complete")[:, order],
        tuple(zip(by_pair("seed")[:, 0].tolist(), by_pair("draw")[:, 0].tolist(), strict=True)),
    )


def documents(outcomes: Outcomes) -> Iterator[dict[str, Any]]:
    """Yield one JSON document per axis, figure and other arm: values, differences, verdicts."""
    for axis in outcomes.points:
        stations = outcomes.stations(axis)
        for figure in outcomes.campaign.file.figures:
            for arm in range(1, len(outcomes.arms)):
                yield {
                    "axis": axis,
                    "figure": figure,
                    "unit": metric_of(figure).unit,
                    "other": outcomes.labels[arm],
                    "baseline": outcomes.labels[0],
                    "stations": [
                        _told(figure, station, outcomes.difference(figure, arm, station.pairs))
                        for station in stations
                    ],
                }


def _told(figure: str, station: Station, result: Paired) -> dict[str, Any]:
    return {"value": station.value, "verdict": _verdict(figure, result)} | result.to_json()


def sentences(outcomes: Outcomes) -> list[str]:
    """Return where along each axis an arm is better than the baseline, worse, or not told apart."""
    lines = []
    for axis, figure in itertools.product(outcomes.points, outcomes.campaign.file.figures):
        for arm in range(1, len(outcomes.arms)):
            said: dict[str, list[str]] = {}
            for station in outcomes.stations(axis):
                result = outcomes.difference(figure, arm, station.pairs)
                said.setdefault(_verdict(figure, result), []).append(short(station.value))
            told = "; ".join(f"{verdict} at {', '.join(at)}" for verdict, at in said.items())
            lines.append(
                f"{metric_of(figure).label} along {axis}: {outcomes.labels[arm]} against "
                f"{outcomes.labels[0]} is {told}."
            )
    return lines


def _verdict(figure: str, result: Paired) -> str:
    if result.pairs == 0:
        return "without runs to compare"
    if math.isnan(result.interval.low):
        return "known from one seed alone"
    if not result.certain:
        return "not told apart"
    better = metric_of(figure).better
    if better == "neither":
        return "lower" if result.mean < 0 else "higher"
    return "better" if (result.mean < 0) == (better == "lower") else "worse"


def short(value: float | str) -> str:
    """Return a value as an axis shows it."""
    return f"{value:.3g}" if isinstance(value, float) else value
