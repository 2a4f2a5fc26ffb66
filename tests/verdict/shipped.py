"""Judge the gains that ship anew in the data of the verdicts: `python -m tests.verdict.shipped`.

After new gains. The fronts stay as they were searched, and so does all that the verdict says. Refused
where the yardstick is another one by now: then all of it is to be made anew, with the command that
stands in the data.
"""

import json
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


def judged_anew(data, workers=1):
    """Return the data with the gains that ship judged anew; raises SystemExit with another yardstick."""
    plan = plan_of(data)
    field = Field.of("suite", plan, data["laws"])
    with Pool(OnSuite(field.scenarios), workers) as pool:

        def make(jobs):
            return pool.map(jobs, lambda *_: None)

        yard = Yardstick.measured(field.tasks, make)
        if any(dict(now) != data["yardstick"][task] for task, now in yard.figures.items()):
            raise SystemExit("the yardstick is another one by now: make the verdict anew")
        found = shipped_scores(field, plan, yard, make)
    return data | {"shipped": found, "shipped_gains": shipped_gains(field.laws)}


if __name__ == "__main__":
    for path in FILES:
        made = judged_anew(json.loads(path.read_text(encoding="utf-8")), os.cpu_count() or 1)
        replace_file(path, json.dumps(made, indent=1, ensure_ascii=False).encode() + b"\n")
