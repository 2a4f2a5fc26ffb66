"""What a verdict's data say: at equal calm, who is more accurate and by how much; and the README's table.

Everything here is worked out from the data that `hil verdict` keeps, without a run.

At a level of calm a law is worth what the points of its front, in the order of their calm on the unseen
tasks, give at that calm: between two points their cells' accuracies are mixed by where the level lies. Of
what is as calm as the level or calmer the one that was most accurate in the search is taken. Two laws are
compared cell by cell on the logarithm of accuracy; tasks and conditions count as drawn (crossed), so an
interval speaks of other tasks too.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from hil.analysis.fronts import front_of
from hil.analysis.intervals import Interval, mean_interval
from hil.analysis.multiple import adjusted_p
from hil.analysis.stats import Paired, paired
from hil.core.registries import OUTER_LAWS
from hil.study.suite import condition_of, task_of

Data = Mapping[str, Any]
BASELINE = "pid"
# Levels of calm at which laws are compared: 1 is PID as shipped on the same task, calm. Fixed on a pilot of
# another budget: unseen conditions (a coarse encoder above all) make every law louder than that.
LEVELS = (1.0, 1.4, 2.0, 3.0, 4.0)
MAIN_LEVEL = 2.0
NONE_SHOWN = "no difference shown"
NOT_REACHED = "not that calm"


@dataclass(frozen=True, slots=True)
class AtLevel:
    """One law against the baseline at a level of calm, over the seeds of the search."""

    law: str
    level: float
    by_seed: tuple[Paired | None, ...]
    stands: bool

    @property
    def reached(self) -> bool:
        """Say whether both laws came to that calm with every seed."""
        return bool(self.by_seed) and all(one is not None for one in self.by_seed)

    @property
    def percent(self) -> tuple[float, float, float]:
        """Return mean, least and largest end of the difference in accuracy score, in percent."""
        known = [one for one in self.by_seed if one is not None]
        means = [one.mean for one in known]
        low, high = (min(o.interval.low for o in known), max(o.interval.high for o in known))
        return _percent(sum(means) / len(means)), _percent(low), _percent(high)

    def text(self) -> str:
        """Return it in words: percent of the baseline's accuracy score, below 0 is more accurate."""
        if not self.reached:
            return NOT_REACHED
        mean, low, high = self.percent
        said = f"{mean:+.0f} % ({low:+.0f} to {high:+.0f})"
        return said if self.stands else f"{NONE_SHOWN}: {said}"


def is_sliding(law: str) -> bool:
    """Say whether a law has a sliding variable, as it declares where it is registered."""
    return bool(OUTER_LAWS.get(law).extra.get("sliding", False))


def seeds_of(data: Data) -> list[int]:
    """Return the seeds of the search."""
    return list(data["plan"]["search_seeds"])


def at_calm(front: Data, level: float, cells: Sequence[str]) -> dict[str, float] | None:
    """Return a law's accuracy by cell at a level of calm; None where it is nowhere that calm."""
    points = [_Point.of(point, cells) for point in front["points"]]
    points.sort(key=lambda point: point.calm)
    allowed = [point for point in points if point.calm <= level]
    above = [point for point in points if point.calm > level]
    if not allowed:
        return None
    if above:
        allowed.append(_between(allowed[-1], above[0], level))
    return min(allowed, key=lambda point: point.search).by_cell


@dataclass(frozen=True, slots=True)
class _Point:
    search: float
    calm: float
    by_cell: dict[str, float]

    @classmethod
    def of(cls, point: Data, cells: Sequence[str]) -> _Point:
        unseen = point["unseen"]
        by_cell = {cell: _mean([run[0] for run in unseen[cell]]) for cell in cells}
        calm = _mean([run[1] for cell in cells for run in unseen[cell]])
        return cls(point["search"][0], calm, by_cell)


def _between(one: _Point, other: _Point, level: float) -> _Point:
    share = (math.log(level) - math.log(one.calm)) / (math.log(other.calm) - math.log(one.calm))

    def mixed(a: float, b: float) -> float:
        return math.exp((1.0 - share) * math.log(a) + share * math.log(b))

    return _Point(
        mixed(one.search, other.search),
        level,
        {cell: mixed(one.by_cell[cell], other.by_cell[cell]) for cell in one.by_cell},
    )


def compared(data: Data, law: str, other: str, seed: int, level: float) -> Paired | None:
    """Return the paired log ratio of accuracy, law over other, at equal calm; None if not reached."""
    cells = data["unseen_cells"]
    sides = [at_calm(_front(data, name, seed), level, cells) for name in (other, law)]
    if sides[0] is None or sides[1] is None:
        return None
    one, two = ([math.log(side[cell]) for cell in cells] for side in sides if side is not None)
    return paired(one, two, [(task_of(cell), condition_of(cell)) for cell in cells])


