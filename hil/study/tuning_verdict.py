"""The verdict on tuned gains: two laws on seeds that no candidate has seen, pair by pair."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hil.analysis.costs import USUAL as USUAL_COST
from hil.analysis.costs import Cost, Figures
from hil.analysis.stats import Paired, paired
from hil.core.errors import BadInput
from hil.study.tune import Case, Plan, Trial

if TYPE_CHECKING:
    from hil.config.gains import Gains

# The tape that judges: the scenarios as they ship, with seeds that no search uses.
HELD_OUT_SCENARIOS = ("scenario-1", "scenario-2", "scenario-3")
HELD_OUT_SEED = 1000
ALL_SCENARIOS = "all"
JUDGED = (
    "cost",
    "ise_m2_s",
    "itae_m_s2",
    "settling_20mm_s",
    "delta1_worst_last_second_m",
    "control_energy_m2_s3",
    "theta_dot_variation_rad_s",
    "pwm_variation_counts",
)


# A law, and the one that is subtracted from it.
Pair = tuple[str, str]
USUAL: Pair = ("asg-ism", "pid")


@dataclass(frozen=True, slots=True)
class Verdict:
    """One law minus another on held-out seeds: by scenario (and over all of them), by figure.

    `failed` counts each law's runs without figures; their pairs cost what a failed run does and are left out
    of the other figures.
    """

    seeds: tuple[int, ...]
    differences: dict[str, dict[str, Paired]]
    failed: dict[str, int]
    pair: Pair = USUAL

    @property
    def title(self) -> str:
        """Return which law is set against which."""
        return " - ".join(self.pair)

    def to_json(self) -> dict[str, Any]:
        """Return the verdict for a JSON document."""
        return {
            "seeds": list(self.seeds),
            "failed": self.failed,
            self.title: {
                scenario: {name: result.to_json() for name, result in table.items()}
                for scenario, table in self.differences.items()
            },
        }


def held_out_trials(
    gains: Gains,
    repeats: int,
    scenarios: Sequence[str] = HELD_OUT_SCENARIOS,
    laws: Sequence[str] = USUAL,
) -> list[Trial]:
    """Return the runs of the held-out tape, all laws with equal seeds."""
    return [
        Trial(outer, gains, Case(scenario, "calm", "asg-ism"), seed)
        for seed in range(HELD_OUT_SEED, HELD_OUT_SEED + repeats)
        for scenario in scenarios
        for outer in laws
    ]


def pairs_of(tuned: Sequence[str]) -> list[Pair]:
    """Return which laws are set against which: the tuned ones, and each of them against the built-in."""
    if set(tuned) == set(USUAL):
        return [USUAL]
    found: list[Pair] = []
    for law in tuned:
        for other in (*USUAL[::-1], *tuned):
            if other != law and (other, law) not in found and (law, other) not in found:
                found.append((law, other))
    return found


def _refuse_tuned_on(trials: Sequence[Trial], seeds_seen: Sequence[int]) -> None:
    seen = sorted({trial.seed for trial in trials} & set(seeds_seen))
    if seen:
        raise BadInput(
            f"held-out seeds {', '.join(map(str, seen))}: the search has run them; a verdict is spoken on "
            f"runs that no candidate has seen, such as seeds from {HELD_OUT_SEED} up"
        )


def judge(
    trials: Sequence[Trial],
    figures: Sequence[Figures],
    pair: Pair = USUAL,
    seeds_seen: Sequence[int] = Plan().seeds,
    cost: Cost = USUAL_COST,
) -> Verdict:
    """Return the verdict on the runs of a held-out tape; runs of other laws are left aside.

    `cost` is the one that the search has minimised. Raises BadInput where a run is one that the search
    has made (`seeds_seen`).
    """
    law, other = pair
    _refuse_tuned_on(trials, seeds_seen)
    own = [place for place, trial in enumerate(trials) if trial.outer in pair]
    trials, figures = [trials[place] for place in own], [figures[place] for place in own]
    values: dict[str, dict[str, dict[str, list[float]]]] = {
        scenario: {name: {outer: [] for outer in pair} for name in JUDGED}
        for scenario in (ALL_SCENARIOS, *dict.fromkeys(trial.case.scenario for trial in trials))
    }
    # The scenarios share their seeds: over all of them it is the seeds that were drawn.
    tapes = {
        scenario: [
            (trial.seed, 0)
            for trial in trials
            if trial.outer == other and scenario in {ALL_SCENARIOS, trial.case.scenario}
        ]
        for scenario in values
    }
    for trial, found in zip(trials, figures, strict=True):
        known = {**found, "cost": cost.of(found)}
        for scenario in (ALL_SCENARIOS, trial.case.scenario):
            for name in JUDGED:
                values[scenario][name][trial.outer].append(known.get(name, math.nan))
    return Verdict(
        seeds=tuple(dict.fromkeys(trial.seed for trial in trials)),
        differences={
            scenario: {
                name: paired(by_law[other], by_law[law], tapes[scenario])
                for name, by_law in table.items()
            }
            for scenario, table in values.items()
        },
        failed={
            outer: sum(
                not found for trial, found in zip(trials, figures, strict=True)
                if trial.outer == outer
            )
            for outer in pair
        },
        pair=pair,
    )  # fmt: skip


def with_verdict(gains: Gains, verdict: Verdict) -> Gains:
    """Return the gains with what the held-out tape says of their cost in their origin."""
    cost = verdict.differences[ALL_SCENARIOS]["cost"]
    judged = [name for name in verdict.differences if name != ALL_SCENARIOS]
    told: dict[str, str | int | float] = {
        "held_out": f"{', '.join(judged)}, seeds {verdict.seeds[0]} to {verdict.seeds[-1]}",
        f"held_out_cost_{verdict.pair[1]}": round(cost.baseline_mean, 4),
        f"held_out_cost_{verdict.pair[0]}": round(cost.other_mean, 4),
        "held_out_cost_difference": f"{cost.mean:.4f}, 95 % {cost.interval.low:.4f} to "
        f"{cost.interval.high:.4f}",
    }
    return gains.model_copy(update={"origin": gains.origin | told})
