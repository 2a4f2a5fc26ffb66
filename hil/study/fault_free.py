"""Runs without a fault, each drawn by its seed: how many are stopped or diagnosed all the same.

All scenarios that ship, both outer and both wheel laws, and what campaigns draw: delay, jitter and loss
of the link, slip, a robot that is not as its file says, a battery half empty, a camera that drops frames.
"""

from __future__ import annotations

from pathlib import Path
from random import Random

from scipy import stats

from hil.config.load import load_scenario
from hil.runs.execute import RunSpec, execute_in_memory
from hil.study.fault_matrix import LAWS

SCENARIOS = ("scenario-1", "scenario-2", "scenario-3", "circle")
DURATION_S = 12.0
CONFIDENCE = 0.95
# At most so many of the runs may be stopped or diagnosed.
MOST_RATIO = 1e-3


def drawn(seed: int) -> tuple[str, str, str, list[str]]:
    """Return scenario, outer law, wheel law and settings of one run; scenarios and laws take turns."""
    rng = Random(f"without a fault {seed}")
    settings = [f"duration_s={DURATION_S:g}"]
    if rng.random() < 0.5:
        settings.append(f"link.latency_s={rng.uniform(0.005, 0.06):.4f}")
        settings.append(f"link.latency_jitter_s={rng.uniform(0.0, 0.03):.4f}")
    if rng.random() < 0.25:
        # Single chunks: a burst that silences the link for 0.25 s is a fault, and stopped for that.
        settings.append(f"link.loss_ratio={rng.uniform(0.0, 0.02):.4f}")
        settings.append("link.loss_burst_chunks=1")
    if rng.random() < 0.25:
        settings.append("robot.variant=slip")
    if rng.random() < 0.5:
        mass, radius = rng.uniform(0.85, 1.2), rng.uniform(0.96, 1.04)
        settings.append(f"mismatch={{mass_kg = {mass:.3f}, wheel_radius_m = {radius:.3f}}}")
    if rng.random() < 0.25:
        settings.append(f"robot.battery.charge_start_ratio={rng.uniform(0.5, 1.0):.3f}")
    if rng.random() < 0.25:
        settings.append(f"camera.drop_ratio={rng.uniform(0.0, 0.05):.4f}")
    inner = ("asg-ism", "pid")[seed // 8 % 2]
    return SCENARIOS[seed % 4], LAWS[seed // 4 % 2], inner, settings


def fault_free(seed: int) -> tuple[int, str]:
    """Run the run of a seed; return it with what was said of it, "" for none."""
    scenario, outer, inner, settings = drawn(seed)
    loaded = load_scenario(scenario, settings)
    record = execute_in_memory(RunSpec(loaded, "twin", "pose", outer, inner, seed, Path()))
    said = [record.manifest.outcome_detail, *record.diagnoses()]
    told = "; ".join(text for text in said if text)
    run = f"{scenario} {outer} {inner} seed {seed} {' '.join(settings)}"
    return seed, f"{run}: {told}" if told else ""


def most_ratio(alarms: int, runs: int) -> float:
    """Return the upper end of the one-sided 95 % interval of a share (Clopper and Pearson 1934)."""
    if alarms >= runs:
        return 1.0
    return float(stats.beta.ppf(CONFIDENCE, alarms + 1, runs - alarms))
