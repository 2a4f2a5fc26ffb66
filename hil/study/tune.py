"""The gain procedure: one search, one cost and one budget for every outer law (docs/control.md).

The caller says how runs are made (`evaluate`), so the procedure works on any target. Gains are
searched on a logarithmic scale by CMA-ES; every candidate of both laws sees the same cases and
the same seeds, and both laws get the same population and the same number of candidates. What was found
is judged elsewhere (`hil.study.tuning_verdict`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from hil.analysis.costs import USUAL, Cost, Figures
from hil.config.control import PointReference
from hil.config.events import Disturbance
from hil.config.load import load_robot, load_scenario
from hil.core.errors import BadInput
from hil.core.files import replace_file
from hil.core.registries import OUTER_LAWS
from hil.core.registry import Box
from hil.core.toml_text import toml_value
from hil.core.types import wrap_pi
from hil.study.directions import in_drawn_axes

if TYPE_CHECKING:
    from hil.config.gains import Gains
    from hil.config.robot import RobotConfig
    from hil.config.scenario import Scenario
    from hil.runs.execute import InMemory

# Figures of each run, in the order of the trials, named as in metrics.json; empty for a failed run.
Evaluate = Callable[[Sequence["Trial"]], Sequence[Figures]]
# (candidates done, best cost so far)
Progress = Callable[[int, float], None]


def boxes_of(laws: Sequence[str]) -> dict[str, Box]:
    """Return what is searched of each law, as the law declares it; raises BadInput for one without."""
    boxes = {}
    for law in laws:
        entry = OUTER_LAWS.get(law)
        keys = entry.settings.model_fields if entry.settings is not None else {}
        if not entry.search:
            raise BadInput(
                f"law {entry.name} ({entry.origin}): declares no search box, so there is nothing to "
                'tune; give search={"KEY": (least, start, largest)} where it is registered'
            )
        for key, box in entry.search.items():
            if key not in keys or not 0.0 < box[0] <= box[1] <= box[2] or box[0] == box[2]:
                raise BadInput(
                    f"law {entry.name} ({entry.origin}): search[{key!r}] = {tuple(box)}: needs a key of "
                    "its settings with 0 < least <= start <= largest"
                )
        boxes[entry.name] = entry.search
    return boxes


# The laws that are compared unless others are named, and what is searched of them.
SEARCH: dict[str, Box] = boxes_of(("asg-ism", "pid"))


# What pushes the robot in a pushed case: a tenth of the robot's weight along its
# way and a twist of the same order about the vertical, at rates inside the loop's bandwidth.
PUSHES = (
    Disturbance(target="force_forward_n", shape="sine", amplitude=3.0, frequency_hz=0.4),
    Disturbance(
        target="torque_yaw_n_m", shape="sine", amplitude=0.15, frequency_hz=0.3, phase_rad=1.0
    ),
)


# The robot that PUSHES are meant for.
PUSHED_ROBOT = "thesis-4wd"

# A late case: what a bad radio and a loaded host make of link and camera, so that gains keep a margin.
LATE_LINK = {"latency_s": 0.05, "latency_jitter_s": 0.03}
LATE_CAMERA = {"latency_s": 0.1, "latency_jitter_s": 0.03, "drop_ratio": 0.1}

# In a beside case the robot stands at right angles to the way to the point, where neither law can do
# anything about the error at first: z1 moves along the heading alone.
Variant = Literal["calm", "pushed", "late", "beside"]


@dataclass(frozen=True, slots=True)
class Case:
    """One run that every candidate makes: a scenario (by name), a variant of it, a wheel law."""

    scenario: str
    variant: Variant
    inner: str

    def __str__(self) -> str:
        return f"{self.scenario} {self.variant} over {self.inner}"


# Each variant twice, over either wheel law.
CASES = (
    Case("scenario-1", "calm", "asg-ism"),
    Case("scenario-1", "late", "pid"),
    Case("scenario-2", "pushed", "pid"),
    Case("scenario-2", "late", "asg-ism"),
    Case("scenario-3", "pushed", "asg-ism"),
    Case("scenario-3", "calm", "pid"),
    Case("scenario-1", "beside", "asg-ism"),
    Case("scenario-2", "beside", "pid"),
)


class Trial(NamedTuple):
    """One run of a candidate."""

    outer: str
    gains: Gains
    case: Case
    seed: int


@dataclass(frozen=True, slots=True)
class Plan:
    """What both laws are given alike."""

    cases: tuple[Case, ...] = CASES
    seeds: tuple[int, ...] = (1, 2)
    candidates: int = 301
    population: int = 10
    search_seed: int = 1
    cost: Cost = USUAL

    @property
    def trials(self) -> int:
        """Return the runs of one law: whole populations after the start."""
        tried = 1 + (self.candidates - 1) // self.population * self.population
        return tried * len(self.cases) * len(self.seeds)


@dataclass(frozen=True, slots=True)
class Found:
    """The best candidate of one law."""

    values: dict[str, float]
    cost: float
    start_cost: float
    candidates: int


def candidate_costs(
    outer: str, candidates: Sequence[Gains], evaluate: Evaluate, plan: Plan
) -> list[float]:
    """Return each candidate's mean cost over every case and seed of the plan."""
    trials = [
        Trial(outer, gains, case, seed)
        for gains in candidates
        for case in plan.cases
        for seed in plan.seeds
    ]
    costs = [plan.cost.of(figures) for figures in evaluate(trials)]
    each = len(plan.cases) * len(plan.seeds)
    return [sum(costs[i : i + each]) / each for i in range(0, len(costs), each)]


