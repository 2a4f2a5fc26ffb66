"""The gap between two targets: one scenario, law and seed run on both."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hil.record.reader import RunRecord

_PWM = ("pwm_left_counts", "pwm_right_counts")
_POSE = ("true_x_m", "true_y_m", "true_theta_rad")
_SAME = ("outer", "inner", "seed", "camera")


def tier_gap(one: RunRecord, two: RunRecord) -> str | None:
    """Return where the PWM of two targets first differs and how far apart their poses are (RMS).

    Rows are paired by their number: both runs have one per outer tick. None where the runs differ
    in more than the target, or where a target does not know the true pose.
    """
    if one.manifest.target == two.manifest.target:
        return None
    if any(getattr(one.manifest, key) != getattr(two.manifest, key) for key in _SAME):
        return None
    rows = min(len(run.samples["t_s"]) for run in (one, two))

    def columns(names: tuple[str, ...]) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        pairs = [(one.samples[name][:rows], two.samples[name][:rows]) for name in names]
        return np.array([first - second for first, second in pairs])

    apart = columns(_POSE)
    if rows == 0 or not np.isfinite(apart).all():
        return None
    position_m = np.sqrt(np.mean(apart[0] ** 2 + apart[1] ** 2))
    heading_rad = np.sqrt(np.mean(apart[2] ** 2))
    return (
        f"gap between {one.manifest.target} and {two.manifest.target}: "
        f"{_first_pwm(one, two, np.any(columns(_PWM) != 0.0, axis=0))}; true poses "
        f"{1e3 * position_m:.2g} mm and {heading_rad:.2g} rad apart (RMS over {rows} ticks)"
    )


def _first_pwm(
    one: RunRecord, two: RunRecord, differs: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
) -> str:
    if not differs.any():
        return "PWM equal in every tick"
    row = int(np.argmax(differs))
    left, right = (
        " against ".join(f"{run.samples[name][row]:.0f}" for run in (one, two)) for name in _PWM
    )
    return (
        f"PWM first differs at {one.samples['t_s'][row]:.3f} s (left {left}, right {right} counts)"
    )
