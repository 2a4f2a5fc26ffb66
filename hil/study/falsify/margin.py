"""How well a run meets its requirements, as one signed number: the objective of the search."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hil.core.errors import BadInput, RigFault

if TYPE_CHECKING:
    from hil.analysis.metrics import Verdict
    from hil.config.scenario import Scenario

# No margin is further from 0 than this: runs that fail utterly are alike.
FURTHEST = 5.0
_NO_FIGURE = -1.0


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a run came to: its margin, and what that rests on.

    `margin` is at least 0 exactly where all requirements hold. `refused`: values that do not go
    together, or a robot that the camera did not find; such a run says nothing about the law.
    """

    margin: float
    why: str
    refused: bool = False


def margin_of(verdicts: Sequence[Verdict]) -> tuple[float, str]:
    """Return the least margin of a run's requirements and the one that has it.

    A margin is the distance of the figure from its bound over the bound's size (over 1 for a bound of 0):
    below 0 where it is violated, by how much. A figure that does not exist violates by 1.
    """
    if not verdicts:
        return FURTHEST, "no requirement"
    found = [(_one(verdict), verdict.text()) for verdict in verdicts]
    return min(found, key=lambda item: item[0])


def _one(verdict: Verdict) -> float:
    if math.isnan(verdict.value):
        return _NO_FIGURE
    sides = []
    if verdict.maximum is not None:
        sides.append((verdict.maximum - verdict.value) / (abs(verdict.maximum) or 1.0))
    if verdict.minimum is not None:
        sides.append((verdict.value - verdict.minimum) / (abs(verdict.minimum) or 1.0))
    return max(min(*sides, FURTHEST), -FURTHEST)


@dataclass(frozen=True, slots=True)
class OneRun:
    """Makes one run of a law in a scenario and returns its outcome."""

    inner: str = "asg-ism"
    camera: str = "pose"

    def __call__(self, job: tuple[Scenario, str, int]) -> Outcome:
        """Return what a run of (scenario, law, seed) came to."""
        from pathlib import Path  # noqa: PLC0415 - a worker's own

        from hil.runs.execute import RunSpec, execute_in_memory  # noqa: PLC0415

        scenario, law, seed = job
        spec = RunSpec(scenario, "twin", self.camera, law, self.inner, seed, Path(),
                       command="hil falsify")  # fmt: skip
        try:
            record = execute_in_memory(spec)
        except (BadInput, RigFault) as error:
            return Outcome(FURTHEST, str(error), refused=True)
        t_s = record.samples["t_s"]
        if record.manifest.outcome == "complete":
            return Outcome(*margin_of(record.verdicts()))
        if t_s.size < 2:
            return Outcome(FURTHEST, record.manifest.outcome_detail, refused=True)
        left = 1.0 - float(t_s[-1] - t_s[0]) / scenario.duration_s
        return Outcome(_NO_FIGURE - max(left, 0.0), record.manifest.outcome_detail)
