"""Judge the gains that ship anew in the data of the verdicts: `python -m tests.verdict.shipped`.

After new gains. The fronts stay as they were searched, and so does all that the verdict says. Refused
where the yardstick is another one by now: then all of it is to be made anew, with the command that
stands in the data.
"""

import json
import math
import os

from hil.core.files import replace_file
from hil.study.campaign.workers import Pool
from hil.study.suite import OnSuite, Yardstick
from hil.study.verdict import Field, VerdictPlan, shipped_gains, shipped_scores
from tests.verdict.pages import ROOT

FILES = (ROOT / "hil/data/verdict.json", *sorted((ROOT / "hil/data/verdicts").glob("*.json")))


def plan_of(data):
    """Return the plan that data were made by."""
    lists = {key: tuple(v) if isinstance(v, list) else v for key, v in data["plan"].items()}
    return VerdictPlan(**lists)


def same(figures, kept):
    """Return whether figures are those that are kept, but for the rounding of sums on the way."""
    return figures.keys() == kept.keys() and all(
        math.isclose(value, kept[name], rel_tol=1e-9) for name, value in figures.items()
    )


def judged_anew(data, workers=1):
    """Return the data with the laws judged anew whose gains are others than those that the data judge.

    Raises SystemExit with another yardstick.
    """
    now = json.loads(json.dumps(shipped_gains(data["laws"])))
    then = data.get("shipped_gains", {})
    plan = plan_of(data)
    field = Field.of("suite", plan, [law for law in data["laws"] if then.get(law) != now[law]])
    with Pool(OnSuite(field.scenarios), workers) as pool:

        def make(jobs):
            return pool.map(jobs, lambda *_: None)

        yard = Yardstick.measured(field.tasks, make)
        if any(
            not same(figures, data["yardstick"][task]) for task, figures in yard.figures.items()
        ):
            raise SystemExit("the yardstick is another one by now: make the verdict anew")
        found = shipped_scores(field, plan, yard, make) if then != now else {}
    rows = {law: found.get(law, data["shipped"].get(law)) for law in data["laws"]}
    return data | {"shipped": rows, "shipped_gains": now}


if __name__ == "__main__":
    for path in FILES:
        made = judged_anew(json.loads(path.read_text(encoding="utf-8")), os.cpu_count() or 1)
        replace_file(path, json.dumps(made, indent=1, ensure_ascii=False).encode() + b"\n")
