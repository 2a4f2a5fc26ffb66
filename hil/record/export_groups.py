"""The columns of a run that an export makes topics of."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hil.record.schema import SAMPLE_COLUMNS

if TYPE_CHECKING:
    from hil.record.reader import RunRecord
    from hil.record.schema import Column


def groups(run: RunRecord) -> dict[str, list[Column]]:
    """Return the columns that have any value, by their group; time is in none of them."""
    found: dict[str, list[Column]] = {}
    for column in SAMPLE_COLUMNS:
        values = run.samples[column.name]
        if column.name != "t_s" and any(map(math.isfinite, values.tolist())):
            found.setdefault(column.group, []).append(column)
    return found
