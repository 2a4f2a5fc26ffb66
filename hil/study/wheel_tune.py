"""Gains of the wheel laws: the search of hil.study.tune on the wheel bench (docs/wheel-loop.md).

What both laws share (feed-forward, differentiator, limits) stays as the board has it; the gains of
each law are searched with the same candidates, cases, robots and seeds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from hil.analysis.costs import COST_FAILED
from hil.core.registry import Box
from hil.study.tune import Found, minimise
from hil.study.wheel_bench import CASES, DEFAULT, Case, figures, run

# Least, start and largest value; from the start both laws can turn the robot on the spot.
SEARCH: dict[str, Box] = {
    "asg-ism": {
        "ISM_SIGMA": (0.01, 0.5, 10.0),
        "ISM_MU0": (0.02, 0.08, 5.0),
        "ISM_HOLD": (0.03, 0.1, 10.0),
        "ISM_EPS0": (0.001, 0.01, 0.1),
        "ISM_EPSMIN": (0.1, 3.0, 10.0),
        "ISM_K0": (0.02, 0.5, 1.0),
        "ISM_STEP": (0.05, 2.0, 20.0),
        "BUMP_TAU": (0.02, 0.5, 10.0),
    },
    "asg-ism-implicit": {
        "IMP_MU": (1.0, 10.0, 60.0),
        "IMP_SIGMA": (0.01, 0.06, 5.0),
        "IMP_STEP": (0.004, 0.02, 0.2),
        "IMP_K": (0.2, 0.8, 2.0),
    },
    "pid": {
        "PID_KP": (0.01, 0.12, 2.0),
        "PID_KI": (0.05, 1.2, 20.0),
        "PID_KD": (1e-5, 1e-3, 0.05),
    },
}
# A case's cost: its speed error in parts of what is tolerable, 0.2 rad/s (10 mm/s) and 10 % of the
# set-point, and the variation of the duty, at about a tenth of the whole.
TOLERANCE_RAD_S = 0.2
TOLERANCE_RATIO = 0.1
CHATTER_WEIGHT_S = 0.03


@dataclass(frozen=True, slots=True)
class Plan:
    """What both laws are given alike."""

    robots: tuple[int, ...] = (DEFAULT, 1)
    candidates: int = 181
    population: int = 10
    search_seed: int = 1


def case_cost(law: str, case: Case, parameters: Mapping[str, float], seed: int) -> float:
    """Return the cost of one run; COST_FAILED when the board stopped by itself."""
    trace = run(law, case, parameters, seed)
    if trace.stopped:
        return COST_FAILED
    found = figures(case, trace)
    tolerance = TOLERANCE_RAD_S + TOLERANCE_RATIO * float(abs(trace.setpoint_rad_s).max())
    cost = found.rms_error_rad_s / tolerance + CHATTER_WEIGHT_S * found.chatter_duty_s
    return cost if math.isfinite(cost) else COST_FAILED


def bench_cost(law: str, parameters: Mapping[str, float], robots: tuple[int, ...]) -> float:
    """Return the mean cost over all cases and robots."""
    costs = [case_cost(law, case, parameters, seed) for case in CASES.values() for seed in robots]
    return sum(costs) / len(costs)


# (law, candidates done, candidates in all, best cost so far)
Progress = Callable[[str, int, int, float], None]


def tune(plan: Plan, progress: Progress) -> dict[str, Found]:
    """Return what was found, by law."""

    def searched(law: str) -> Found:
        return minimise(
            SEARCH[law],
            lambda tried: [bench_cost(law, values, plan.robots) for values in tried],
            candidates=plan.candidates,
            population=plan.population,
            seed=plan.search_seed,
            progress=lambda done, best: progress(law, done, plan.candidates, best),
        )

    return {law: searched(law) for law in SEARCH}


def as_document(plan: Plan, found: Mapping[str, Found]) -> dict[str, Any]:
    """Return the values found with all that it takes to find them again."""
    return {
        "procedure": "hil.study.wheel_tune: CMA-ES on log gains, see docs/wheel-loop.md",
        "plan": asdict(plan),
        "found": {name: asdict(stage) for name, stage in found.items()},
    }
