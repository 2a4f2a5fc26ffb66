"""A deck's cells as runs, and what a run is worth: three scores, each normalised by its task.

A cell is a task in a condition. The yardstick is PID with the gains that ship, on the same task, calm:
a score of 1 is as good as that, less is better.

- accuracy: 3/4 IAE and 1/4 the worst error of the last second, each over the yardstick's (the latter
  over at least 5 mm, below which it is noise);
- calm: the mean of the variations of both commands and of PWM, each over the yardstick's;
- effort: the integral of PWM squared over the yardstick's.

A score is at most 10; a run that ends early has 10 in each. Over several runs calm and effort are means, and
accuracy is 0.8 of the mean and 0.2 of the worst run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from hil.config.deck import CALM, Cell, Deck
from hil.core.errors import BadInput
from hil.core.registries import OUTER_LAWS
from hil.core.registry import BUILT_IN
from hil.study.directions import in_drawn_axes
from hil.study.parts_off import opened_without
from hil.study.workers import OfGroups

if TYPE_CHECKING:
    from hil.config.gains import Gains
    from hil.config.scenario import Scenario
    from hil.runs.execute import InMemory

YARDSTICK_LAW, YARDSTICK_SEED = "pid", 1
MOST = 10.0
LEAST_REST_M = 0.005
_IAE_SHARE, _WORST_SHARE = 0.75, 0.2
_CALM = ("eta1_variation_m_s", "theta_dot_variation_rad_s", "pwm_variation_counts")
_EFFORT = "pwm_energy_counts2_s"
_IAE, _REST = "iae_m_s", "delta1_worst_last_second_m"
KEPT = (_IAE, _REST, *_CALM, _EFFORT)

Figures = Mapping[str, float]


# What one number makes of the three scores, where a search needs one (`hil tune`).
COST = (1.0, 0.2, 0.05)


class Scores(NamedTuple):
    """Three scores, lower is better, 1 as the yardstick."""

    accuracy: float
    calm: float
    effort: float


FAILED = Scores(MOST, MOST, MOST)


class Job(NamedTuple):
    """One run: a law with its gains in a cell; `without` names a part of the law that is off."""

    outer: str
    gains: Gains | None
    cell: str
    seed: int
    without: str = ""


@dataclass(frozen=True, slots=True)
class OnSuite:
    """Makes one run of a job on the twin, without a record; no figures of a run that ends early."""

    scenarios: Mapping[str, Scenario]

    def __call__(self, job: Job) -> Figures:
        """Return the figures of one run."""
        return self.many([job])[0]

    def many(self, jobs: Sequence[Job]) -> list[Figures]:
        """Return the figures of runs made side by side."""
        from hil.runs.together import figures_together  # noqa: PLC0415 - the search needs no target

        found = figures_together([partial(self._opened, job) for job in jobs])
        return [{name: values[name] for name in KEPT} if values else {} for values in found]

    def _opened(self, job: Job) -> InMemory:
        scenario = with_gains(in_drawn_axes(self.scenarios[job.cell], job.cell), job.gains)
        return opened_without(scenario, job.outer, job.seed, job.without)


def with_gains(scenario: Scenario, gains: Gains | None) -> Scenario:
    """Return the scenario with `gains` as its tuned set in use; as it is for None."""
    if gains is None:
        return scenario
    sets = scenario.control.gains.model_copy(update={"tuned": gains})
    control = scenario.control.model_copy(update={"gains": sets, "gain_set": "tuned"})
    return scenario.model_copy(update={"control": control})


def scenarios_of(deck: Deck, cells: Sequence[Cell]) -> dict[str, Scenario]:
    """Return the scenario of each cell by the cell's name, and each task's calm one."""
    calm = [Cell(scenario=name, condition=CALM) for name in deck.scenarios]
    return {str(cell): deck.scenario_of(cell) for cell in (*cells, *calm)}


def task_of(cell: str) -> str:
    """Return the task of a cell's name."""
    return cell.partition(" in ")[0]


def condition_of(cell: str) -> str:
    """Return the condition of a cell's name."""
    return cell.partition(" in ")[2]


# Makes runs, side by side: figures in the order of the jobs.
Make = Callable[[Sequence[Job]], Sequence[Figures]]


