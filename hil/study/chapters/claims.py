"""The claims table: what the source says, what comes out here, and whether that reproduces it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hil.core.errors import BadInput
from hil.study.chapters.deck import Claim, Measure
from hil.study.chapters.runs import RowResult

_PLACE = re.compile(r"<<([^<>]+) (\w+)>>")


@dataclass(frozen=True, slots=True)
class ClaimResult:
    """One claim with our value, which is None where there is none."""

    claim: Claim
    value: float | None

    @property
    def verdict(self) -> str:
        """Return reproduced, not reproduced, or not decidable because something is not printed."""
        low, high = self.claim.reproduced
        if self.claim.measure and self.value is not None and low <= self.value <= high:
            return "reproduced"
        if self.claim.undecidable:
            return f"not decidable because {self.claim.undecidable}"
        return "not reproduced"

    def to_json(self) -> dict[str, Any]:
        """Return the claim for JSON and CSV."""
        return {
            "chapter": self.claim.chapter,
            "claim": self.claim.claim,
            "where_printed": self.claim.where,
            "value_printed": self.claim.printed,
            "value_here": self.value,
            "verdict": self.verdict,
            "note": self.claim.note,
        }


def judge(claims: Sequence[Claim], rows: Sequence[RowResult]) -> list[ClaimResult]:
    """Return the claims with the values of these rows."""
    table = {row.name: row for row in rows}
    return [ClaimResult(claim, _value(claim.measure, table)) for claim in claims]


def _value(measure: Measure | None, rows: Mapping[str, RowResult]) -> float | None:
    if measure is None:
        return None
    value = _figure(rows, measure.row, measure.figure)
    if measure.over is None or value is None:
        return value
    below = _figure(rows, measure.over, measure.figure)
    return value / below if below else None


def _figure(rows: Mapping[str, RowResult], name: str, figure: str) -> float | None:
    row = rows.get(name)
    if row is None:
        return None
    if figure not in row.figures:
        raise BadInput(f"figure {figure!r} is unknown; there are {', '.join(row.figures)}")
    return row.figures[figure]


def filled(text: str, rows: Sequence[RowResult]) -> str:
    """Return the text with <<row figure>> and <<row/row figure>> replaced by our values."""
    table = {row.name: row for row in rows}

    def value(match: re.Match[str]) -> str:
        over, figure = match[1].split("/"), match[2]
        measure = Measure(figure=figure, row=over[0], over=over[1] if len(over) > 1 else None)
        return shown(_value(measure, table))

    return _PLACE.sub(value, text)


def shown(value: float | None) -> str:
    """Return a value for a person: two or three digits, nothing where there is none."""
    if value is None:
        return "none"
    size = abs(value)
    return f"{value:.0f}" if 1e3 <= size < 1e5 else f"{value:.3g}"