def decode(box: Box, point: Sequence[float]) -> dict[str, float]:
    """Return the gains at a point of the unit cube, to four digits (as the file will hold them)."""
    return {
        name: float(f"{low * (high / low) ** min(max(u, 0.0), 1.0):.4g}")
        for (name, (low, _, high)), u in zip(box.items(), point, strict=True)
    }


def with_values(base: Gains, outer: str, values: Mapping[str, float]) -> Gains:
    """Return `base` with the searched gains of one law replaced."""
    return base.with_values(OUTER_LAWS.get(outer), values)


def minimise(
    box: Box,
    costs_of: Callable[[Sequence[dict[str, float]]], Sequence[float]],
    *,
    candidates: int,
    population: int,
    seed: int,
    progress: Progress | None = None,
) -> Found:
    """Return the values of least cost among the candidates; deterministic by its seed.

    `costs_of` is given a whole population at a time, so that it may run them side by side.
    """
    import cma  # noqa: PLC0415 - slow import, needed by this function alone

    start = [math.log(middle / low) / math.log(high / low) for low, middle, high in box.values()]
    options = {"bounds": [0.0, 1.0], "popsize": population, "seed": seed, "verbose": -9}
    strategy = cma.CMAEvolutionStrategy(start, 0.15, options)
    values = decode(box, start)
    (start_cost,) = costs_of([values])
    best = (start_cost, values)
    done = 1
    while done + population <= candidates:
        points = strategy.ask()
        tried = [decode(box, point) for point in points]
        costs = costs_of(tried)
        best = min([best, *zip(costs, tried, strict=True)], key=lambda item: item[0])
        done += population
        if progress is not None:
            progress(done, best[0])
        strategy.tell(points, list(costs))
    return Found(best[1], best[0], start_cost, done)


def search(
    outer: str, base: Gains, evaluate: Evaluate, plan: Plan, progress: Progress | None = None
) -> Found:
    """Return the best gains of `outer` within the plan's budget; deterministic by its seeds."""
    return minimise(
        boxes_of([outer])[outer],
        lambda tried: candidate_costs(
            outer, [with_values(base, outer, values) for values in tried], evaluate, plan
        ),
        candidates=plan.candidates,
        population=plan.population,
        seed=plan.search_seed,
        progress=progress,
    )


def tune(
    base: Gains,
    evaluate: Evaluate,
    plan: Plan,
    *,
    target: str,
    revision: str,
    progress: Callable[[str, float], None] | None = None,
    more: Mapping[str, str] | None = None,
    laws: Sequence[str] = tuple(SEARCH),
) -> Gains:
    """Return the tuned gains of the laws with their origin; `base` holds what is not searched.

    `more` goes into the origin.

    `progress` is told the law and its best cost so far.
    """

    def searched(outer: str) -> Found:
        told = (lambda _done, best: progress(outer, best)) if progress else None
        return search(outer, base, evaluate, plan, told)

    found = {outer: searched(outer) for outer in laws}
    gains = with_origin(base, found, plan, target=target, revision=revision)
    return gains.model_copy(update={"origin": gains.origin | dict(more or {})})


def near_bounds(gains: Gains, laws: Sequence[str] = tuple(SEARCH)) -> list[str]:
    """Return what lies within 3 % of the way to an edge of its search box, where the box decided."""
    found = []
    for outer, box in boxes_of(laws).items():
        values = gains.of(OUTER_LAWS.get(outer)).model_dump()
        for name, (low, _, high) in box.items():
            if values[name] is None:
                continue  # not searched: that of the limits stands
            at = math.log(values[name] / low) / math.log(high / low)
            if not 0.03 < at < 0.97:
                found.append(f"{outer} {name} = {values[name]:g} (searched {low:g} to {high:g})")
    return found


