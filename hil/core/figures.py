"""The figures of merit: name, unit and meaning of each. How they are computed: `hil.analysis.metrics`."""

from __future__ import annotations

import difflib
import math
from dataclasses import dataclass
from typing import Literal

from hil.core.errors import BadInput

Better = Literal["lower", "higher", "neither"]


@dataclass(frozen=True, slots=True)
class Metric:
    """One figure: what it is called, its unit, how it is defined, and which way is better.

    `shown` is the unit a person reads it in, and the factor from the figure's own unit to it.
    """

    name: str
    unit: str
    label: str
    definition: str
    better: Better = "lower"
    shown: tuple[str, float] | None = None

    @property
    def shown_unit(self) -> str:
        """Return the unit a person reads the figure in."""
        return self.shown[0] if self.shown else self.unit

    def text(self, value: float, *, with_unit: bool = True) -> str:
        """Return a value as a person reads it: 3 digits, shown unit, a dash for NaN."""
        if not math.isfinite(value):
            return "–"
        number = _three_digits(value * (self.shown[1] if self.shown else 1.0))
        return f"{number} {self.shown_unit}".strip() if with_unit else number


_MM, _MS, _PERCENT = ("mm", 1e3), ("ms", 1e3), ("%", 1e2)

METRICS = (
    Metric("delta1_final_m", "m", "final |δ1|", "|z1 - z1*| at the last tick", shown=_MM),
    Metric("delta1_worst_last_second_m", "m", "worst |δ1|, last second",
           "largest |z1 - z1*| over the last 1 s", shown=_MM),
    Metric("ise_m2_s", "m²·s", "ISE", "integral of |δ1|²"),
    Metric("iae_m_s", "m·s", "IAE", "integral of |δ1|"),
    Metric("itae_m_s2", "m·s²", "ITAE", "integral of t |δ1|"),
    Metric("settling_50mm_s", "s", "settling time to 50 mm", "|δ1| stays at or below 50 mm after"),
    Metric("settling_20mm_s", "s", "settling time to 20 mm", "|δ1| stays at or below 20 mm after"),
    Metric("path_length_m", "m", "path length", "length of the path of the centre of mass"),
    Metric("control_energy_m2_s3", "m²/s³", "control energy ∫|u|²",
           "integral of |u|², u = (zeta, u2): the inputs of the compensated model (2.33)"),
    Metric("pwm_energy_counts2_s", "counts²·s", "PWM energy ∫PWM²",
           "integral of PWM² of both sides, as sampled at each outer tick",
           shown=("10⁶ counts²·s", 1e-6)),
    Metric("eta1_variation_m_s", "m/s", "variation of speed command",
           "sum of |change| of the forward speed commanded"),
    Metric("theta_dot_variation_rad_s", "rad/s", "variation of turn command",
           "sum of |change| of the turn rate commanded"),
    Metric("pwm_variation_counts", "counts", "variation of PWM",
           "sum of |change| of PWM of both sides, as sampled at each outer tick"),
    Metric("s_sign_changes_hz", "1/s", "sign changes of s",
           "sign changes of s_x and s_y together, per second in which the law ran"),
    Metric("saturated_share", "", "time saturated",
           "share of the ticks with the law running at which a limit held", shown=_PERCENT),
    Metric("in_layer_share", "", "time in the layer",
           "share of the ticks with the law running that have ||s|| <= eps",
           "higher", shown=_PERCENT),
    Metric("reaching_s", "s", "reaching time", "first time with ||s|| <= eps"),
    Metric("law_ticks", "", "ticks of the law",
           "ticks in which the law ran: all but those that the control stop held", "neither"),
    Metric("disturbance_median_m_s3", "m/s³", "disturbance, median",
           "|C xi + D xi_dot| that acted on the chain while a sliding law ran, median"),
    Metric("disturbance_90_m_s3", "m/s³", "disturbance, 90 % bound D90",
           "the same, 90th percentile: the D that alpha must exceed twice"),
    Metric("disturbance_max_m_s3", "m/s³", "disturbance, largest", "the same, largest"),
    Metric("alpha_over_d90_ratio", "", "alpha / D90",
           "gain of the sliding term / 90 % bound of the disturbance; the theorem asks for 2",
           "higher"),
    Metric("s_over_eps_median_ratio", "", "||s||/eps, median",
           "median of ||s||/eps over the ticks of the law; near 0 the term is a weak spring",
           "neither"),
    Metric("sliding_term_share", "", "share of the sliding term",
           "median share of alpha s/(||s|| + eps) in the jerk commanded", "neither",
           shown=_PERCENT),
    Metric("s_settling_s", "s", "settling of s",
           "time from the law's first tick after which ||s|| <= eps"),
    Metric("sliding_acts", "", "the sliding mode acts",
           "1 where alpha/D90 >= 2, ||s|| <= eps in 99 % of the law's ticks and eps is below the "
           "limit on zeta; else 0", "higher"),
    Metric("link_loss_ratio", "", "link loss",
           "board frames missing by sequence number / frames the board sent", shown=_PERCENT),
    Metric("rtt_median_s", "s", "round trip, median",
           "time exchange with the board, median", shown=_MS),
    Metric("rtt_p99_s", "s", "round trip, 99 %",
           "time exchange with the board, 99th percentile", shown=_MS),
    Metric("exposure_to_actuation_median_s", "s", "exposure to actuation, median",
           "from the middle of the exposure to the command's effect, median", shown=_MS),
    Metric("exposure_to_actuation_p99_s", "s", "exposure to actuation, 99 %",
           "from the middle of the exposure to the command's effect, 99th percentile", shown=_MS),
    Metric("deadline_misses", "", "deadline misses", "ticks that began too late"),
    Metric("start_offset_x_m", "m", "start offset in X",
           "X of z1 - z1* at the first tick; negative: left of the point", "neither", shown=_MM),
    Metric("turn_rad", "rad", "net turn",
           "heading at the end - heading at the start; negative: to the right", "neither",
           shown=("°", 180.0 / math.pi)),
    Metric("duration_s", "s", "duration", "last tick - first tick", "neither"),
)  # fmt: skip
BY_NAME = {metric.name: metric for metric in METRICS}


def _three_digits(value: float) -> str:
    """Return 3 significant digits without an exponent where a person would not write one."""
    size = abs(value)
    if size == 0 or float(f"{size:.3g}").is_integer():
        return f"{value:,.0f}" if size < 1e9 else f"{value:.3g}"
    return f"{value:.3g}" if 1e-3 <= size < 1e3 else f"{value:.2e}"


def require_known(name: str) -> str:
    """Return the name of a figure as it is; raises BadInput with near names when unknown."""
    if name in BY_NAME:
        return name
    near = difflib.get_close_matches(name, BY_NAME, n=3, cutoff=0.4)
    hint = f"near: {', '.join(near)}" if near else f"known: {', '.join(BY_NAME)}"
    raise BadInput(f"requirement {name!r}: no such figure; {hint}")