def table_of(data: Data, other: str = BASELINE) -> list[AtLevel]:
    """Return every law against another at every level.

    A difference stands if with every seed of the search its interval is on the same side of zero, and
    its p stands among all of that seed's table (false discovery rate of 5 %).
    """
    laws = [law for law in data["laws"] if law != other]
    keys = [(law, level) for law in laws for level in LEVELS]
    found = {
        seed: [compared(data, law, other, seed, level) for law, level in keys]
        for seed in seeds_of(data)
    }
    adjusted = {
        seed: adjusted_p([math.nan if one is None else _p_of(one) for one in row])
        for seed, row in found.items()
    }
    table = []
    for place, (law, level) in enumerate(keys):
        by_seed = tuple(found[seed][place] for seed in found)
        stands = all(adjusted[seed][place] <= 0.05 for seed in found) and _same_side(by_seed)
        table.append(AtLevel(law, level, by_seed, stands))
    return table


def _p_of(found: Paired) -> float:
    """Return the p that a difference's interval speaks of: below 0.05 exactly where it is free of 0.

    Not the signed ranks': over five tasks those are never below 0.06.
    """
    half = 0.5 * (found.interval.high - found.interval.low)
    if not half > 0.0:
        return math.nan if math.isnan(half) else float(found.mean == 0.0)
    freedom = max(found.tapes - 1, 1)
    edge = float(stats.t.ppf(0.975, freedom))
    away = min(abs(found.interval.low), abs(found.interval.high))
    outside = away if not found.interval.contains_zero else -away
    return float(2.0 * stats.t.sf(max(edge * (1.0 + outside / half), 0.0), freedom))


def _same_side(by_seed: Sequence[Paired | None]) -> bool:
    known = [one for one in by_seed if one is not None]
    if len(known) < len(by_seed) or not known:
        return False
    below = all(one.interval.high < 0.0 for one in known)
    above = all(one.interval.low > 0.0 for one in known)
    return below or above


def first_line(data: Data) -> str:
    """Return the verdict in one sentence: whether a sliding-mode law wins anywhere at equal calm."""
    rows = [row for row in table_of(data) if is_sliding(row.law)]
    wins = [row for row in rows if row.stands and row.percent[0] < 0.0]
    losses = [row for row in rows if row.stands and row.percent[0] > 0.0]
    if not wins:
        told = (
            "No sliding-mode law is shown to be more accurate than PID at equal calm on tasks and "
            "conditions that no search has seen"
        )
        worse = sorted({row.law for row in losses})
        return f"{told}; shown to be less accurate: {', '.join(worse)}." if worse else f"{told}."
    best = min(wins, key=lambda row: row.percent[0])
    mean, low, high = best.percent
    return (
        f"At equal calm ({best.level:g} of PID as shipped) {best.law} is {-mean:.0f} % more accurate than "
        f"PID on unseen tasks and conditions ({-high:.0f} to {-low:.0f} %)."
    )


def repeated_line(data: Data, again: Data) -> str:
    """Return whether a verdict made again with other seeds of the search says the same, with its budget."""
    plan = again["plan"]
    seeds = ", ".join(map(str, plan["search_seeds"]))
    budget = (
        f"seeds of the search {seeds}, {plan['candidates']} candidates a law in "
        f"{len(again['search_cells'])} cells, judged in {len(again['unseen_cells'])} unseen cells"
    )
    if first_line(again) == first_line(data):
        return f"Made again ({budget}) it says the same."
    return f"Made again ({budget}) it says otherwise: {first_line(again)}"


def volumes(data: Data) -> dict[str, tuple[float, Interval]]:
    """Return each law's hypervolume in the search: mean and interval over the seeds."""
    result = {}
    for law in data["laws"]:
        values = [front["hypervolume"] for front in data["fronts"] if front["law"] == law]
        result[law] = (_mean(values), mean_interval(np.asarray(values, np.float64)))
    return result


def unseen_front(data: Data, law: str, seed: int) -> list[tuple[float, float, float]]:
    """Return a law's judged points on the unseen tasks that none of its own dominates, by calm."""
    cells = data["unseen_cells"]
    found = [
        tuple(_mean([run[i] for cell in cells for run in point["unseen"][cell]]) for i in range(3))
        for point in _front(data, law, seed)["points"]
    ]
    keep = [found[i] for i in front_of(found)]
    return sorted(((a, c, e) for a, c, e in keep), key=lambda point: point[1])


def by_task(data: Data, law: str, level: float = MAIN_LEVEL) -> dict[str, float]:
    """Return a law's accuracy by task at a level of calm: geometric mean over cells and search seeds."""
    logs: dict[str, list[float]] = {}
    for seed in seeds_of(data):
        found = at_calm(_front(data, law, seed), level, data["unseen_cells"])
        for cell, value in (found or {}).items():
            logs.setdefault(task_of(cell), []).append(math.log(value))
    return {task: math.exp(_mean(values)) for task, values in logs.items()}


