"""Names of what a study has: parameters and sample columns of each plant, figures of a row."""

from __future__ import annotations

import re
from collections.abc import Mapping

from hil.core.errors import BadInput
from hil.study.chapters import _plants

PARAMETERS: Mapping[str, tuple[str, ...]] = {
    "quadrotor": _plants.QUADROTOR_PARAMETERS,
    "vehicle5": _plants.VEHICLE5_PARAMETERS,
    "vehicle6": _plants.VEHICLE6_PARAMETERS,
}
COLUMNS: Mapping[str, tuple[str, ...]] = {
    "quadrotor": _plants.QUADROTOR_COLUMNS,
    "vehicle5": _plants.VEHICLE5_COLUMNS,
    "vehicle6": _plants.VEHICLE6_COLUMNS,
}
# figure of a row -> attribute of an outcome, unit
FIGURES: Mapping[str, tuple[str, str]] = {
    "ise_m2_s": ("ise", "m² s"),
    "ise_late_m2_s": ("ise_late", "m² s"),
    "worst_m": ("worst_late", "m"),
    "worst_end_m": ("worst_end", "m"),
    "cost_m": ("cost_late", "m"),
    "effort": ("effort", "u² s"),
    "effort_early": ("effort_early", "u² s"),
    "peak_early": ("peak_early", "u²"),
    "peak_late": ("peak_late", "u²"),
    "peak": ("peak", "u"),
    "tilt_rad": ("tilt_late", "rad"),
    "integral_cost_m_s": ("integral_cost", "m s"),
    "rate_error_m_s": ("rate_rms", "m/s"),
}
_POSITIVE = re.compile(
    r"(mass_kg|gravity|m\d\d_|i..?_kg|weight|step_s|duration_s|hold_s|sample_s|give_up|tilt_max|"
    r"accel_max|attitude_filter|gain_floor|correction_max|command_lag|motor_inductance|motor_gain|"
    r"fin_force|differentiator_|turn_rate_max|pitch_max|force_max|radius_m)"
)
_MAY_BE_ZERO = ("differentiator_implicit",)
_MAX_STEPS = 5_000_000


def check_values(values: Mapping[str, float], where: str) -> None:
    """Raise BadInput for values that no plant can run with."""
    for name, value in values.items():
        if _POSITIVE.match(name) and name not in _MAY_BE_ZERO and value <= 0.0:
            raise BadInput(f"{where}: {name} = {value:g}: must be greater than 0")
    for name in values:
        if name.startswith("added_") and values[name] < 0.0:
            raise BadInput(f"{where}: {name} = {values[name]:g}: must not be negative")
    step, duration = values["step_s"], values["duration_s"]
    if not 1.0 <= duration / step <= _MAX_STEPS:
        raise BadInput(
            f"{where}: duration_s = {duration:g} s at step_s = {step:g} s are {duration / step:.3g} "
            f"steps; 1 to {_MAX_STEPS} are possible"
        )
    if values.get("hold_s", step) < step:
        raise BadInput(
            f"{where}: hold_s = {values['hold_s']:g} s: must not be below step_s = {step:g} s"
        )
    low, high = values.get("surge_min_m_s", 0.0), values.get("surge_max_m_s", 0.0)
    if low > high:
        raise BadInput(
            f"{where}: surge_min_m_s = {low:g} m/s: must not exceed surge_max_m_s = {high:g} m/s"
        )
