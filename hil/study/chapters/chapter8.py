"""Chapter 8 as rows: the circle of section 8.9 with ideal sensing, and the three experiments."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path

from hil.config.deck import load_deck
from hil.config.load import load_scenario
from hil.runs.execute import RunSpec, execute_in_memory
from hil.study import ideal_circle
from hil.study.chapters.deck import Belief, Claim, Measure
from hil.study.chapters.quantities import FIGURES
from hil.study.chapters.runs import Progress, RowResult

LAWS = ("pid", "asg-ism")
_LAST_S = 10.0

CLAIMS = (
    Claim(
        chapter="8",
        claim="the square norms of the tracking error on the circle keep the same values (PID over ISM)",
        where="section 8.9, figure 8.3",
        printed="similar",
        measure=Measure(figure="ise_m2_s", row="circle pid", over="circle asg-ism"),
        reproduced=(0.8, 1.25),
        note="with the signs of A and B repaired ISM is the better; the gains of table 8.2 are not "
        "those of (8.22)",
    ),
    *(
        Claim(
            chapter="8",
            claim=f"experiment {number}: ISM ends nearer to the desired point (PID over ISM)",
            where=f"section 8.10.4, figure {figure}",
            printed="figure only",
            measure=Measure(
                figure="worst_m", row=f"scenario-{number} pid", over=f"scenario-{number} asg-ism"
            ),
            reproduced=(1.05, 1e9),
            undecidable="start, target, gains and delays of the experiments are not printed",
        )
        for number, figure in ((1, "8.11"), (2, "8.15"), (3, "8.19"))
    ),
)
BELIEF = Belief(
    chapter="8",
    text="""On the linearised model with ideal sensing the sliding mode has <<circle asg-ism ise_m2_s>>
    m² s on the circle of (8.23) and state feedback <<circle pid ise_m2_s>> m² s, under the same
    disturbance and with the signs of A and B repaired; with the printed signs both leave the circle.
    On the twin, with camera, delays and restrictions, both laws end within about a millimetre of the
    point, and which is nearer in one run is chance (docs/statistics.md).""",
)


def rows(progress: Progress | None = None) -> list[RowResult]:
    """Return the rows of chapter 8 (two runs on the circle, six on the twin; 10 to 20 s)."""
    scenarios = load_deck("thesis").scenarios
    work = [partial(circle_row, law) for law in LAWS]
    work += [partial(_experiment, name, law) for name in scenarios for law in LAWS]
    found: list[RowResult] = []
    for run in work:
        found.append(run())
        if progress is not None:
            progress(len(found), len(work))
    return found


def circle_row(law: str) -> RowResult:
    """Return section 8.9 with one law."""
    run = ideal_circle.run_circle(law)
    complete = math.isclose(run.t_s[-1], 80.0, abs_tol=0.1)
    label = "section 8.9, disturbed, ideal sensing; worst error of the last 10 s"
    return _row(
        f"circle {law}",
        label,
        law,
        "complete" if complete else "diverged",
        run.t_s[-1],
        run.ise_m2_s,
        run.worst_m(_LAST_S),
    )


def _experiment(name: str, law: str) -> RowResult:
    spec = RunSpec(
        scenario=load_scenario(name, ()),
        target="twin",
        camera="pose",
        outer=law,
        inner="asg-ism",
        seed=1,
        out=Path("unused"),
        rerun=False,
    )
    record = execute_in_memory(spec)
    values = record.figures().values
    return _row(
        f"{name} {law}",
        "section 8.10.4 on the twin, drawn poses, seed 1; worst error of the last second",
        law,
        record.manifest.outcome,
        float(record.samples["t_s"][-1]),
        values["ise_m2_s"],
        values["delta1_worst_last_second_m"],
    )


def _row(
    name: str, label: str, law: str, end: str, end_s: float, ise_m2_s: float, worst_m: float
) -> RowResult:
    figures: dict[str, float | None] = dict.fromkeys(FIGURES)
    figures["ise_m2_s"] = ise_m2_s if math.isfinite(ise_m2_s) else None
    figures["worst_m"] = worst_m if math.isfinite(worst_m) else None
    return RowResult(name, "repaired", label, law, end, end_s, figures)
