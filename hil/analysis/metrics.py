"""The figures of a run, computed from its recorded columns alone, and the verdict on them.

Each figure is declared once in METRICS with its unit and with what is better. Errors and the path
are taken from the truth where the record has it, else from the estimate, and `basis` says which.
Commands are held between ticks, so their integrals are step sums; errors are integrated by the
trapezoidal rule. A figure that does not exist for a run (no sliding variable under PID, never
settled, fewer than two ticks) is NaN, null in JSON, and does not satisfy a requirement.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from hil.analysis import sliding
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
    t_s = columns["t_s"]
    if t_s.size < 2:
        raise BadInput(f"run record: {t_s.size} rows of samples, the figures need at least 2")
    true_error = has_truth(columns)
    who = "true" if true_error else "est"
    values = (
        _error_figures(t_s, error_norm(columns))
        | _motion_figures(columns, who)
        | _effort_figures(columns)
        | _sliding_figures(columns)
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
        return error_norm(self.columns)

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
    known = np.isfinite(columns["true_delta1_x_m"])
    return bool(known.size and known.all())


def error_norm(columns: Columns) -> Array:
    """Return |delta1| in m at each tick, from the truth where there is one."""
    return np.hypot(*error_components(columns))


def error_components(columns: Columns) -> tuple[Array, Array]:
    """Return delta1 in m, world X and Y, from the truth where there is one."""
    prefix = "true_delta1" if has_truth(columns) else "delta1"
    return columns[f"{prefix}_x_m"], columns[f"{prefix}_y_m"]


def settling_time(t_s: Array, error_m: Array, band_m: float) -> float:
    """Return the time after which the error stays within the band; NaN when it does not."""
    outside = np.flatnonzero(~(error_m <= band_m))
    first = int(outside[-1]) + 1 if outside.size else 0
    return float(t_s[first] - t_s[0]) if first < t_s.size else math.nan


def _error_figures(t_s: Array, error_m: Array) -> dict[str, float]:
    since_start_s = t_s - t_s[0]
    last = t_s >= t_s[-1] - LAST_S
    return {
        "delta1_final_m": float(error_m[-1]),
        "delta1_worst_last_second_m": float(error_m[last].max()),
        "ise_m2_s": float(np.trapezoid(error_m**2, t_s)),
        "iae_m_s": float(np.trapezoid(error_m, t_s)),
        "itae_m_s2": float(np.trapezoid(since_start_s * error_m, t_s)),
        "settling_50mm_s": settling_time(t_s, error_m, 0.050),
        "settling_20mm_s": settling_time(t_s, error_m, 0.020),
    }


def _motion_figures(columns: Columns, who: str) -> dict[str, float]:
    x_m, y_m = columns[f"{who}_x_m"], columns[f"{who}_y_m"]
    theta_rad, t_s = columns[f"{who}_theta_rad"], columns["t_s"]
    return {
        "path_length_m": float(np.hypot(np.diff(x_m), np.diff(y_m)).sum()),
        "start_offset_x_m": float(error_components(columns)[0][0]),
        "turn_rad": float(theta_rad[-1] - theta_rad[0]),
        "duration_s": float(t_s[-1] - t_s[0]),
    }


def _effort_figures(columns: Columns) -> dict[str, float]:
    dt_s = np.diff(columns["t_s"])
    u_squared = columns["zeta_m_s2"] ** 2 + columns["u2_m_s2"] ** 2
    left, right = columns["pwm_left_counts"], columns["pwm_right_counts"]
    return {
        "control_energy_m2_s3": _held_integral(u_squared, dt_s),
        "pwm_energy_counts2_s": _held_integral(left**2 + right**2, dt_s),
        "eta1_variation_m_s": _variation(columns["eta1_cmd_m_s"]),
        "theta_dot_variation_rad_s": _variation(columns["theta_dot_cmd_rad_s"]),
        "pwm_variation_counts": _variation(left) + _variation(right),
        "saturated_share": _mean(columns["saturated"][sliding.law_ran(columns)]),
    }


def _sliding_figures(columns: Columns) -> dict[str, float]:
    ran = sliding.law_ran(columns)
    t_s, inside = columns["t_s"], columns["in_layer"]
    known = np.isfinite(inside)
    changes = _sign_changes(columns["s_x_m_s2"][ran]) + _sign_changes(columns["s_y_m_s2"][ran])
    ran_s = float(np.diff(t_s)[ran[:-1]].sum())
    reached = np.flatnonzero(inside == 1.0)
    return {
        "s_sign_changes_hz": changes / ran_s if known.any() and ran_s > 0.0 else math.nan,
        "in_layer_share": _mean(inside[ran]),
        "reaching_s": float(t_s[reached[0]] - t_s[0]) if reached.size else math.nan,
    }


def _timing_figures(columns: Columns, link: LinkStats) -> dict[str, float]:
    return {
        "link_loss_ratio": link.loss_ratio,
        "rtt_median_s": _percentile(columns["rtt_s"], 50),
        "rtt_p99_s": _percentile(columns["rtt_s"], 99),
        "exposure_to_actuation_median_s": _percentile(columns["exposure_to_actuation_s"], 50),
        "exposure_to_actuation_p99_s": _percentile(columns["exposure_to_actuation_s"], 99),
        "deadline_misses": float(np.nansum(columns["deadline_miss"])),
    }


def _held_integral(values: Array, dt_s: Array) -> float:
    """Integrate a signal that is held from each tick to the next; unknown values count as zero."""
    held = values[:-1] * dt_s
    return float(np.nansum(held)) if np.isfinite(held).any() else math.nan


def _variation(values: Array) -> float:
    """Return the sum of |change| between successive known values."""
    known = values[np.isfinite(values)]
    return float(np.abs(np.diff(known)).sum()) if known.size else math.nan


def _sign_changes(values: Array) -> int:
    """Count the changes of sign, passing over zeros and unknown values."""
    signs = np.sign(values[np.isfinite(values) & (values != 0.0)])
    return int(np.count_nonzero(np.diff(signs)))


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else math.nan


def _percentile(values: Array, percent: float) -> float:
    known = values[np.isfinite(values)]
    return float(np.percentile(known, percent)) if known.size else math.nan


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
