"""How often the intervals of `hil fit` hold: `python -m tests.log_fit.coverage [TWINS [LAYER...]]`.

Robots drawn at random drive for a minute; a parameter counts where the log tells it. Prints, for each layer
and parameter, how often it was told, how often the truth lay inside, and the usual half width.
"""

from __future__ import annotations

import sys
import tempfile
from collections import defaultdict
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy import stats

from hil.config.load import load_robot
from hil.study.log_fit.fit import fit_log
from hil.study.log_fit.motors import KEYS
from tests.log_fit.twins import Answer, WheelAnswer, drive, motor_log, wheel_log, write_csv

if TYPE_CHECKING:
    from hil.study.log_fit.estimate import Estimate

Rows = dict[str, list[tuple[bool, float]]]
ROBOT = load_robot("thesis-4wd")
DURATION_S = 60.0


def body(folder: Path, seed: int) -> tuple[Iterable[Estimate], dict[str, float]]:
    """Return what commands and poses told of a drawn robot, and the truth."""
    answer = Answer.drawn(np.random.default_rng(seed))
    log = write_csv(folder / "log.csv", drive(answer, seed, DURATION_S))
    fit = fit_log(log, None, ROBOT)
    assert fit.body is not None
    return fit.body.found.estimates, vars(answer)


def odometry(folder: Path, seed: int) -> tuple[Iterable[Estimate], dict[str, float]]:
    """Return wheel radius and track that wheel speeds and poses told, and the truth."""
    rng = np.random.default_rng(seed)
    answer = Answer.drawn(rng)
    truth = {"wheel_radius_m": rng.uniform(0.04, 0.06), "track_m": rng.uniform(0.17, 0.27)}
    log = drive(
        answer, seed, DURATION_S, radius_m=truth["wheel_radius_m"], track_m=truth["track_m"]
    )
    fit = fit_log(write_csv(folder / "log.csv", log, wheels=True), None, ROBOT)
    return fit.robot_values, truth


def wheels(folder: Path, seed: int) -> tuple[Iterable[Estimate], dict[str, float]]:
    """Return what wheel commands and wheel speeds told of drawn wheel loops, and the truth."""
    answer = WheelAnswer.drawn(np.random.default_rng(seed))
    fit = fit_log(wheel_log(folder / "log.csv", answer, seed, DURATION_S), None, ROBOT)
    assert fit.wheels is not None
    return fit.wheels.estimates, vars(answer)


def motors(folder: Path, seed: int) -> tuple[Iterable[Estimate], dict[str, float]]:
    """Return what duties and wheel speeds told of a robot with drawn motors and masses, and the truth."""
    rng = np.random.default_rng(seed)
    ratios = {
        "motor_constant_ratio": rng.uniform(0.85, 1.15), "motor_friction_ratio": rng.uniform(0.6, 1.6),
        "floor_friction_ratio": rng.uniform(0.6, 1.4), "mass_ratio": rng.uniform(0.8, 1.4),
        "inertia_ratio": rng.uniform(0.8, 1.5), "wheel_speed_delay_s": 0.0,
    }  # fmt: skip
    tree = ROBOT.model_dump()
    changes = {}
    for name, keys in KEYS.items():
        for key in keys:
            table, _, leaf = key.rpartition(".")
            changes[key] = (tree[table] if table else tree)[leaf] * ratios[name]
    fit = fit_log(motor_log(folder / "log.csv", changes, seed, DURATION_S), None, ROBOT)
    assert fit.motors is not None
    return fit.motors.estimates, ratios


LAYERS: dict[str, Callable[[Path, int], tuple[Iterable[Estimate], dict[str, float]]]] = {
    "body": body, "odometry": odometry, "wheels": wheels, "motors": motors,
}  # fmt: skip


def measure(layer: str, twins: int, first: int = 100) -> Rows:
    """Return, by parameter, (inside, half width) of every twin whose log told it."""
    found: Rows = defaultdict(list)
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + twins):
            estimates, truth = LAYERS[layer](Path(folder), seed)
            for item in estimates:
                if item.told and item.name in truth:
                    inside = item.low <= truth[item.name] <= item.high
                    found[item.name].append((bool(inside), 0.5 * (item.high - item.low)))
    return found


def _print(layer: str, twins: int, found: Rows) -> None:
    inside = told = 0
    for name, rows in found.items():
        held = sum(ok for ok, _ in rows)
        inside, told = inside + held, told + len(rows)
        half = float(np.median([width for _, width in rows]))
        print(
            f"{layer} {name}: told {len(rows)} of {twins}, inside {held}, usual half width {half:.4g}"
        )
    low, high = stats.binomtest(inside, told).proportion_ci(0.95, method="exact")
    print(
        f"{layer} together: {inside} of {told} inside ({inside / told:.1%}, {low:.1%} to {high:.1%})"
    )


def main() -> None:
    """Print the table."""
    twins = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    for layer in sys.argv[2:] or LAYERS:
        _print(layer, twins, measure(layer, twins))


if __name__ == "__main__":
    main()
