"""Gains of the wheel laws: the search of hil.study.tune on the wheel bench (docs/wheel-loop.md).

What the laws share (feed-forward, differentiator, limits) stays as the board has it; the gains of
each law are searched with the same candidates, cases, robots and seeds. What was found is judged on
robots that no search has seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from hil.analysis.costs import COST_FAILED
from hil.analysis.stats import Paired, paired
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
# The law that the others are compared with.
BASELINE = "pid"


@dataclass(frozen=True, slots=True)
class Plan:
    """What the laws are given alike."""

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


@dataclass(frozen=True, slots=True)
class Judged:
    """A law's mean cost of each robot that no search has seen: as found, and with the board's defaults."""

    found: tuple[float, ...]
    defaults: tuple[float, ...]

    @property
    def gained(self) -> Paired:
        """Return as found minus the defaults, robot by robot."""
        return paired(self.defaults, self.found)

    def minus(self, other: Judged) -> dict[str, Paired]:
        """Return this law minus another, robot by robot: as found, and with the defaults."""
        return {
            "found": paired(other.found, self.found),
            "defaults": paired(other.defaults, self.defaults),
        }


def judge(values: Mapping[str, Mapping[str, float]], robots: Sequence[int]) -> dict[str, Judged]:
    """Return what the values found of each law are worth on robots that no search has seen."""

    def costs(law: str, parameters: Mapping[str, float]) -> tuple[float, ...]:
        return tuple(bench_cost(law, parameters, (robot,)) for robot in robots)

    return {law: Judged(costs(law, own), costs(law, {})) for law, own in values.items()}


def as_document(
    plan: Plan, found: Mapping[str, Found], judged: Mapping[str, Judged], robots: Sequence[int]
) -> dict[str, Any]:
    """Return the values found, all that it takes to find them again, and what they are worth."""
    return {
        "procedure": "hil.study.wheel_tune: CMA-ES on log gains, see docs/wheel-loop.md",
        "plan": asdict(plan),
        "found": {name: asdict(stage) for name, stage in found.items()},
        "held_out_robots": list(robots),
        "judged": {law: _told(law, judged) for law in judged},
    }


def _told(law: str, judged: Mapping[str, Judged]) -> dict[str, Any]:
    own = judged[law]
    told: dict[str, Any] = {
        "found_minus_defaults": own.gained.to_json(),
        "cost_by_robot": {"found": list(own.found), "defaults": list(own.defaults)},
    }
    if law != BASELINE and BASELINE in judged:
        against = own.minus(judged[BASELINE])
        told[f"minus_{BASELINE}"] = {name: one.to_json() for name, one in against.items()}
    return told


def as_lines(judged: Mapping[str, Judged]) -> list[str]:
    """Return what was judged in lines: mean costs, and differences with their 95 % intervals."""

    def text(one: Paired) -> str:
        return f"{one.mean:+.4f} ({one.interval.low:+.4f} to {one.interval.high:+.4f})"

    lines = []
    for law, own in judged.items():
        cost = own.gained
        line = (
            f"{law}: {cost.other_mean:.4f} as found, {cost.baseline_mean:.4f} with the board's "
            f"defaults, {text(cost)}"
        )
        if law != BASELINE and BASELINE in judged:
            against = own.minus(judged[BASELINE])
            line += f"; minus {BASELINE} as found {text(against['found'])}"
            line += f", with the defaults {text(against['defaults'])}"
        lines.append(line)
    return lines
