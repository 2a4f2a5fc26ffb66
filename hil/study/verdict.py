"""The verdict on all laws: fronts searched on one half of a deck, judged on the other (docs/verdict.md).

A search sees tasks, conditions and seeds that the verdict does not. Every law gets the same
candidates, cells and seeds. All of it is repeated for several seeds of the search itself: what one seed
says and another does not is no difference shown. What comes out is plain data; what it says is worked
out from that alone (`hil.study.verdict_words`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from hil.config.control import ControlConfig
from hil.config.deck import load_deck
from hil.control.laws.axes import drawn_axes_rad
from hil.core.registries import OUTER_LAWS
from hil.study.ablation import ablate
from hil.study.front_search import Front, search_front, single_best
from hil.study.suite import (
    Job,
    Make,
    Scores,
    Yardstick,
    laws_in_the_field,
    refuse_seen,
    scenarios_of,
    spread_over,
    task_of,
    together,
)
from hil.study.tune import boxes_of
from hil.study.verdict_words import BASELINE

if TYPE_CHECKING:
    from hil.config.deck import Deck
    from hil.config.gains import Gains
    from hil.config.scenario import Scenario

FORMAT = "hil-verdict-1"
SEARCH_RUN_SEED, UNSEEN_RUN_SEED = 1, 1000
Say = Callable[[str], None]
Data = dict[str, Any]


@dataclass(frozen=True, slots=True)
class VerdictPlan:
    """What every law is given alike.

    `search_cells` and `unseen_cells` are how many of the deck's are taken, spread over tasks and
    conditions; `picked` candidates of each front are judged; `repeats` seeds in each unseen cell.
    """

    candidates: int = 72
    search_cells: int = 5
    search_seeds: tuple[int, ...] = (1, 2, 3)
    picked: int = 4
    unseen_cells: int = 30
    repeats: int = 1
    ablation_cells: int = 30

    def runs(self, laws: int, parts: int) -> int:
        """Return about how many runs that is, `parts` being what is ablated of all laws."""
        search = self.candidates * self.search_cells
        unseen = (self.picked + 1) * self.unseen_cells * self.repeats
        shipped = self.unseen_cells * self.repeats
        return laws * (len(self.search_seeds) * (search + unseen) + shipped) + (
            (parts + laws) * self.ablation_cells * self.repeats
        )


def shipped_text() -> str:
    """Return the data of the verdict that README tells."""
    return (files("hil") / "data" / "verdict.json").read_text(encoding="utf-8")


def repeated_texts() -> dict[str, str]:
    """Return the data of verdicts made again with other seeds of the search, by their file's name."""
    folder = files("hil") / "data" / "verdicts"
    found = (
        [one for one in folder.iterdir() if one.name.endswith(".json")] if folder.is_dir() else []
    )
    return {
        one.name: one.read_text(encoding="utf-8") for one in sorted(found, key=lambda one: one.name)
    }


SHORT = VerdictPlan(
    candidates=8,
    search_cells=2,
    search_seeds=(1, 2),
    picked=2,
    unseen_cells=5,
    ablation_cells=3,
)


@dataclass(frozen=True, slots=True)
class Field:
    """The deck's two halves, and the laws."""

    deck: Deck
    laws: tuple[str, ...]
    scenarios: Mapping[str, Scenario]
    search: tuple[str, ...]
    unseen: tuple[str, ...]
    ablated: tuple[str, ...]

    @classmethod
    def of(cls, deck_name: str, plan: VerdictPlan, laws: Sequence[str] = ()) -> Field:
        """Return the field of a deck; raises BadInput where nothing unseen is left to judge on.

        Some `laws` alone are judged beside the one that all are compared with; without any, all are.
        """
        deck = load_deck(deck_name)
        seen = spread_over(deck.search_cells(), plan.search_cells)
        unseen = spread_over(deck.unseen_cells(), plan.unseen_cells)
        ablated = spread_over(deck.unseen_cells(), plan.ablation_cells)
        refuse_seen([*unseen, *ablated] or deck.cells(), seen)
        every = [*seen, *unseen, *ablated]
        named = [OUTER_LAWS.get(law).name for law in laws] or laws_in_the_field()
        return cls(
            deck,
            tuple(dict.fromkeys(named if BASELINE in named else (BASELINE, *named))),
            scenarios_of(deck, every),
            tuple(map(str, seen)),
            tuple(map(str, unseen)),
            tuple(map(str, ablated)),
        )

    @property
    def tasks(self) -> list[str]:
        """Return the tasks that are run."""
        used = {task_of(cell) for cell in (*self.search, *self.unseen, *self.ablated)}
        return [name for name in self.deck.scenarios if name in used]


