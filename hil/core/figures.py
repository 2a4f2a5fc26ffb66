"""The figures of merit: name, unit and meaning of each. How they are computed: `hil.analysis.metrics`.

METRICS are the built-in ones, which every run has. One of a lab's own (`@hil.figure`) is computed where a
scenario names it, and a cost of its own (`@hil.tuning_cost`) makes one number of a run's figures.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeVar

from hil.core.errors import BadInput
from hil.core.registries import FIGURES, TUNING_COSTS
from hil.core.registry import Entry, is_file_name

Thing = TypeVar("Thing", bound=Callable[..., object])
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
           "least gain of the sliding term / 90 % bound of the disturbance; the theorem asks for 2",
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
# What stands beside the figures of a run in the tables of campaigns and of `compare --csv`.
BESIDE = frozenset({
    "record", "scenario_name", "target", "camera", "outer", "inner", "seed", "outcome", "basis",
    "index", "draw", "detail", "holds", "t_end_s", "program",
})  # fmt: skip


def figure(
    name: str, *, unit: str, meaning: str, smaller_is_better: bool | None = True, label: str = ""
) -> Callable[[Thing], Thing]:
    """Return the decorator that makes a function of `hil.RunData` a figure of merit.

    The function gives one number in `unit` ("" without one), NaN where a run has none. `meaning` says
    how it is defined, `smaller_is_better` which way is better (None: neither), `label` how tables call it.
    Raises BadInput for a name that cannot be a column, an empty meaning, or a name that is taken.
    """
    _require_words("figure", name, unit=unit, meaning=meaning, label=label)
    if name in BESIDE:
        raise BadInput(
            f"figure {name!r}: tables have a column {name} beside the figures of a run; name it otherwise"
        )
    if smaller_is_better not in (True, False, None):
        raise BadInput(
            f"figure {name}: smaller_is_better = {smaller_is_better!r}: True, False, or None for neither"
        )
    ways: dict[bool | None, Better] = {True: "lower", False: "higher", None: "neither"}
    better = ways[smaller_is_better]
    metric = Metric(name, unit, label or name, meaning, better)
    return FIGURES.register(name, summary=meaning, label=metric.label, metric=metric)


def tuning_cost(name: str, *, meaning: str, failed: float) -> Callable[[Thing], Thing]:
    """Return the decorator that makes a function of a run's figures what `hil tune` minimises.

    The function is given the figures by name and gives one number, less is better. `failed` is what a run
    costs that has no cost (it ended early, a figure in use is NaN), and the most that any run costs.
    Raises BadInput for a name that is none or taken, and for a `failed` that is no finite number.
    """
    _require_words("tuning cost", name, meaning=meaning)
    if isinstance(failed, bool) or not isinstance(failed, int | float) or not math.isfinite(failed):
        raise BadInput(
            f"tuning cost {name}: failed = {failed!r}: needs a finite number, more than a good run costs"
        )
    return TUNING_COSTS.register(name, summary=meaning, failed=float(failed))


def _require_words(kind: str, name: str, **said: str) -> None:
    if not isinstance(name, str) or not name.replace("-", "_").isidentifier():
        raise BadInput(
            f"{kind} {name!r}: a name begins with a letter and has letters, digits and _ alone"
        )
    if kind == "figure" and "-" in name:
        raise BadInput(f"figure {name!r}: is a column of tables too: write _ in place of -")
    for key, text in said.items():
        if not isinstance(text, str) or "\n" in text or (key == "meaning" and not text.strip()):
            raise BadInput(f"{kind} {name}: {key} = {text!r}: needs a text of one line")


def metric_of(name: str) -> Metric:
    """Return a figure by its name, also one of a file or package that is known; raises BadInput."""
    if name in BY_NAME:
        return BY_NAME[name]
    return declared(FIGURES.get(require_known(name)))


def declared(entry: Entry) -> Metric:
    """Return what a registered figure says of itself."""
    metric: Metric = entry.extra["metric"]
    return metric


def require_known(name: str) -> str:
    """Return the name of a figure, a file's by `FILE.py[:NAME]`; raises BadInput with near names."""
    if name in BY_NAME:
        return name
    if is_file_name(name) or name in FIGURES.names():
        return FIGURES.get(name).name
    names = FIGURES.names()
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.4)
    hint = f"near: {', '.join(near)}" if near else f"known: {', '.join(names)}"
    raise BadInput(
        f"figure {name!r}: no such figure, built in or in an installed package ({FIGURES.group}); {hint}; "
        f"or name a file: ./{name}.py"
    )


def _three_digits(value: float) -> str:
    """Return 3 significant digits without an exponent where a person would not write one."""
    size = abs(value)
    if size == 0 or float(f"{size:.3g}").is_integer():
        return f"{value:,.0f}" if size < 1e9 else f"{value:.3g}"
    return f"{value:.3g}" if 1e-3 <= size < 1e3 else f"{value:.2e}"
