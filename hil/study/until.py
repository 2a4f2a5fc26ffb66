"""Repeats until an interval is narrow enough: what `hil experiment --until-interval` does.

The interval is looked at after 24 repeats, then each time there are half as many again
(`hil.analysis.multiple.looks`), and only its width, never whether it holds zero: so it keeps its coverage.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

from hil.analysis.multiple import looks, narrow_enough
from hil.core.errors import BadInput
from hil.core.figures import require_known
from hil.report.compare import is_judged
from hil.rigs.opening import is_simulated

if TYPE_CHECKING:
    from hil.record.reader import RunRecord
    from hil.runs.execute import RunSpec

Arm = tuple[str, str]


@dataclass(frozen=True, slots=True)
class Until:
    """When to stop: half the interval of each paired difference of `figure` at most `half_width`."""

    figure: str
    half_width: float

    @classmethod
    def of(cls, figure: str, half_width: float, target: str) -> Self:
        """Return the rule; raises BadInput for an unknown figure or a rig whose order is drawn."""
        if not is_simulated(target):
            raise BadInput(
                f"--until-interval on {target}: the order of runs on a rig is drawn for a fixed number of "
                "repeats; give --repeats (`hil power` says how many)"
            )
        return cls(require_known(figure), half_width)

    def parts(self, specs: Sequence[RunSpec], seed: int, most: int) -> Iterator[list[RunSpec]]:
        """Yield the specs of all repeats up to each look; `seed` is the first, `most` how many."""
        for count in looks(most):
            yield [spec for spec in specs if spec.seed < seed + count]

    def reached(self, records: Sequence[RunRecord], say: Callable[[str], None]) -> bool:
        """Say whether every paired difference is known narrowly enough; `say` is told how it stands.

        Raises BadInput where there are no two laws to compare.
        """
        tables = _values(records, self.figure)
        wide = [
            f"{scenario}: {' over '.join(arm)}"
            for scenario, arms in tables.items()
            for arm, values in list(arms.items())[1:]
            if not self._narrow(next(iter(arms.values())), values)
        ]
        repeats = len({record.manifest.seed for record in records})
        if not any(len(arms) > 1 for arms in tables.values()):
            raise BadInput("--until-interval: needs two laws whose difference it can look at")
        state = "narrow enough" if not wide else f"not yet: {'; '.join(wide)}"
        say(f"{repeats} repeats, interval of the difference in {self.figure}: {state}")
        return not wide

    def _narrow(self, one: dict[int, float], two: dict[int, float]) -> bool:
        seeds = [seed for seed in one if seed in two]
        return narrow_enough([two[seed] - one[seed] for seed in seeds], self.half_width)


def _values(records: Sequence[RunRecord], figure: str) -> dict[str, dict[Arm, dict[int, float]]]:
    """Return the figure by scenario, arm and seed; NaN of a run whose pair the report leaves out."""
    found: dict[str, dict[Arm, dict[int, float]]] = {}
    for record in records:
        manifest = record.manifest
        arm = (manifest.outer, manifest.inner)
        value = record.figures().values[figure] if is_judged(record) else math.nan
        by_arm = found.setdefault(manifest.scenario_name, {})
        by_arm.setdefault(arm, {})[manifest.seed] = value
    return found