@dataclass(frozen=True, slots=True)
class Yardstick:
    """What the yardstick gives on each task."""

    figures: Mapping[str, Figures] = field(default_factory=dict)

    @classmethod
    def measured(cls, tasks: Sequence[str], make: Make) -> Yardstick:
        """Run the yardstick on each task, calm; raises BadInput where it does not get through."""
        jobs = [
            Job(YARDSTICK_LAW, None, str(Cell(scenario=task, condition=CALM)), YARDSTICK_SEED)
            for task in tasks
        ]
        return cls.of(dict(zip(tasks, make(jobs), strict=True)))

    @classmethod
    def of(cls, found: Mapping[str, Figures]) -> Yardstick:
        """Return the yardstick of figures by task; raises BadInput where a task has none."""
        for task, figures in found.items():
            if not figures:
                raise BadInput(
                    f"task {task!r}: {YARDSTICK_LAW} with the gains that ship ends early in it, calm: "
                    "costs cannot be normalised by it; make the task easier"
                )
        return cls(found)

    def scores(self, cell: str, figures: Figures) -> Scores:
        """Return the scores of one run."""
        if not figures or not all(math.isfinite(figures[name]) for name in KEPT):
            return FAILED
        usual = self.figures[task_of(cell)]

        def over(name: str, least: float = 1e-9) -> float:
            return min(figures[name] / max(usual[name], least), MOST)

        accuracy = _IAE_SHARE * over(_IAE) + (1.0 - _IAE_SHARE) * over(_REST, LEAST_REST_M)
        return Scores(accuracy, sum(map(over, _CALM)) / len(_CALM), over(_EFFORT))


@dataclass(frozen=True, slots=True)
class ByTask:
    """Makes runs as another worker does and adds their cost, normalised by their task.

    `work` takes jobs with a `case.scenario` named TASK-in-CONDITION.
    """

    work: Callable[[Any], Figures]
    yardstick: Yardstick

    def __call__(self, trial: Any) -> Figures:
        """Return the figures of one run with its cost; none of a run that ends early."""
        return self._with_cost(trial, self.work(trial))

    def many(self, trials: Sequence[Any]) -> list[Figures]:
        """Return the same of runs that the worker makes side by side."""
        found = OfGroups(self.work)(trials)
        return [self._with_cost(*one) for one in zip(trials, found, strict=True)]

    def _with_cost(self, trial: Any, figures: Figures) -> Figures:
        if not figures:
            return figures
        task = trial.case.scenario.partition("-in-")[0]
        scores = self.yardstick.scores(f"{task} in it", figures)
        return {**figures, "cost": sum(a * b for a, b in zip(COST, scores, strict=True))}


def together(scores: Sequence[Scores]) -> Scores:
    """Return the scores of several runs as one."""
    accuracy, calm, effort = ([one[i] for one in scores] for i in range(3))  # one column a score
    count = len(scores)
    mean = sum(accuracy) / count
    return Scores(
        (1.0 - _WORST_SHARE) * mean + _WORST_SHARE * max(accuracy),
        sum(calm) / count,
        sum(effort) / count,
    )


def spread_over(cells: Sequence[Cell], count: int) -> list[Cell]:
    """Return `count` cells that take tasks and conditions as evenly as can be: diagonals of the table."""
    tasks = list(dict.fromkeys(cell.scenario for cell in cells))
    conditions = list(dict.fromkeys(cell.condition for cell in cells))
    known = {(cell.scenario, cell.condition): cell for cell in cells}
    found: dict[tuple[str, str], Cell] = {}
    longer = max(len(tasks), len(conditions))
    for shift in range(longer):
        for place in range(longer):
            key = (tasks[(place + shift) % len(tasks)], conditions[place % len(conditions)])
            if key in known and len(found) < count:
                found.setdefault(key, known[key])
    rest = [cell for key, cell in known.items() if key not in found]
    return [*found.values(), *rest[: max(count - len(found), 0)]]


def refuse_seen(judged: Sequence[Cell], seen: Sequence[Cell]) -> None:
    """Raise BadInput where a verdict would rest on a task or a condition that a search has seen."""
    tasks = {cell.scenario for cell in seen}
    conditions = {cell.condition for cell in seen}
    for cell in judged:
        known = [
            f"{what} {name!r}"
            for what, name, names in (
                ("task", cell.scenario, tasks),
                ("condition", cell.condition, conditions),
            )
            if name in names
        ]
        if known:
            raise BadInput(
                f"{cell}: the search has seen {' and '.join(known)}; a verdict is spoken on tasks and "
                "conditions that it has not: take it out of the deck's [search], or judge on others"
            )


def laws_in_the_field() -> list[str]:
    """Return every built-in outer law that declares what of it is searched."""
    return [law.name for law in OUTER_LAWS.entries() if law.search and law.origin == BUILT_IN]
