"""The figures of a run, computed from its recorded columns alone, and the verdict on them.

Each figure is declared once in METRICS with its unit and with what is better. Errors and the path
are taken from the truth where the record has it, else from the estimate, and `basis` says which.
Commands are held between ticks, so their integrals are step sums; errors are integrated by the
trapezoidal rule. A figure that does not exist for a run (no sliding variable under PID, never
settled, fewer than two ticks) is NaN, null in JSON, and does not satisfy a requirement.

A long run's columns are gone through in pieces (`hil.analysis.pieces`): the memory that takes does not
grow with the run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from hil.analysis import sliding
from hil.analysis.column_sums import (
    ends,
    held_integral,
    mean_while_ran,
    percentiles_of,
    sign_changes,
    total,
    variation,
)
from hil.analysis.pieces import pieces, row_count
from hil.analysis.sliding import LawFacts
from hil.core.errors import BadInput
from hil.core.figures import BY_NAME, METRICS, Metric, metric_of
from hil.core.registries import FIGURES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Columns = Mapping[str, Array]

Basis = Literal["truth", "estimate"]
LAST_S = 1.0  # "over the last second"
_BANDS = {"settling_50mm_s": 0.050, "settling_20mm_s": 0.020}  # m


@dataclass(frozen=True, slots=True)
class LinkStats:
    """Counters of the host's end of the link, over the whole run."""

    frames_sent: int = 0
    frames_received: int = 0
    frames_lost: int = 0
    bytes_rejected: int = 0

    @property
    def loss_ratio(self) -> float:
        """Return lost / (lost + received); NaN when nothing was received or lost."""
        total = self.frames_received + self.frames_lost
        return self.frames_lost / total if total else math.nan


@dataclass(frozen=True, slots=True)
class Figures:
    """Values by metric name, and whether they rest on "truth" or on the "estimate".

    `own` declares those beside METRICS that the run's scenario asked for.
    """

    basis: Basis
    values: dict[str, float]
    own: tuple[Metric, ...] = ()

    @property
    def metrics(self) -> tuple[Metric, ...]:
        """Return what each value is, the built-in ones first."""
        return (*METRICS, *self.own)

    def metric(self, name: str) -> Metric | None:
        """Return what a value is, None where this run has no figure of the name."""
        return BY_NAME.get(name) or next((own for own in self.own if own.name == name), None)

    def with_own(self, own: Sequence[Metric], values: Mapping[str, float]) -> Figures:
        """Return the figures with others beside them; one without a value is NaN."""
        found = {metric.name: values.get(metric.name, math.nan) for metric in own}
        return Figures(self.basis, self.values | found, tuple(own))

    def to_json(self) -> dict[str, Any]:
        """Return the content of metrics.json: value and unit by name, NaN as null."""
        figures = {
            metric.name: {"value": _finite(self.values[metric.name]), "unit": metric.unit}
            for metric in self.metrics
        }
        return {"basis": self.basis, "figures": figures}


def all_metrics(runs: Iterable[Figures]) -> tuple[Metric, ...]:
    """Return what the values of several runs are, each once, the built-in ones first."""
    own = {metric.name: metric for run in runs for metric in run.own}
    return (*METRICS, *own.values())


@dataclass(frozen=True, slots=True)
class Verdict:
    """One requirement and how the run met it; a NaN value never holds."""

    name: str
    value: float
    unit: str
    minimum: float | None
    maximum: float | None
    holds: bool

    def to_json(self) -> dict[str, Any]:
        """Return the verdict for metrics.json, NaN as null."""
        return {
            "metric": self.name,
            "value": _finite(self.value),
            "unit": self.unit,
            "min": self.minimum,
            "max": self.maximum,
            "holds": self.holds,
        }

    def text(self) -> str:
        """Return the requirement in words, for example "delta1_final_m <= 0.02 m"."""
        low = f"{self.minimum:g} <= " if self.minimum is not None else ""
        high = f" <= {self.maximum:g}" if self.maximum is not None else ""
        return f"{low}{self.name}{high} {self.unit}".strip()


def compute(
    columns: Columns, link: LinkStats | None = None, law: LawFacts | None = None
) -> Figures:
    """Return every figure of a run from its samples; raises BadInput below two rows.

    `law` is what the figures of the sliding term need to know of the law beside its columns.
    """
    rows = row_count(columns)
    if rows < 2:
        raise BadInput(f"run record: {rows} rows of samples, the figures need at least 2")
    true_error = has_truth(columns)
    who, names = "true" if true_error else "est", _names_of_error(true=true_error)
    span_s, columns = ends(columns, "t_s"), sliding.with_ran(columns)
    with np.errstate(over="ignore", invalid="ignore"):  # of a damaged record: they are inf or NaN
        values = (
            _error_figures(columns, names, span_s)
            | _motion_figures(columns, who, names[0], span_s)
            | _effort_figures(columns)
            | _sliding_figures(columns, span_s[0])
            | sliding.figures(columns, who, law or LawFacts())
            | _timing_figures(columns, link or LinkStats())
        )
    return Figures("truth" if true_error else "estimate", values)


