"""The table of robots of other sizes in docs/control.md: `python -m tests.stats.robot_sizes` (a minute).

Scenarios of the thesis, the gains that ship, wheel gains of the board unchanged, ten seeds that no search has
used. Lengths, mass and moment of inertia scale together; motors and gears are named beside the robot.
"""

from __future__ import annotations

from pathlib import Path

from hil.config.load import load_scenario
from hil.runs.execute import RunSpec, execute_in_memory
from hil.study.tune import COST_FAILED, run_cost
from hil.study.tuning_verdict import HELD_OUT_SCENARIOS, HELD_OUT_SEED

USUAL = {"track_m": 0.2166, "front_axle_m": 0.075, "rear_axle_m": 0.075, "d0_m": 0.03}
INERTIA_KG_M2, MASS_KG = 0.024, 2.8
STRONG = {"motor.resistance_ohm": 2.5, "motor.gear_ratio": 50.0, "encoder_counts_per_turn": 3200}
ROBOTS = {
    "thesis, 2.8 kg, wheels 48 mm": (1.0, 2.8, 0.0482, {}),
    "small, 1.2 kg, wheels 33 mm, same motors": (2.0 / 3.0, 1.2, 0.033, {}),
    "large, 5.6 kg, wheels 60 mm, motors of half the resistance geared 50:1, 3,200 counts": (
        1.5, 5.6, 0.06, STRONG,
    ),
    "large, the thesis's motors": (1.5, 5.6, 0.06, {}),
}  # fmt: skip
SEEDS = range(HELD_OUT_SEED, HELD_OUT_SEED + 10)


def overrides(size: float, mass_kg: float, radius_m: float, motors: dict[str, float]) -> list[str]:
    """Return a robot as values for --set."""
    inertia = INERTIA_KG_M2 * mass_kg / MASS_KG * size**2
    values = {name: size * value for name, value in USUAL.items()} | motors
    values |= {"mass_kg": mass_kg, "inertia_kg_m2": inertia, "wheel_radius_m": radius_m}
    return [f"robot.{name}={value!r}" for name, value in values.items()]


def row(outer: str, robot: list[str]) -> tuple[str, int]:
    """Return cost and rest error of a law's runs as text, and how many had no figures."""
    costs, rests, failed = [], [], 0
    for name in HELD_OUT_SCENARIOS:
        for seed in SEEDS:
            spec = RunSpec(
                load_scenario(name, robot),
                "twin",
                "pose",
                outer,
                "asg-ism",
                seed,
                Path(),
                rerun=False,
            )
            record = execute_in_memory(spec)
            values = record.figures().values if record.manifest.outcome == "complete" else {}
            costs.append(run_cost(values) if values else COST_FAILED)
            failed += not values
            if values:
                rests.append(1e3 * values["delta1_worst_last_second_m"])
    cost = sum(costs) / len(costs)
    if not rests:
        return f"{cost:.2f}", failed
    return f"{cost:.2f}, {sum(rests) / len(rests):.1f} / {max(rests):.1f} mm", failed


def main() -> None:
    """Print the table, a line as it is done."""
    print("| robot | ASG-ISM: cost, rest error mean / worst | PID | runs without figures |")
    for name, of in ROBOTS.items():
        found = [row(outer, overrides(*of)) for outer in ("asg-ism", "pid")]
        runs = 2 * len(HELD_OUT_SCENARIOS) * len(SEEDS)
        told = " | ".join(text for text, _ in found)
        print(f"| {name} | {told} | {sum(n for _, n in found)} of {runs} |", flush=True)


if __name__ == "__main__":
    main()
