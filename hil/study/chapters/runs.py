"""Runs of the rows of a study: compiled, a few tenths of a second each, side by side in threads."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.study.chapters import _plants
from hil.study.chapters.deck import Row, StudyDeck, spread
from hil.study.chapters.laws import OwnLaw, make_laws
from hil.study.chapters.quantities import COLUMNS, FIGURES, check_values

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

Progress = Callable[[int, int], None]
_PLANTS: Mapping[str, Callable[[], Any]] = {
    "quadrotor": _plants.Quadrotor,
    "vehicle5": _plants.Vehicle5,
    "vehicle6": _plants.Vehicle6,
}
_LATE = {"worst_m", "cost_m", "ise_late_m2_s", "tilt_rad", "rate_error_m_s"}
_MEANS = {"ise_m2_s", "ise_late_m2_s", "effort", "effort_early"}


@dataclass(frozen=True, slots=True)
class RowResult:
    """One row: how it ended, its figures (None where the run ended before they exist)."""

    name: str
    kind: str
    label: str
    law: str
    end: str
    end_s: float
    figures: Mapping[str, float | None]
    s_max: tuple[float, float, float] = (0.0, 0.0, 0.0)
    limits: Mapping[str, float] = field(default_factory=dict)
    samples: Mapping[str, Array] = field(default_factory=dict)

    @property
    def holds(self) -> bool | None:
        """Say whether the row ran to its end within its limits; None without limits."""
        if not self.limits:
            return None
        values = [(self.figures[name], limit) for name, limit in self.limits.items()]
        return self.end == "complete" and all(v is not None and v <= limit for v, limit in values)

    @property
    def as_wanted(self) -> bool:
        """Say whether the row holds, or fails where it is a negative control."""
        return self.holds is None or self.holds is (self.kind != "negative control")

    def to_json(self) -> dict[str, Any]:
        """Return the row for JSON and CSV."""
        return {
            "row": self.name,
            "kind": self.kind,
            "label": self.label,
            "law": self.law,
            "end": self.end,
            "end_s": self.end_s,
            **self.figures,
            "limits": dict(self.limits),
            "holds": self.holds,
        }


@dataclass(frozen=True, slots=True)
class Job:
    """One row with its choice, ready to run."""

    deck: StudyDeck
    row: Row
    name: str
    values: Mapping[str, float]


def jobs_of(deck: StudyDeck, only: Sequence[str] | None = None) -> list[Job]:
    """Return the jobs of a study, or those of the rows named."""
    found = []
    for row in deck.rows:
        for name, choice in spread(row):
            if only is None or name in only:
                found.append(job(deck, row, name, choice))
    return found


def job(deck: StudyDeck, row: Row, name: str, choice: str | None) -> Job:
    """Return one job: parameters of the study, then those of the choice, then the row's own."""
    values = {key: parameter.value for key, parameter in deck.parameters.items()}
    values |= deck.choices[choice] if choice else {}
    values |= row.set
    check_values(values, f"row {name}")
    return Job(deck, row, name, values)


def draws(plant: str, values: Mapping[str, float], seed: int) -> list[float]:
    """Return the random numbers of one run: disturbances (quadrotor), measurement noise."""
    rng = np.random.RandomState(seed)  # whose stream is fixed for ever
    numbers = np.empty(0)
    if plant == "quadrotor":
        count = math.ceil(values["duration_s"] / values["hold_s"]) + 1
        numbers = 2.0 * rng.random_sample(count * 6) - 1.0
    elif plant == "vehicle6" and values["noise_m"] > 0.0:
        numbers = rng.standard_normal(int(values["duration_s"] / values["step_s"]) * 3)
    return [float(number) for number in numbers]


def simulate(work: Job, seed: int, own: OwnLaw | None = None) -> Any:
    """Run a job with one seed and return its outcome; raises BadInput for a law that fails."""
    deck = work.deck
    plant = _PLANTS[deck.plant]()
    for key, value in work.values.items():
        setattr(plant, key, value)
    use_own = own is not None and work.row.kind == "own law"
    laws = own.make(deck.plant) if own is not None and use_own else make_laws(deck, work.row)
    random = draws(deck.plant, work.values, seed)
    try:
        if deck.plant == "quadrotor":
            position, attitude = laws
            return _plants.fly(plant, position, attitude, random)
        if deck.plant == "vehicle5":
            position, sideways, drive = laws
            return _plants.dive(plant, position, sideways, drive)
        return _plants.swim(plant, laws[0], random)
    except Exception as error:
        if own is None or not use_own:
            raise
        raise own.failed(error) from None


def run_job(work: Job, own: OwnLaw | None = None, seeds: Sequence[int] | None = None) -> RowResult:
    """Run a job with every seed: integrals are means, peaks the largest, samples of the first.

    A chaotic row is run from several starts 1e-12 m apart, and all its figures are means.
    """
    starts = [
        Job(work.deck, work.row, work.name, {**work.values, "start_x_m": x_m})
        for x_m in (work.values["start_x_m"] + 1e-12 * k for k in range(work.row.nearby_starts))
    ]
    outcomes = [simulate(one, seed, own) for one in starts for seed in seeds or work.deck.seeds]
    early = next((out for out in outcomes if out.end != "complete"), None)
    settled = all(out.end_s > work.values["settle_s"] for out in outcomes)
    figures: dict[str, float | None] = {}
    for name, (attribute, _) in FIGURES.items():
        values = [float(getattr(out, attribute)) for out in outcomes]
        mean = name in _MEANS or len(starts) > 1
        value = sum(values) / len(values) if mean else max(values)
        figures[name] = value if math.isfinite(value) and (settled or name not in _LATE) else None
    s_max = [max(out.s_max[i] for out in outcomes) for i in range(3)]
    return RowResult(
        name=work.name,
        kind=work.row.kind,
        label=work.row.label,
        law=work.row.law,
        end=early.end if early else "complete",
        end_s=min(out.end_s for out in outcomes),
        figures=figures,
        s_max=(s_max[0], s_max[1], s_max[2]),
        limits=_limits(work),
        samples=_columns(work.deck.plant, outcomes[0].samples),
    )


def _limits(work: Job) -> dict[str, float]:
    row = work.row
    for other in work.deck.rows:
        if row.control_of in {name for name, _ in spread(other)}:
            row = other
    limits = {"worst_m": row.limit_m, "integral_cost_m_s": row.limit_integral_m_s}
    return {name: limit for name, limit in limits.items() if limit is not None}


def _columns(plant: str, samples: Array) -> dict[str, Array]:
    names = COLUMNS[plant]
    table = samples.reshape(-1, len(names))
    return {name: table[:, index] for index, name in enumerate(names)}


def run_jobs(
    jobs: Sequence[Job], own: OwnLaw | None = None, progress: Progress | None = None
) -> list[RowResult]:
    """Run jobs in threads (the compiled loops let go of the interpreter), in their order."""
    done = 0
    results = []
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        futures = [pool.submit(run_job, work, own) for work in jobs]
        try:
            for future in futures:
                results.append(future.result())
                done += 1
                if progress is not None:
                    progress(done, len(jobs))
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise
    return results