@dataclass(frozen=True, slots=True)
class RunData:
    """What a figure of merit is computed from: a whole run.

    `columns` are those of samples.parquet by name, one float64 value a tick, NaN where there is none, in
    the units that the names say (docs/run-record.md); they cannot be written to. `scenario` is the
    resolved scenario as a tree, `figures` are the built-in figures by name, `link` the counters of the
    link.
    """

    columns: Columns
    scenario: Mapping[str, Any]
    figures: Mapping[str, float]
    basis: Basis
    link: LinkStats
    law: LawFacts

    @property
    def t_s(self) -> Array:
        """Return the time of each tick, s, from 0."""
        return self.columns["t_s"]

    @property
    def error_m(self) -> Array:
        """Return |delta1| = |z1 - z1*| at each tick, m, from the truth where there is one."""
        return np.asarray(np.hypot(*error_components(self.columns)))

    def of_robot(self, name: str) -> Array:
        """Return `true_NAME` where the truth is known, else `est_NAME`: x_m, y_m, theta_rad, ..."""
        return self.columns[f"{'true' if self.basis == 'truth' else 'est'}_{name}"]


def _built_in(name: str) -> Callable[[RunData], float]:
    """Return a built-in figure as a function, as one from a file is."""

    def give(run: RunData) -> float:
        return compute(run.columns, run.link, run.law).values[name]

    return give


for _metric in METRICS:
    FIGURES.register(_metric.name, summary=_metric.definition, label=_metric.label, metric=_metric)(
        _built_in(_metric.name)
    )


def no_figures(columns: Columns) -> Figures:
    """Return the figures of a run that ended before its second tick: there is none."""
    return Figures("truth" if has_truth(columns) else "estimate", dict.fromkeys(BY_NAME, math.nan))


def has_truth(columns: Columns) -> bool:
    """Say whether the record knows the true state of the robot."""
    name = "true_delta1_x_m"
    known = [np.isfinite(piece[name]) for piece in pieces(columns, [name])]
    return bool(sum(part.size for part in known) and all(part.all() for part in known))


def error_names(columns: Columns) -> tuple[str, str]:
    """Return the names of delta1's columns, world X and Y: those of the truth where there is one."""
    return _names_of_error(true=has_truth(columns))


def _names_of_error(*, true: bool) -> tuple[str, str]:
    prefix = "true_delta1" if true else "delta1"
    return f"{prefix}_x_m", f"{prefix}_y_m"


def error_components(columns: Columns) -> tuple[Array, Array]:
    """Return delta1 in m, world X and Y, from the truth where there is one."""
    x_name, y_name = error_names(columns)
    return columns[x_name], columns[y_name]


class _Settling:
    """From when on the error stays within a band; each piece begins with the row before it."""

    def __init__(self, band_m: float, start_s: float) -> None:
        self._band_m = band_m
        self._start_s = start_s
        self._since_s = start_s

    def take(self, t_s: Array, error_m: Array) -> None:
        outside = np.flatnonzero(~(error_m <= self._band_m))
        if outside.size:
            first = int(outside[-1]) + 1
            self._since_s = float(t_s[first]) if first < t_s.size else math.nan

    @property
    def time_s(self) -> float:
        """NaN when it does not stay."""
        return self._since_s - self._start_s


def _error_figures(
    columns: Columns, names: tuple[str, str], span_s: tuple[float, float]
) -> dict[str, float]:
    start_s, end_s = span_s
    bands = {name: _Settling(band, start_s) for name, band in _BANDS.items()}
    ise, iae, itae, worst, final = [], [], [], [], math.nan
    for piece in pieces(columns, ["t_s", *names], before=1):
        t_s, error_m = piece["t_s"], np.hypot(*(piece[name] for name in names))
        ise.append(float(np.trapezoid(error_m**2, t_s)))
        iae.append(float(np.trapezoid(error_m, t_s)))
        itae.append(float(np.trapezoid((t_s - start_s) * error_m, t_s)))
        last = error_m[t_s >= end_s - LAST_S]
        worst += [last.max()] if last.size else []
        final = float(error_m[-1])
        for band in bands.values():
            band.take(t_s, error_m)
    return {
        "delta1_final_m": final,
        "delta1_worst_last_second_m": float(np.max(worst)),
        "ise_m2_s": total(ise),
        "iae_m_s": total(iae),
        "itae_m_s2": total(itae),
    } | {name: band.time_s for name, band in bands.items()}


