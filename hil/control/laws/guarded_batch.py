"""What a vectorised law from outside may not do to its runs: as `hil.control.laws.guard`, for all at once.

A run whose command may not be sent ends by itself; the others go on. What a call raises ends all runs that it
was for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hil.control.laws.guard import EXCESS
from hil.core.batch import CommandBatch, asked

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from hil.control.laws.guard import GuardedLaw
    from hil.core.batch import Array, OuterLawBatch
    from hil.core.errors import RigFault

_SPEEDS = ("eta1_m_s", "theta_dot_rad_s")
_NUMBERS = "fiub"  # kinds of numpy's that are numbers: no complex ones, texts or dates


class GuardedBatch:
    """The laws of several runs, all of one class, stepped by what that class makes of them."""

    def __init__(self, laws: Sequence[GuardedLaw]) -> None:
        self._laws = laws
        first = laws[0]
        self._batch: OuterLawBatch = first.call("batch", lambda: first.batch_of(laws))
        limits = [(law.limits.eta1_max_m_s, law.limits.theta_dot_max_rad_s) for law in laws]
        self._most = np.array(limits).T * EXCESS

    def step(
        self, where: NDArray[np.intp], rows: Array, reset: NDArray[np.bool_]
    ) -> tuple[Array, list[str], dict[int, RigFault]]:
        """Return the commands of the laws at `where`, and what ends which of these runs.

        `rows` are those of `hil.core.batch.asked`; `reset` are those that start anew. Rows of the
        commands are forward speed, turn rate, and one for each of the names, those of the trace. Raises
        RigFault for all.
        """
        guard = self._laws[0]
        where.setflags(write=False)  # as the rest of what is asked
        reference, estimate, dt_s = asked(rows)
        if reset.any():
            anew = asked(rows[:, reset])[:2]
            guard.call("reset_batch", lambda: self._batch.reset_batch(where[reset], *anew))
        command = guard.call(
            "step_batch",
            lambda: self._batch.step_batch(where, reference, estimate, dt_s),
            runs=len(where),
        )
        if not isinstance(command, CommandBatch):
            raise guard.fault(
                f"step_batch returned {type(command).__name__}, a CommandBatch is needed"
            )
        if not isinstance(command.trace, Mapping):
            raise guard.fault(
                f"step_batch returned a trace that is {type(command.trace).__name__}, not a dict"
            )
        names = [*command.trace]
        given = np.empty((2 + len(names), len(where)))
        for row, name in enumerate((*_SPEEDS, *names)):
            values = getattr(command, name) if row < 2 else command.trace[name]
            self._fill(given[row], name if row < 2 else f"trace[{name!r}]", values)
        return given, names, self._faults(where, given)

    def _fill(self, row: Array, name: str, values: object) -> None:
        """Take one number a run; one number alone stands for all."""
        try:
            given = np.asarray(values)
            if given.dtype.kind not in _NUMBERS:
                raise TypeError
            row[:] = given
        except (TypeError, ValueError):
            shape = getattr(values, "shape", None)
            said = f"an array of shape {shape}" if shape is not None else repr(values)
            raise self._laws[0].fault(
                f"step_batch returned {name} = {said}, {row.size} numbers are needed"
            ) from None

    def _faults(self, where: NDArray[np.intp], given: Array) -> dict[int, RigFault]:
        within = np.abs(given[:2]) <= self._most[:, where]  # False for NaN
        if within.all():
            return {}
        faults: dict[int, RigFault] = {}
        for column in np.flatnonzero(~within.all(axis=0)).tolist():
            law = self._laws[where[column]]
            fault = law.refused(float(given[0, column]), float(given[1, column]), "step_batch")
            if fault is not None:
                faults[column] = fault
        return faults


def batches(laws: Sequence[GuardedLaw]) -> list[list[int]]:
    """Return the places of the laws that are stepped together, by what steps them."""
    found: dict[tuple[int, Callable[..., object]], list[int]] = {}
    for place, law in enumerate(laws):
        found.setdefault(law.batch_key, []).append(place)
    return [*found.values()]
