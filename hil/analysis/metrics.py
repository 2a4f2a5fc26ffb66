"""The figures of a run, computed from its recorded columns alone, and the verdict on them.

Each figure is declared once in METRICS with its unit and with what is better. Errors and the path
are taken from the truth where the record has it, else from the estimate, and `basis` says which.
Commands are held between ticks, so their integrals are step sums; errors are integrated by the
trapezoidal rule. A figure that does not exist for a run (no sliding variable under PID, never
settled, fewer than two ticks) is NaN, null in JSON, and does not satisfy a requirement.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from hil.analysis import sliding
from hil.analysis.sliding import LawFacts
from hil.core.errors import BadInput
from hil.core.figures import BY_NAME, METRICS, require_known

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Columns = Mapping[str, Array]

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
    """Values by metric name, and whether they rest on "truth" or on the "estimate"."""

    basis: Literal["truth", "estimate"]
    values: dict[str, float]

    def to_json(self) -> dict[str, Any]:
        """Return the content of metrics.json: value and unit by name, NaN as null."""
        figures = {
            metric.name: {"value": _finite(self.values[metric.name]), "unit": metric.unit}
            for metric in METRICS
        }
        return {"basis": self.basis, "figures": figures}


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
    with np.errstate(over="ignore", invalid="ignore"):  # of a damaged record: they are inf or NaN
        values = (
            _error_figures(t_s, error_norm(columns))
            | _motion_figures(columns, who)
            | _effort_figures(columns)
            | _sliding_figures(columns)
            | sliding.figures(columns, who, law or LawFacts())
            | _timing_figures(columns, link or LinkStats())
        )
    return Figures("truth" if true_error else "estimate", values)


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
    for an unknown figure.
    """
    return tuple(_judge(figures, item) for item in scenario.get("requirements", ()))


def _judge(figures: Figures, item: Mapping[str, Any]) -> Verdict:
    name = require_known(str(item["metric"]))
    low, high = item.get("min"), item.get("max")
    value = figures.values[name]
    holds = (low is None or value >= low) and (high is None or value <= high)
    return Verdict(name, value, BY_NAME[name].unit, low, high, holds and not math.isnan(value))


def all_hold(verdicts: Sequence[Verdict]) -> bool:
    """Say whether every requirement held (true when there is none)."""
    return all(verdict.holds for verdict in verdicts)