def with_origin(
    base: Gains, found: Mapping[str, Found], plan: Plan, *, target: str, revision: str
) -> Gains:
    """Return `base` with what was found for each law, and where it comes from."""
    gains = base
    origin: dict[str, Any] = {
        "procedure": "hil.study.tune: CMA-ES on log gains, see docs/control.md",
        "target": target,
        "revision": revision,
        "cases": ", ".join(map(str, plan.cases)),
        "seeds": ", ".join(map(str, plan.seeds)),
        "population": plan.population,
        "search_seed": plan.search_seed,
        "cost": plan.cost.told(),
    }
    for outer, result in found.items():
        gains = with_values(gains, outer, result.values)
        origin[f"candidates_{outer}"] = result.candidates
        origin[f"cost_{outer}"] = round(result.cost, 4)
        origin[f"start_cost_{outer}"] = round(result.start_cost, 4)
    return gains.model_copy(update={"origin": origin})


def write_gain_set(path: Path, gains: Gains) -> None:
    """Write a gain file as hil/data/gains holds them; it names its schema where that lies beside."""
    beside = path.absolute().parents[1] / "schemas" / "gains.json"
    lines = ["#:schema ../schemas/gains.json"] if beside.is_file() else []
    lines += [
        "# Written by hil.study.tune. In a scenario the table [LAW] of it is [control.gains.tuned.LAW]."
    ]
    for table, values in gains.model_dump().items():
        lines += ["", f"[{table}]"]
        lines += [f"{k} = {toml_value(value)}" for k, value in values.items() if value is not None]
    replace_file(path, ("\n".join(lines) + "\n").encode())


def case_scenario(case: Case, gains: Gains, task: Scenario | None = None) -> Scenario:
    """Return the scenario of a case with `gains` as its tuned set.

    `task` is what the case names, the built-in scenario when it is not given.
    """
    scenario = task or _shipped(case.scenario)
    sets = scenario.control.gains.model_copy(update={"tuned": gains})
    control = scenario.control.model_copy(update={"gains": sets, "gain_set": "tuned"})
    changed: dict[str, object] = {"control": control}
    if case.variant == "pushed":
        changed["disturbances"] = _pushes(scenario.robot)
    elif case.variant == "late":
        changed["link"] = scenario.link.model_copy(update=LATE_LINK)
        changed["camera"] = scenario.camera.model_copy(update=LATE_CAMERA)
    elif case.variant == "beside":
        changed["start"] = scenario.start.model_copy(update={"theta_rad": _beside(scenario)})
    return scenario.model_copy(update=changed)


@cache
def _shipped(name: str) -> Scenario:
    """Return a built-in scenario: a search asks for it in each of its runs."""
    return load_scenario(name)


@cache
def _pushed_robot() -> RobotConfig:
    return load_robot(PUSHED_ROBOT)


def _pushes(robot: RobotConfig) -> tuple[Disturbance, ...]:
    """Return PUSHES for a robot of another size: force by its weight, twist by weight and track."""
    usual = _pushed_robot()
    weight = robot.mass_kg / usual.mass_kg
    ratios = (weight, weight * robot.track_m / usual.track_m)
    return tuple(
        push.model_copy(update={"amplitude": push.amplitude * ratio})
        for push, ratio in zip(PUSHES, ratios, strict=True)
    )


def _beside(scenario: Scenario) -> float:
    """Return the heading that has the point at right angles, on the side where it is anyway."""
    start, goal = scenario.start, scenario.reference
    if not isinstance(goal, PointReference):
        raise ValueError(f"{scenario.name}: a beside case needs a point")
    bearing_rad = math.atan2(goal.y_m - start.y_m, goal.x_m - start.x_m)
    to_left_rad = wrap_pi(bearing_rad - start.theta_rad)
    return wrap_pi(bearing_rad - math.copysign(0.5 * math.pi, to_left_rad))


@dataclass(frozen=True, slots=True)
class OnTarget:
    """Makes one run of a trial on a target; a run that ends early has no figures.

    `tasks` has the scenarios that cases name, where they are not built in.
    """

    target: str
    camera: str
    tasks: Mapping[str, Scenario] = field(default_factory=dict)

    def __call__(self, trial: Trial) -> Figures:
        """Return the figures of one run, which leaves no record behind."""
        return self.many([trial])[0]

    def many(self, trials: Sequence[Trial]) -> list[Figures]:
        """Return the figures of runs made side by side."""
        from hil.runs.together import figures_together  # noqa: PLC0415 - the search needs no target

        makers = [partial(self._opened, trial) for trial in trials]
        return [values or {} for values in figures_together(makers)]

    def _opened(self, trial: Trial) -> InMemory:
        from hil.runs.execute import InMemory, RunSpec  # noqa: PLC0415

        spec = RunSpec(
            scenario=in_drawn_axes(
                case_scenario(trial.case, trial.gains, self.tasks.get(trial.case.scenario)),
                f"{trial.case}, seed {trial.seed}",
            ),
            target=self.target,
            camera=self.camera,
            outer=trial.outer,
            inner=trial.case.inner,
            seed=trial.seed,
            out=Path(),
            command="hil tune",
        )
        return InMemory(spec)
