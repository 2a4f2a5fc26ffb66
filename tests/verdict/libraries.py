"""Compare samplers of Optuna and algorithms of pymoo on the same budget: hypervolume of their fronts.

    python -m tests.verdict.libraries [CANDIDATES] [SEEDS]

Needs both (`pip install optuna pymoo`). Prints one line a search and the means; docs/verdict.md has them.
"""

import json
import math
import sys
import time

import numpy as np

from hil.config.control import ControlConfig
from hil.config.deck import load_deck
from hil.core.registries import OUTER_LAWS
from hil.study import front_search
from hil.study.campaign.workers import Pool
from hil.study.front_search import Candidate, Front, search_front, start_of
from hil.study.suite import Job, OnSuite, Yardstick, scenarios_of, spread_over, together
from hil.study.tune import decode

LAWS = ("asg-ism", "pid")
CELLS = 4


def with_pymoo(law, box, scores_of, candidates, seed):
    """Search the same box with pymoo's NSGA-II, the start among the first population."""
    from pymoo.algorithms.moo.nsga2 import NSGA2  # noqa: PLC0415 - the search itself does without
    from pymoo.core.problem import Problem  # noqa: PLC0415 - the search itself does without
    from pymoo.optimize import minimize  # noqa: PLC0415 - the search itself does without

    tried = []

    class Gains(Problem):
        def __init__(self):
            super().__init__(n_var=len(box), n_obj=3, xl=0.0, xu=1.0)

        def _evaluate(self, x, out, *_args, **_kw):
            values = [decode(box, list(row)) for row in x]
            scores = scores_of(values)
            tried.extend(Candidate(v, s) for v, s in zip(values, scores, strict=True))
            out["F"] = np.log10(np.maximum(np.array(scores), 1e-3))

    first = np.random.default_rng(seed).random((12, len(box)))
    first[0] = start_of(box)
    minimize(
        Gains(), NSGA2(pop_size=12, n_offsprings=front_search.BATCH, sampling=first),
        ("n_eval", candidates), seed=seed,
    )  # fmt: skip
    return Front(law, seed, tuple(tried[:candidates]))


def with_optuna(name):
    def search(law, box, scores_of, candidates, seed):
        chosen = {
            "TPE": lambda o, s: o.samplers.TPESampler(
                seed=s, multivariate=True, constant_liar=True, n_startup_trials=12
            ),
            "NSGA-II": lambda o, s: o.samplers.NSGAIISampler(seed=s, population_size=12),
        }[name]
        kept, front_search.sampler = front_search.sampler, chosen
        try:
            return search_front(law, box, scores_of, candidates=candidates, seed=seed)
        finally:
            front_search.sampler = kept

    return search


METHODS = {
    "Optuna TPE": with_optuna("TPE"),
    "Optuna NSGA-II": with_optuna("NSGA-II"),
    "pymoo NSGA-II": with_pymoo,
}


def main():
    candidates, seeds = (int(x) for x in (sys.argv[1:] + ["48", "3"][len(sys.argv) - 1 :])[:2])
    deck = load_deck("suite")
    cells = spread_over(deck.search_cells(), CELLS)
    scenarios = scenarios_of(deck, cells)
    base = ControlConfig().active_gains
    with Pool(OnSuite(scenarios), 2) as pool:

        def make(jobs):
            return pool.map(jobs, lambda *_: None)

        yard = Yardstick.measured(sorted({cell.scenario for cell in cells}), make)
        table = {}
        for law in LAWS:
            entry = OUTER_LAWS.get(law)

            def scores_of(tried, entry=entry, law=law):
                jobs = [
                    Job(law, base.with_values(entry, v), str(c), 1) for v in tried for c in cells
                ]
                found = [yard.scores(j.cell, f) for j, f in zip(jobs, make(jobs), strict=True)]
                return [together(found[i : i + CELLS]) for i in range(0, len(found), CELLS)]

            for method, search in METHODS.items():
                for seed in range(1, seeds + 1):
                    begun = time.monotonic()
                    front = search(law, entry.search, scores_of, candidates, seed)
                    table.setdefault((law, method), []).append(front.volume)
                    line = {"law": law, "method": method, "seed": seed, "candidates": candidates,
                            "hypervolume": round(front.volume, 4), "front": len(front.best),
                            "seconds": round(time.monotonic() - begun)}  # fmt: skip
                    print(json.dumps(line), flush=True)
    for (law, method), volumes in table.items():
        spread = np.std(volumes, ddof=1) / math.sqrt(len(volumes)) if len(volumes) > 1 else math.nan
        print(f"{law}, {method}: {np.mean(volumes):.4f} +- {spread:.4f}")


if __name__ == "__main__":
    main()
