"""Two measurements of the same figures compared: `hil bench --against FILE`.

FILE is what `hil bench WHAT --json` printed at another revision, or on another machine.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hil.analysis.speed import Figure
from hil.core.errors import BadInput
from hil.tools.bench import FORMAT

_RESAMPLES = 4000
_TAIL = 2.5  # %, on each side of an interval of 95 %


@dataclass(frozen=True, slots=True)
class Ratio:
    """Median now over median then, with its 95 % interval (NaN where a side has one value only)."""

    name: str
    unit: str
    then: float
    now: float
    ratio: float
    low: float
    high: float


def read_history(path: Path, what: str) -> dict[tuple[str, str], list[float]]:
    """Return the values of each figure of a file, by name and unit; raises BadInput."""
    try:
        tree = json.loads(path.read_bytes())
    except OSError as error:
        raise BadInput(f"--against {path}: cannot be read: {error.strerror}") from None
    except ValueError:
        raise BadInput(f"--against {path}: not JSON; give what hil bench --json printed") from None
    try:
        if tree["format"] != FORMAT or tree["what"] != what:
            raise BadInput(
                f"--against {path}: holds {tree['format']} {tree['what']!r}, {FORMAT} {what!r} is "
                "needed"
            )
        return {
            (str(item["name"]), str(item["unit"])): [float(value) for value in item["values"]]
            for item in tree["figures"]
        }
    except (KeyError, TypeError, ValueError):
        raise BadInput(
            f"--against {path}: not a measurement; give what hil bench {what} --json printed"
        ) from None


def compared(found: list[Figure], then: dict[tuple[str, str], list[float]]) -> list[Ratio]:
    """Return the ratio of each figure that both measurements have."""
    return [
        _ratio(figure, then[figure.name, figure.unit])
        for figure in found
        if then.get((figure.name, figure.unit))
    ]


def _ratio(figure: Figure, then: list[float]) -> Ratio:
    """Percentile bootstrap of the ratio of medians, each side drawn anew; the same for the same values."""
    now = np.array(figure.values)
    before = np.array(then)
    middle = float(np.median(before))
    low = high = math.nan
    if now.size > 1 and before.size > 1:
        rng = np.random.default_rng(0)
        drawn = [
            np.median(rng.choice(values, (_RESAMPLES, values.size)), axis=1)
            for values in (now, before)
        ]
        low, high = np.percentile(drawn[0] / drawn[1], (_TAIL, 100.0 - _TAIL)).tolist()
    name, unit = figure.name, figure.unit
    return Ratio(name, unit, middle, figure.median, figure.median / middle, low, high)


def as_list(ratios: list[Ratio]) -> list[dict[str, Any]]:
    """Return what `--json` says of the comparison; an unknown end is null."""
    return [
        {
            "name": r.name, "unit": r.unit, "then": r.then, "now": r.now, "ratio": r.ratio,
            "low": None if math.isnan(r.low) else r.low,
            "high": None if math.isnan(r.high) else r.high,
        }
        for r in ratios
    ]  # fmt: skip
