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
CONDITIONS = ((0.25, 70.0), (0.5, 70.0), (1.0, 70.0), (0.5, 200.0))
"""Amplitude of the disturbance and horizon in s."""
_PAIR = ("Q4 circle", "Q6 circle")


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """One row with one assumed value changed, beside the row as it stands (same seed)."""

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
    """Run every change with the first seed."""
    one = deck.model_copy(update={"seeds": deck.seeds[:1]})
    base = {row.name: row for row in run_jobs(jobs_of(one, one.sensitivity_rows))}
    tried = changes(one)
    results = run_jobs([job for _, _, job in tried], progress=progress)
    return [
        Sensitivity(
            name, one.parameters[name].unit, one.parameters[name].value, value, base[row.name], row
        )
        for (name, value, _), row in zip(tried, results, strict=True)
    ]


@dataclass(frozen=True, slots=True)
class StartMap:
    """Integral of the squared error of PD over that of ISM, a row a distance, a column a condition."""

    distances_m: tuple[float, ...]
    conditions: tuple[tuple[float, float], ...]
    ratios: tuple[tuple[float | None, ...], ...]

    def to_json(self) -> dict[str, Any]:
        """Return the map for JSON."""
        return {
            "ratio": "integral of |error|^2, Q4 (PD) over Q6 (ISM)",
            "start_distance_m": list(self.distances_m),
            "conditions": [
                {"disturbance_m_s2": size, "duration_s": duration}
                for size, duration in self.conditions
            ],
            "ratios": [list(row) for row in self.ratios],
        }


def start_map(deck: StudyDeck, progress: Progress | None = None) -> StartMap:
    """Return the map for the quadrotor (first seed)."""
    one = deck.model_copy(update={"seeds": deck.seeds[:1]})
    pair = jobs_of(one, _PAIR)
    radius, rate = (one.parameters[name].value for name in ("radius_m", "rate_rad_s"))
    jobs = []
    for distance in START_DISTANCES_M:
        share = 1.0 - distance / radius
        for size, duration in CONDITIONS:
            start = {"start_x_m": radius * share, "start_vy_m_s": radius * rate * share}
            case = {**start, "disturbance": size, "duration_s": duration}
            jobs += [Job(one, work.row, work.name, {**work.values, **case}) for work in pair]
    rows = iter(run_jobs(jobs, progress=progress))
    ratios = tuple(
        tuple(_ratio(next(rows), next(rows)) for _ in CONDITIONS) for _ in START_DISTANCES_M
    )
    return StartMap(START_DISTANCES_M, CONDITIONS, ratios)


def _ratio(pd: RowResult, ism: RowResult) -> float | None:
    above, below = pd.figures["ise_m2_s"], ism.figures["ise_m2_s"]
    complete = pd.end == ism.end == "complete"
    return above / below if complete and above is not None and below else None