def other_rankings(data: Data, level: float = MAIN_LEVEL) -> list[str]:
    """Return the unseen tasks that rank the laws' first place otherwise than all of them together."""
    tables = {law: by_task(data, law, level) for law in data["laws"]}
    tables = {law: table for law, table in tables.items() if table}
    if not tables:
        return []
    overall = {law: _mean([math.log(x) for x in table.values()]) for law, table in tables.items()}
    first = min(overall, key=lambda law: overall[law])
    tasks = next(iter(tables.values()))
    return [task for task in tasks if min(tables, key=lambda law: tables[law][task]) != first]


def readme_table(data: Data) -> list[str]:
    """Return the README's table: a line a law, its accuracy against PID at each level of calm."""
    rows = {(row.law, row.level): row for row in table_of(data)}
    head = "| law | " + " | ".join(f"calm {level:g}" for level in LEVELS) + " | hypervolume |"
    lines = [head, "| --- " * (len(LEVELS) + 2) + "|"]
    found = volumes(data)
    for law in data["laws"]:
        cells = [
            _cell(rows[law, level]) if law != BASELINE else _own(data, level) for level in LEVELS
        ]
        mean, ends = found[law]
        spread = f" ({ends.low:.3f} to {ends.high:.3f})" if math.isfinite(ends.low) else ""
        lines.append(f"| {law} | " + " | ".join(cells) + f" | {mean:.3f}{spread} |")
    return lines


def _cell(row: AtLevel) -> str:
    if not row.reached:
        return "–"
    return _marked(row.percent, row.stands)


def _own(data: Data, level: float) -> str:
    """Return the baseline's own accuracy score at a level."""
    table = by_task(data, BASELINE, level)
    return f"{math.exp(_mean([math.log(x) for x in table.values()])):.2f}" if table else "–"


def shipped_table(data: Data) -> list[str]:
    """Return what the gains that ship are worth in the unseen cells, the most accurate first.

    The last column is accuracy against the baseline's, cell by cell on the logarithm as in `compared`, but
    not at equal calm; bold where it stands among the table's (false discovery rate of 5 %).
    """
    cells = data["unseen_cells"]
    scores = {
        law: [_mean([_mean([run[i] for run in one[cell]]) for cell in cells]) for i in range(3)]
        for law, one in data["shipped"].items()
    }
    others = [law for law in scores if law != BASELINE]
    found = {law: shipped_compared(data, law) for law in others}
    adjusted = dict(zip(others, adjusted_p([_p_of(found[law]) for law in others]), strict=True))
    lines = ["| law, gains that ship | accuracy | calm | effort | accuracy minus PID's |"]
    lines.append("| --- " * 5 + "|")
    for law in sorted(scores, key=lambda law: scores[law][0]):
        said = "" if law == BASELINE else _difference(found[law], bool(adjusted[law] <= 0.05))
        numbers = " | ".join(f"{value:.2f}" for value in scores[law])
        lines.append(f"| {law} | {numbers} | {said} |")
    return lines


def shipped_compared(data: Data, law: str, other: str = BASELINE) -> Paired:
    """Return the paired log ratio of accuracy of two laws with the gains that ship, law over other."""
    cells = data["unseen_cells"]
    one, two = (
        [math.log(_mean([run[0] for run in data["shipped"][name][cell]])) for cell in cells]
        for name in (other, law)
    )
    return paired(one, two, [(task_of(cell), condition_of(cell)) for cell in cells])


def _difference(found: Paired, stands: bool) -> str:
    return _marked(
        (_percent(found.mean), _percent(found.interval.low), _percent(found.interval.high)), stands
    )


def _marked(percent: tuple[float, float, float], stands: bool) -> str:
    mean, low, high = percent
    said = f"{mean:+.0f} % ({low:+.0f} to {high:+.0f})"
    return f"**{said}**" if stands else said


def ablation_table(data: Data) -> list[str]:
    """Return what each part of each law is worth: lines of a table, score without it minus with it."""
    lines = ["| law, part off | accuracy | calm | effort | failed |", "| --- " * 5 + "|"]
    for row in data["ablation"]:
        cells = []
        for score in ("accuracy", "calm", "effort"):
            one = row["scores"][score]
            low, high = one["interval_95"]
            ends = "" if low is None else f" ({low:+.2f} to {high:+.2f})"
            said = f"{one['mean']:+.2f}{ends}"
            cells.append(f"**{said}**" if one["discovery"] and not one["contains_zero"] else said)
        lines.append(
            f"| {row['law']}, {row['part']} | " + " | ".join(cells) + f" | {row['failed_runs']} |"
        )
    return lines


def _front(data: Data, law: str, seed: int) -> Data:
    found: Data = next(f for f in data["fronts"] if f["law"] == law and f["seed"] == seed)
    return found


def _percent(log_ratio: float) -> float:
    return 100.0 * (math.exp(min(log_ratio, 5.0)) - 1.0) if math.isfinite(log_ratio) else math.nan


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values) if values else math.nan
