"""README's table of both laws, made anew: `python -m tests.stats.readme_table` (600 runs).

Both laws with the gains that ship, three scenarios, seeds 1000 to 1099, `--camera pose`.
"""

from __future__ import annotations

import os

from hil.analysis.stats import Paired
from hil.config.control import ControlConfig
from hil.study.campaign.workers import Pool
from hil.study.tune import OnTarget
from hil.study.tuning_verdict import HELD_OUT_SCENARIOS, held_out_trials, judge

# Figure, how the README calls it, factor to its unit there, and decimals.
ROWS = (
    ("cost", "cost of the tuning", 1.0, 3),
    ("ise_m2_s", "ISE, 10⁻³ m² s", 1e3, 1),
    ("itae_m_s2", "ITAE, 10⁻³ m s²", 1e3, 0),
    ("settling_20mm_s", "settling to 20 mm, ms", 1e3, 0),
    ("delta1_worst_last_second_m", "worst error of the last second, mm", 1e3, 2),
    ("control_energy_m2_s3", "control energy, 10⁻³ m²/s³", 1e3, 0),
    ("theta_dot_variation_rad_s", "variation of the turn command, rad/s", 1.0, 2),
    ("pwm_variation_counts", "variation of PWM (chatter), counts", 1.0, -1),
)


def cell(result: Paired, factor: float, digits: int) -> str:
    """Return a difference with its interval, bold where ASG-ISM is surely the worse one."""

    def text(value: float, sign: str = "") -> str:
        return f"{round(factor * value, digits):{sign}.{max(digits, 0)}f}"

    mean = text(result.mean, "+" if result.mean > 0 else "")
    bold = "**" if result.certain and result.mean > 0 else ""
    return f"{bold}{mean}{bold} ({text(result.interval.low)} to {text(result.interval.high)})"


def main() -> None:
    """Print the table and how many runs failed."""
    trials = held_out_trials(ControlConfig().active_gains, 100)
    with Pool(OnTarget("twin", "pose"), os.cpu_count() or 1) as pool:
        verdict = judge(trials, pool.map(trials, lambda *_: None))
    print("| |", " | ".join(HELD_OUT_SCENARIOS), "|")
    print("| --- |", " --- |" * len(HELD_OUT_SCENARIOS))
    for name, label, factor, digits in ROWS:
        cells = [cell(verdict.differences[s][name], factor, digits) for s in HELD_OUT_SCENARIOS]
        print(f"| {label} |", " | ".join(cells), "|")
    print(f"failed: {verdict.failed}")
    for name in ("cost", "ise_m2_s", "control_energy_m2_s3", "delta1_worst_last_second_m"):
        every = verdict.differences["all"][name]
        print(name, "all:", every.baseline_mean, every.other_mean, every.mean, every.interval)


if __name__ == "__main__":
    main()