def verdict_data(
    field: Field,
    plan: VerdictPlan,
    make: Make,
    *,
    revision: str,
    command: str,
    say: Say = lambda _text: None,
    parts: Callable[[str], Sequence[str]],
) -> Iterator[Data]:
    """Yield the verdict's data after each seed of the search and after the ablation; the last is whole."""
    boxes = boxes_of(field.laws)
    base = ControlConfig().active_gains
    yard = Yardstick.measured(field.tasks, make)
    data: Data = {
        "format": FORMAT,
        "command": command,
        "revision": revision,
        "plan": asdict(plan) | {"search_seeds": []},
        "laws": list(field.laws),
        "search_cells": list(field.search),
        "unseen_cells": list(field.unseen),
        "axes_rad": {cell: round(drawn_axes_rad(cell), 4) for cell in field.unseen},
        "yardstick": {task: dict(figures) for task, figures in yard.figures.items()},
        "fronts": [],
        "shipped_gains": shipped_gains(field.laws),
        "ablation": [],
    }
    data["shipped"] = shipped_scores(field, plan, yard, make)
    say(f"{', '.join(field.laws)}: judged with the gains that ship")
    for seed in plan.search_seeds:
        for law in field.laws:
            front = search_front(
                law,
                boxes[law],
                partial(_scores, law, base=base, field=field, yard=yard, make=make),
                candidates=plan.candidates,
                seed=seed,
            )
            data["fronts"].append(_judge_front(front, base, field, plan, yard, make))
            say(
                f"{law}: seed {seed}, hypervolume {front.volume:.3f}, {len(front.best)} on the front"
            )
        data["plan"]["search_seeds"].append(seed)
        yield data
    gains = {law: _best_of(data, law, base) for law in field.laws}
    seeds = range(UNSEEN_RUN_SEED, UNSEEN_RUN_SEED + plan.repeats)
    rows = ablate(gains, field.ablated, list(seeds), yard, make, parts)
    data["ablation"] = [row.to_json() for row in rows]
    yield data


def shipped_gains(laws: Sequence[str]) -> Data:
    """Return the values of the gains that ship, by law."""
    base = ControlConfig().active_gains
    return {law: base.of(OUTER_LAWS.get(law)).model_dump(mode="json") for law in laws}


def shipped_scores(field: Field, plan: VerdictPlan, yard: Yardstick, make: Make) -> Data:
    """Return the scores of the gains that ship in each unseen cell, by law."""
    return {law: unseen_scores(law, None, field, plan, yard, make) for law in field.laws}


def _scores(
    law: str,
    tried: Sequence[Mapping[str, float]],
    *,
    base: Gains,
    field: Field,
    yard: Yardstick,
    make: Make,
) -> list[Scores]:
    entry = OUTER_LAWS.get(law)
    jobs = [
        Job(law, base.with_values(entry, values), cell, SEARCH_RUN_SEED)
        for values in tried
        for cell in field.search
    ]
    found = [yard.scores(job.cell, f) for job, f in zip(jobs, make(jobs), strict=True)]
    each = len(field.search)
    return [together(found[i : i + each]) for i in range(0, len(found), each)]


def _judge_front(
    front: Front, base: Gains, field: Field, plan: VerdictPlan, yard: Yardstick, make: Make
) -> Data:
    single = single_best(front.best)
    chosen = front.picked(plan.picked)
    chosen = chosen if single in chosen else [*chosen, single]
    entry = OUTER_LAWS.get(front.law)
    return {
        "law": front.law,
        "seed": front.seed,
        "hypervolume": round(front.volume, 5),
        "on_the_front": len(front.best),
        "points": [
            {
                "values": one.values,
                "single_best": one is single or one == single,
                "search": _rounded(one.scores),
                "unseen": unseen_scores(
                    front.law, base.with_values(entry, one.values), field, plan, yard, make
                ),
            }
            for one in chosen
        ],
    }


def unseen_scores(
    law: str, gains: Gains | None, field: Field, plan: VerdictPlan, yard: Yardstick, make: Make
) -> dict[str, list[list[float]]]:
    """Return the scores of each run in each unseen cell."""
    seeds = range(UNSEEN_RUN_SEED, UNSEEN_RUN_SEED + plan.repeats)
    jobs = [Job(law, gains, cell, seed) for cell in field.unseen for seed in seeds]
    result: dict[str, list[list[float]]] = {cell: [] for cell in field.unseen}
    for job, figures in zip(jobs, make(jobs), strict=True):
        result[job.cell].append(_rounded(yard.scores(job.cell, figures)))
    return result


def _best_of(data: Data, law: str, base: Gains) -> Gains:
    """Return the single best set of the first seed's front."""
    fronts = [front for front in data["fronts"] if front["law"] == law]
    (point, *_) = [point for point in fronts[0]["points"] if point["single_best"]]
    return base.with_values(OUTER_LAWS.get(law), point["values"])


def _rounded(scores: Scores) -> list[float]:
    return [round(value, 4) for value in scores]
