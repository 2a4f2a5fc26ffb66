"""Figures of merit from a file or a package: what they may not do is end the run that they judge.

One that raises, takes too long or gives no finite number has no value in that run, and a note says so.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hil.core.errors import BadInput
from hil.core.figures import Metric
from hil.core.registries import FIGURES
from hil.core.registry import Entry, in_one_line, place_of
from hil.core.time_limit import TooLongError, time_limit

if TYPE_CHECKING:
    from hil.analysis.metrics import Array, Columns, RunData

# Longest that a figure may take, s: while a record is closed, Ctrl-C waits for it.
TIME_MAX_S = 10.0


@dataclass(frozen=True, slots=True)
class OwnFigures:
    """Values by name, and a line for each figure that has none in this run."""

    values: Mapping[str, float]
    notes: tuple[str, ...] = ()


def compute_own(metrics: Sequence[Metric], run: RunData) -> OwnFigures:
    """Return the values of figures by their declarations; what is not known here has none."""
    values, notes = {}, []
    for metric in metrics:
        try:
            values[metric.name] = value_of(FIGURES.get(metric.name), run)
        except BadInput as error:
            values[metric.name] = math.nan
            notes.append(str(error))
    return OwnFigures(values, tuple(notes))


def value_of(entry: Entry, run: RunData) -> float:
    """Return a figure of a run; raises BadInput that names file, line and what happened."""
    try:
        with time_limit(TIME_MAX_S), np.errstate(all="ignore"):
            value = entry.factory(run)
        number = math.nan if isinstance(value, str) else float(value)
    except TooLongError as error:
        raise _without(entry, f"took longer than {TIME_MAX_S:g} s", error) from None
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # some libraries end what they do by one that is no Exception
        raise _without(entry, f"raised {in_one_line(error)}", error) from None
    if isinstance(value, str) or math.isinf(number):
        raise _without(entry, f"gave {value!r:.60}, a finite number is needed")
    if math.isnan(number):
        raise _without(entry, "gave NaN")
    return number


def _without(entry: Entry, said: str, error: BaseException | None = None) -> BadInput:
    return BadInput(
        f"figure of merit {entry.name} ({place_of(entry, error)}): {said}: it has no value in this run"
    )


class ReadOnly(Mapping[str, "Array"]):
    """Columns that cannot be written to; those of a long run are read when they are asked for."""

    def __init__(self, columns: Columns) -> None:
        self._columns = columns

    def __getitem__(self, name: str) -> Array:
        """Return a column; raises KeyError."""
        values = self._columns[name].view()
        values.flags.writeable = False
        return values

    def __iter__(self) -> Iterator[str]:
        """Yield the names."""
        return iter(self._columns)

    def __len__(self) -> int:
        """Return how many columns there are."""
        return len(self._columns)
