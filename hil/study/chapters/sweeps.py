"""Sweeps: what each assumed value is worth, and from where "three times smaller" holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from hil.study.chapters.deck import StudyDeck
from hil.study.chapters.quantities import check_values
from hil.study.chapters.runs import Job, Progress, RowResult, jobs_of, run_jobs

START_DISTANCES_M = (0.0, 0.1, 0.3, 1.0, 2.0)
"""From the circle inwards along x, at the same share of its speed: 2 m is the origin at rest."""
DISTURBANCES = (0.25, 0.5, 1.0)
"""Amplitudes of the disturbance in m/s^2 and rad/s^2."""
_PAIR = ("Q4 circle", "Q6 circle")


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """One row with one assumed value changed, beside the row as it stands (same seeds)."""

    parameter: str
    unit: str
    base: float
    value: float
    before: RowResult
    after: RowResult

    def to_json(self) -> dict[str, Any]:
        """Return the change for JSON and CSV."""
        figures = ("ise_m2_s", "worst_m")
        return {
            "row": self.before.name,
            "parameter": self.parameter,
            "unit": self.unit,
            "assumed": self.base,
            "tried": self.value,
            "end": self.after.end,
            **{f"{name}_assumed": self.before.figures[name] for name in figures},
            **{f"{name}_tried": self.after.figures[name] for name in figures},
        }


def changes(deck: StudyDeck, rows: Sequence[str] | None = None) -> list[tuple[str, float, Job]]:
    """Return (parameter, value, job) for every value that the study says to try."""
    found = []
    for work in jobs_of(deck, rows or deck.sensitivity_rows):
        fixed = set(work.row.set)
        for name, parameter in deck.parameters.items():
            values = () if name in fixed else parameter.sweep
            for value in values:
                # A start that the row's choice sets is moved by as much as the study's own.
                tried = (
                    value + work.values[name] - parameter.value
                    if name.startswith("start_")
                    else value
                )
                job = Job(deck, work.row, work.name, {**work.values, name: tried})
                check_values(job.values, f"row {work.name}: sweep of {name}")
                found.append((name, value, job))
    return found


def sensitivity(deck: StudyDeck, progress: Progress | None = None) -> list[Sensitivity]:
    """Run every change with the seeds of the study."""
    base = {row.name: row for row in run_jobs(jobs_of(deck, deck.sensitivity_rows))}
    tried = changes(deck)
    results = run_jobs([job for _, _, job in tried], progress=progress)
    return [
        Sensitivity(
            name,
            deck.parameters[name].unit,
            deck.parameters[name].value,
            value,
            base[row.name],
            row,
        )
        for (name, value, _), row in zip(tried, results, strict=True)
    ]


@dataclass(frozen=True, slots=True)
class StartMap:
    """Integral of the squared error of PD over that of ISM: a row a distance, a column a disturbance."""

    distances_m: tuple[float, ...]
    disturbances: tuple[float, ...]
    ratios: tuple[tuple[float | None, ...], ...]

    def to_json(self) -> dict[str, Any]:
        """Return the map for JSON."""
        return {
            "ratio": "integral of |error|^2, Q4 (PD) over Q6 (ISM)",
            "start_distance_m": list(self.distances_m),
            "disturbance_m_s2": list(self.disturbances),
            "ratios": [list(row) for row in self.ratios],
        }


def start_map(deck: StudyDeck, progress: Progress | None = None) -> StartMap:
    """Return the map for the quadrotor, from means over the seeds."""
    pair = jobs_of(deck, _PAIR)
    radius, rate = (deck.parameters[name].value for name in ("radius_m", "rate_rad_s"))
    jobs = []
    for distance in START_DISTANCES_M:
        share = 1.0 - distance / radius
        for size in DISTURBANCES:
            start = {"start_x_m": radius * share, "start_vy_m_s": radius * rate * share}
            case = {**start, "disturbance": size}
            jobs += [Job(deck, work.row, work.name, {**work.values, **case}) for work in pair]
    rows = iter(run_jobs(jobs, progress=progress))
    ratios = tuple(
        tuple(_ratio(next(rows), next(rows)) for _ in DISTURBANCES) for _ in START_DISTANCES_M
    )
    return StartMap(START_DISTANCES_M, DISTURBANCES, ratios)


def _ratio(pd: RowResult, ism: RowResult) -> float | None:
    above, below = pd.figures["ise_m2_s"], ism.figures["ise_m2_s"]
    complete = pd.end == ism.end == "complete"
    return above / below if complete and above is not None and below else None
