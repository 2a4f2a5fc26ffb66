"""What `hil tune` finds for each law on one budget, and what that is worth on tasks it did not see.

    hil tune --out two.toml; hil tune --outer dob-pid --outer backstepping ... --out six.toml
    python -m tests.verdict.equal_search two.toml six.toml

writes the data below and the table of docs/outer-laws.md.
"""

from __future__ import annotations

import json
import os
import sys
import tomllib
from pathlib import Path

from hil.config.control import ControlConfig
from hil.core.registries import OUTER_LAWS
from hil.study.campaign.workers import Pool
from hil.study.suite import OnSuite, Yardstick
from hil.study.verdict import Field, shipped_text
from hil.study.verdict import unseen_scores as scores_of
from tests.verdict.pages import ROOT, filled
from tests.verdict.shipped import plan_of

DATA = ROOT / "tests/data/equal_search.json"
PAGE = ROOT / "docs/outer-laws.md"


def found_in(tree):
    """Return what a gain set of `hil tune` says of each law that it searched."""
    origin = tree["origin"]
    laws = [key.removeprefix("candidates_") for key in origin if key.startswith("candidates_")]
    return {
        law: {
            "candidates": origin[f"candidates_{law}"],
            "cost": origin[f"cost_{law}"],
            "held_out_cost": origin[f"held_out_cost_{law}"],
            "revision": origin["revision"],
            "values": tree[OUTER_LAWS.get(law).key],
        }
        for law in laws
    }


def judged(found, workers=1):
    """Return each law's scores in the unseen cells of the suite: cell -> runs of (accuracy, calm, effort)."""
    plan = plan_of(json.loads(shipped_text()))
    field = Field.of("suite", plan, list(found))
    base = ControlConfig().active_gains
    with Pool(OnSuite(field.scenarios), workers) as pool:

        def make(jobs):
            return pool.map(jobs, lambda *_: None)

        yard = Yardstick.measured(field.tasks, make)
        sets = {
            law: base.with_values(OUTER_LAWS.get(law), one["values"]) for law, one in found.items()
        }
        return {law: scores_of(law, gains, field, plan, yard, make) for law, gains in sets.items()}


def mean_accuracy(cells):
    """Return the mean accuracy over cells, each the mean of its runs; and cells that ended early."""
    means = [sum(run[0] for run in runs) / len(runs) for runs in cells.values()]
    return sum(means) / len(means), sum(mean >= 10.0 for mean in means)


def table(found, shipped):
    """Return the page's table: laws by their cost on held-out seeds."""
    lines = [
        "| law, 301 candidates | cost in the search | on 100 unseen seeds "
        "| accuracy on unseen tasks (ended early) | that of the set that ships |",
        "| --- | --- | --- | --- | --- |",
    ]
    for law, one in sorted(found.items(), key=lambda item: item[1]["held_out_cost"]):
        new, early = mean_accuracy(one["unseen"])
        old, _ = mean_accuracy(shipped[law])
        lines.append(
            f"| {law} | {one['cost']:.2f} | {one['held_out_cost']:.2f} | {new:.2f} ({early} of "
            f"{len(one['unseen'])}) | {old:.2f} |"
        )
    return "\n".join(lines)


def page():
    """Return docs/outer-laws.md as its data have it."""
    shipped = json.loads(shipped_text())["shipped"]
    content = table(json.loads(DATA.read_text(encoding="utf-8")), shipped)
    return filled(PAGE.read_text(encoding="utf-8"), "equal-search", content)


if __name__ == "__main__":
    sets = {}
    for name in sys.argv[1:]:
        sets |= found_in(tomllib.loads(Path(name).read_text(encoding="utf-8")))
    scores = judged(sets, os.cpu_count() or 1)
    made = {law: one | {"unseen": scores[law]} for law, one in sorted(sets.items())}
    DATA.write_text(json.dumps(made, indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(page(), encoding="utf-8")