def _motion_figures(
    columns: Columns, who: str, error_x_name: str, span_s: tuple[float, float]
) -> dict[str, float]:
    x_name, y_name = f"{who}_x_m", f"{who}_y_m"
    way_m = [
        np.hypot(np.diff(piece[x_name]), np.diff(piece[y_name])).sum()
        for piece in pieces(columns, [x_name, y_name], before=1)
    ]
    first_rad, last_rad = ends(columns, f"{who}_theta_rad")
    start_s, end_s = span_s
    return {
        "path_length_m": total(way_m),
        "start_offset_x_m": ends(columns, error_x_name)[0],
        "turn_rad": last_rad - first_rad,
        "duration_s": end_s - start_s,
    }


def _effort_figures(columns: Columns) -> dict[str, float]:
    left, right = "pwm_left_counts", "pwm_right_counts"
    return {
        "control_energy_m2_s3": _control_energy(columns),
        "pwm_energy_counts2_s": held_integral(columns, left, right),
        "eta1_variation_m_s": variation(columns, "eta1_cmd_m_s"),
        "theta_dot_variation_rad_s": variation(columns, "theta_dot_cmd_rad_s"),
        "pwm_variation_counts": variation(columns, left) + variation(columns, right),
        "saturated_share": mean_while_ran(columns, "saturated"),
    }


def _sliding_figures(columns: Columns, start_s: float) -> dict[str, float]:
    changes = sign_changes(columns, "s_x_m_s2") + sign_changes(columns, "s_y_m_s2")
    ran_s, known, reached_s = [], False, math.nan
    for piece in pieces(columns, ["t_s", "in_layer", *sliding.of_ran(columns)], before=1):
        t_s, inside = piece["t_s"], piece["in_layer"]
        ran_s.append(np.diff(t_s)[sliding.law_ran(piece)[:-1]].sum())
        known = known or bool(np.isfinite(inside).any())
        reached = np.flatnonzero(inside == 1.0)
        if reached.size and math.isnan(reached_s):
            reached_s = float(t_s[reached[0]] - start_s)
    in_all_s = total(ran_s)
    return {
        "s_sign_changes_hz": changes / in_all_s if known and in_all_s > 0.0 else math.nan,
        "in_layer_share": mean_while_ran(columns, "in_layer"),
        "reaching_s": reached_s,
    }


def _timing_figures(columns: Columns, link: LinkStats) -> dict[str, float]:
    rtt_s = percentiles_of(columns, "rtt_s")
    to_actuation_s = percentiles_of(columns, "exposure_to_actuation_s")
    misses = [np.nansum(p["deadline_miss"]) for p in pieces(columns, ["deadline_miss"])]
    return {
        "link_loss_ratio": link.loss_ratio,
        "rtt_median_s": rtt_s[0],
        "rtt_p99_s": rtt_s[1],
        "exposure_to_actuation_median_s": to_actuation_s[0],
        "exposure_to_actuation_p99_s": to_actuation_s[1],
        "deadline_misses": total(misses),
    }


def _control_energy(columns: Columns) -> float:
    """Integrate |u|²; NaN for a law that ran and never gave its u, whatever the control stop gave."""
    ran, told = False, False
    for piece in pieces(columns, sliding.of_ran(columns)):
        mine = sliding.law_ran(piece)
        ran = ran or bool(mine.any())
        told = told or bool(np.isfinite(piece["zeta_m_s2"][mine] + piece["u2_m_s2"][mine]).any())
    if ran and not told:
        return math.nan
    return held_integral(columns, "zeta_m_s2", "u2_m_s2")


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def check(figures: Figures, scenario: Mapping[str, Any]) -> tuple[Verdict, ...]:
    """Return the verdict on each requirement of a resolved scenario tree.

    `requirements` name a figure with `min`, `max` or both, in the figure's own unit. Raises BadInput
    for a figure that the run does not have.
    """
    return tuple(_judge(figures, item) for item in scenario.get("requirements", ()))


def _judge(figures: Figures, item: Mapping[str, Any]) -> Verdict:
    metric = figures.metric(str(item["metric"])) or metric_of(str(item["metric"]))
    low, high = item.get("min"), item.get("max")
    value = figures.values.get(metric.name, math.nan)
    holds = (low is None or value >= low) and (high is None or value <= high)
    return Verdict(metric.name, value, metric.unit, low, high, holds and not math.isnan(value))


def all_hold(verdicts: Sequence[Verdict]) -> bool:
    """Say whether every requirement held (true when there is none)."""
    return all(verdict.holds for verdict in verdicts)
