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
    from hil.runs.together import Result

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
        return self.many([job])[0]

    def many(self, jobs: Sequence[tuple[Scenario, str, int]]) -> list[Outcome]:
        """Return the same of runs made side by side."""
        from pathlib import Path  # noqa: PLC0415 - a worker's own

        from hil.runs.spec import RunSpec  # noqa: PLC0415
        from hil.runs.together import execute_together  # noqa: PLC0415

        made = execute_together(
            [
                RunSpec(scenario, "twin", self.camera, law, self.inner, seed, Path(),
                        command="hil falsify")
                for scenario, law, seed in jobs
            ]
        )  # fmt: skip
        return [_outcome(job[0], result) for job, result in zip(jobs, made, strict=True)]


def _outcome(scenario: Scenario, made: Result) -> Outcome:
    if isinstance(made, BadInput | RigFault):
        return Outcome(FURTHEST, str(made), refused=True)
    if isinstance(made, BaseException):
        raise made
    t_s = made.samples["t_s"]
    if made.manifest.outcome == "complete":
        return Outcome(*margin_of(made.verdicts()))
    if t_s.size < 2:
        return Outcome(FURTHEST, made.manifest.outcome_detail, refused=True)
    left = 1.0 - float(t_s[-1] - t_s[0]) / scenario.duration_s
    return Outcome(_NO_FIGURE - max(left, 0.0), made.manifest.outcome_detail)
