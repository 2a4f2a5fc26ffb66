"""What each part of a law is worth: the law with one part off against the whole, pair by pair.

Every part is switched off in turn, in the same cells with the same seeds. The cells are those of a
deck that no search has seen (docs/verdict.md).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hil.analysis.multiple import discoveries
from hil.analysis.stats import Paired, paired
from hil.study.parts_off import MEANING, parts_of
from hil.study.suite import Job, Make, Scores, Yardstick

if TYPE_CHECKING:
    from hil.config.gains import Gains

SCORES = Scores._fields


@dataclass(frozen=True, slots=True)
class Worth:
    """A part of a law: score without it minus score of the whole; above 0 the part helps.

    `found` says of each score whether the difference stands when all of a table's are looked at
    together (false discovery rate of 5 %).
    """

    law: str
    part: str
    differences: dict[str, Paired]
    failed: int
    found: dict[str, bool]

    def to_json(self) -> dict[str, Any]:
        """Return the row for a JSON document."""
        return {
            "law": self.law,
            "part": self.part,
            "meaning": MEANING.get(self.part, ""),
            "failed_runs": self.failed,
            "scores": {
                name: result.to_json() | {"discovery": self.found[name]}
                for name, result in self.differences.items()
            },
        }


def ablate(
    laws: Mapping[str, Gains | None],
    cells: Sequence[str],
    seeds: Sequence[int],
    yardstick: Yardstick,
    make: Make,
    parts: Callable[[str], Sequence[str]] = parts_of,
) -> list[Worth]:
    """Return a row for each part of each law; runs are the same cells and seeds throughout."""
    variants = [(law, part) for law in laws for part in ("", *parts(law))]
    jobs = [
        Job(law, laws[law], cell, seed, part)
        for law, part in variants
        for cell in cells
        for seed in seeds
    ]
    figures = make(jobs)
    each = len(cells) * len(seeds)
    tapes = [(cell, seed) for cell in cells for seed in seeds]
    scores: dict[tuple[str, str], list[Scores]] = {}
    failed: dict[tuple[str, str], int] = {}
    for number, variant in enumerate(variants):
        rows = figures[number * each : (number + 1) * each]
        scores[variant] = [
            yardstick.scores(cell, row) for (cell, _), row in zip(tapes, rows, strict=True)
        ]
        failed[variant] = sum(not row for row in rows)
    found = {
        (law, part): {
            name: _by_cell(scores[law, ""], scores[law, part], i, len(seeds))
            for i, name in enumerate(SCORES)
        }
        for law, part in variants
        if part
    }
    names = [(variant, name) for variant in found for name in SCORES]
    stand = discoveries([_p_of(found[variant][name]) for variant, name in names])
    told = dict(zip(names, stand, strict=True))
    return [
        Worth(
            law,
            part,
            found[law, part],
            failed[law, part],
            {name: told[(law, part), name] for name in SCORES},
        )
        for law, part in found
    ]


def _by_cell(whole: Sequence[Scores], off: Sequence[Scores], score: int, seeds: int) -> Paired:
    """Compare cell by cell, each the mean over its seeds: cells are what a task is drawn from."""

    def means(rows: Sequence[Scores]) -> list[float]:
        values = [row[score] for row in rows]
        return [sum(values[i : i + seeds]) / seeds for i in range(0, len(values), seeds)]

    return paired(means(whole), means(off))


def _p_of(result: Paired) -> float:
    return 1.0 if math.isnan(result.rank_p) else result.rank_p
