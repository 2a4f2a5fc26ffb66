"""What a campaign says: along each varied value, every arm's figures and the paired differences.

Rows of one point, draw and seed are a pair: they met the same noise. Along one value, all others
are averaged over. Seeds and draws are common to all points: it is these that the intervals take to
be drawn at random, and not the pairs. Drawn values are grouped into bins of equal count.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from hil.analysis.intervals import Interval
from hil.analysis.stats import Paired, level, paired
from hil.report.arms import Arm, arm_names, law_rank
from hil.study.campaign.merge import is_text
from hil.study.campaign.plan import HOLDS, Campaign, column_of, metric_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.study.campaign.merge import Table

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
    figures: Mapping[str, Array]
    complete: NDArray[np.bool_]
    tapes: NDArray[np.int64]  # pairs x (seed, draw)

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
        return level(self.figures[figure][pairs, arm], self.tapes[pairs])

    def difference(self, figure: str, arm: int, pairs: NDArray[np.intp]) -> Paired:
        """Return the paired difference of an arm to the baseline."""
        values = self.figures[figure][pairs]
        return paired(
            values[:, 0],
            values[:, arm],
            self.tapes[pairs],
            shares=figure == HOLDS.name,
        )


class _Figures(Mapping[str, "Array"]):
    """The figures of all runs by name, pairs x arms; each is read when it is asked for, and kept."""

    def __init__(self, table: Table, order: list[int], names: tuple[str, ...]) -> None:
        self._table = table
        self._order = order
        self._names = names
        self._read: dict[str, Array] = {}

    def __getitem__(self, name: str) -> Array:
        """Return one figure, NaN where a run has none."""
        if name not in self._read:
            if name not in self._names:
                raise KeyError(name)
            values = self._table.column(name).cast("float64").to_numpy()
            self._read[name] = values.reshape(-1, len(self._order))[:, self._order]
        return self._read[name]

    def __iter__(self) -> Iterator[str]:
        """Return the names of all figures."""
        return iter(self._names)

    def __len__(self) -> int:
        """Return how many figures there are."""
        return len(self._names)


def outcomes_of(campaign: Campaign, table: Table) -> Outcomes:
    """Return a whole campaign's results as arrays; of a table on disk only the columns that are used."""
    arms = list(itertools.product(campaign.file.outer, campaign.file.inner))
    order = sorted(range(len(arms)), key=lambda i: [law_rank(law) for law in arms[i]])
    names = arm_names([arms[i] for i in order])
    count = len(arms)

    def of_pairs(name: str) -> NDArray[Any]:
        column = table.column(name)
        firsts = column.take(pa.array(range(0, table.num_rows, count)))
        values: NDArray[Any] = firsts.to_numpy()
        return values

    complete: NDArray[np.bool_] = is_text(table.column("outcome"), "complete").to_numpy()
    return Outcomes(
        campaign,
        tuple(arms[i] for i in order),
        tuple(names[arms[i]] for i in order),
        {axis: of_pairs(column_of(axis)) for axis in campaign.axes},
        _Figures(table, order, (*campaign.figures, HOLDS.name)),
        complete.reshape(-1, count)[:, order],
        np.column_stack([of_pairs("seed"), of_pairs("draw")]),
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
