"""The search for a counterexample by CMA-ES, and its reduction to what it needs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hil.study.falsify.box import Box
from hil.study.falsify.margin import FURTHEST, Outcome

Point = tuple[float, ...]
# Outcomes of a law in each point, run side by side.
Run = Callable[[Sequence[Point]], Sequence["Trial"]]
POPULATION = 10
_STEP = 0.3
_HALVINGS = 6


@dataclass(frozen=True, slots=True)
class Trial:
    """A point, the law's outcome there, and the outcome of the law it is set against."""

    point: Point
    outcome: Outcome
    against: Outcome | None = None

    @property
    def refused(self) -> bool:
        """Say whether the run says nothing about a law."""
        return self.outcome.refused or (self.against is not None and self.against.refused)

    @property
    def objective(self) -> float:
        """Return what the search makes small."""
        if self.refused:
            return 2.0 * FURTHEST
        if self.against is None:
            return self.outcome.margin
        return self.outcome.margin - self.against.margin

    @property
    def counts(self) -> bool:
        """Say whether it is a counterexample: a requirement fails, and against another law only here."""
        if self.refused or self.outcome.margin >= 0.0:
            return False
        return self.against is None or self.against.margin >= 0.0


@dataclass(frozen=True, slots=True)
class Found:
    """What a search found: the scenario as it stands, the worst run, and the reduced one if it counts."""

    usual: Trial
    worst: Trial
    reduced: Trial | None
    runs: int
    refused: int


def falsify(box: Box, run: Run, *, runs: int, seed: int) -> Found:
    """Return the worst trial of a search of about `runs` points, reduced; deterministic by its seed.

    Stops as soon as a population has a counterexample whose margin no longer falls.
    """
    import cma  # noqa: PLC0415 - slow import, needed by this function alone

    (usual,) = run([box.usual])
    tried = [usual]
    start = [min(max(share, 0.0), 1.0) for share in box.usual]
    options = {"bounds": [0.0, 1.0], "popsize": POPULATION, "seed": seed, "verbose": -9}
    strategy = cma.CMAEvolutionStrategy(start, _STEP, options)
    while len(tried) + POPULATION <= runs and not usual.counts:
        points = strategy.ask()
        trials = run([tuple(float(x) for x in point) for point in points])
        strategy.tell(points, [trial.objective for trial in trials])
        tried += trials
    counting = [trial for trial in tried if trial.counts]
    worst = min(counting or tried, key=lambda trial: trial.objective)
    spent = len(tried)
    reduced = None
    if counting:
        reduced, more = reduce(box, worst, run)
        spent += more
    return Found(usual, worst, reduced, spent, sum(trial.refused for trial in tried))


def reduce(box: Box, worst: Trial, run: Run) -> tuple[Trial, int]:
    """Return a counterexample with the fewest and smallest departures found, and the runs it took.

    Departures are taken back one at a time as long as what is left still counts; then each that
    is left is halved towards the usual value as far as that holds.
    """
    spent = 0
    kept = worst
    again = True
    while again:
        again = False
        for axis in _by_size(box, kept.point):
            trial = run([_with(kept.point, axis, box.usual[axis])])[0]
            spent += 1
            if trial.counts:
                kept, again = trial, True
    for axis in _by_size(box, kept.point):
        near, far = box.usual[axis], kept.point[axis]
        for _ in range(_HALVINGS):
            middle = 0.5 * (near + far)
            trial = run([_with(kept.point, axis, middle)])[0]
            spent += 1
            if trial.counts:
                kept, far = trial, middle
            else:
                near = middle
    return kept, spent


def _by_size(box: Box, point: Point) -> list[int]:
    """Return the axes that depart from the usual, the smallest departure first."""
    away = [
        (abs(share - usual), i)
        for i, (share, usual) in enumerate(zip(point, box.usual, strict=True))
    ]
    return [i for size, i in sorted(away) if size > 0.0]


def _with(point: Point, axis: int, share: float) -> Point:
    return (*point[:axis], share, *point[axis + 1 :])
