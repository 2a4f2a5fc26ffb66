"""A task of one's own beside a verdict: whether it ranks the laws as the verdict's tasks do.

The points of every front that a verdict kept are run on the task, in the conditions that no search has seen,
with the yardstick of that task; nothing is searched. What comes out has the form of a verdict's data, so
that all that is said of a verdict can be said of the task.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from scipy import stats

from hil.config.control import ControlConfig
from hil.config.deck import CALM, Cell
from hil.core.errors import BadInput
from hil.core.registries import OUTER_LAWS
from hil.study import verdict_words as words
from hil.study.suite import Job, Make, Yardstick, condition_of
from hil.study.verdict import UNSEEN_RUN_SEED

if TYPE_CHECKING:
    from hil.config.deck import Deck
    from hil.config.scenario import Scenario

Data = dict[str, Any]


@dataclass(frozen=True, slots=True)
class OwnTask:
    """A task in the conditions of a deck that no search has seen; `cells` without the calm one."""

    name: str
    scenarios: Mapping[str, Scenario]
    cells: tuple[str, ...]

    @classmethod
    def of(cls, file: str, deck: Deck, data: Data) -> OwnTask:
        """Return the task of a scenario file; raises BadInput for one that the deck has already."""
        conditions = list(dict.fromkeys(condition_of(cell) for cell in data["unseen_cells"]))
        missing = [one for one in conditions if one not in deck.condition_names]
        if missing:
            raise BadInput(
                f"--task {file}: the verdict was judged in {missing[0]!r}, which this deck has not; name "
                "the deck of the verdict"
            )
        if file in deck.scenarios:
            raise BadInput(
                f"--task {file}: is one of the deck's own tasks; give one that it has not"
            )
        found = {
            one: deck.scenario_of(Cell(scenario=file, condition=one)) for one in (CALM, *conditions)
        }
        name = found[CALM].name.removesuffix(f"-in-{CALM}")
        return cls(
            name,
            {f"{name} in {one}": scenario for one, scenario in found.items()},
            tuple(f"{name} in {one}" for one in conditions),
        )


def judged_on(task: OwnTask, data: Data, make: Make) -> Data:
    """Return a verdict's data with what its points do on the task in place of its unseen cells."""
    yard = Yardstick.measured([task.name], make)
    base = ControlConfig().active_gains
    told = copy.deepcopy(data) | {
        "unseen_cells": list(task.cells),
        "ablation": [],
        "task": task.name,
    }
    points = [(front["law"], point) for front in told["fronts"] for point in front["points"]]
    jobs = [
        Job(law, base.with_values(OUTER_LAWS.get(law), point["values"]), cell, UNSEEN_RUN_SEED)
        for law, point in points
        for cell in task.cells
    ]
    scores = [yard.scores(job.cell, f) for job, f in zip(jobs, make(jobs), strict=True)]
    each = len(task.cells)
    for place, (_, point) in enumerate(points):
        own = scores[place * each : (place + 1) * each]
        point["unseen"] = {cell: [list(one)] for cell, one in zip(task.cells, own, strict=True)}
    return told


def only_laws(data: Data, laws: Sequence[str]) -> Data:
    """Return a verdict's data of some laws alone; all for none. Raises BadInput for one it has not."""
    unknown = [law for law in laws if law not in data["laws"]]
    if unknown:
        raise BadInput(f"--outer {unknown[0]}: the verdict has no front of it")
    kept = [law for law in data["laws"] if not laws or law in laws or law == words.BASELINE]
    fronts = [front for front in data["fronts"] if front["law"] in kept]
    return data | {"laws": kept, "fronts": fronts}


def ranking(data: Data, level: float = words.MAIN_LEVEL) -> dict[str, float]:
    """Return laws by accuracy at a level of calm, the most accurate first; those that come to it."""
    found = {}
    for law in data["laws"]:
        table = words.by_task(data, law, level)
        if table:
            found[law] = math.exp(sum(map(math.log, table.values())) / len(table))
    return dict(sorted(found.items(), key=lambda item: item[1]))


@dataclass(frozen=True, slots=True)
class Agreement:
    """How a task ranks the laws against how a verdict does, at equal calm."""

    task: str
    own: dict[str, float]
    verdict: dict[str, float]

    @classmethod
    def of(cls, told: Data, data: Data) -> Agreement:
        """Compare the laws that both rank."""
        own, usual = ranking(told), ranking(data)
        return cls(
            told["task"],
            {law: score for law, score in own.items() if law in usual},
            {law: score for law, score in usual.items() if law in own},
        )

    @property
    def same(self) -> bool:
        """Say whether the order of all laws is the same."""
        return list(self.own) == list(self.verdict)

    @property
    def tau(self) -> float:
        """Return Kendall's tau of both orders: 1 the same, 0 unrelated, -1 the reverse; NaN below two."""
        if len(self.own) < 2:
            return math.nan
        ranks = list(self.verdict)
        found = stats.kendalltau(range(len(ranks)), [ranks.index(law) for law in self.own])
        return float(found.statistic)

    def text(self) -> str:
        """Return in a sentence whether the ranking is the same."""
        if len(self.own) < 2:
            return f"{self.task}: fewer than two laws come to that calm: nothing to rank"
        if self.same:
            return f"{self.task} ranks the laws as the verdict does: {', '.join(self.own)}"
        return (
            f"{self.task} does not rank the laws as the verdict does (Kendall's tau {self.tau:+.2f}): "
            f"{', '.join(self.own)}; the verdict: {', '.join(self.verdict)}"
        )

    def to_json(self) -> dict[str, Any]:
        """Return it for a JSON document."""
        tau = self.tau
        return {
            "task": self.task,
            "calm": words.MAIN_LEVEL,
            "same_ranking": self.same,
            "kendall_tau": tau if math.isfinite(tau) else None,
            "task_ranking": self.own,
            "verdict_ranking": self.verdict,
        }
