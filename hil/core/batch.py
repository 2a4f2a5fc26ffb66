"""Values of an outer law that steps several runs at once: as hil.core.types, an array for each number.

An array has one entry a run, in the order of `where`. Pairs are pairs of arrays, so that a line of a law that
steps one run says the same of many: `(x_m, y_m) = estimate.z1_m`. What is given is only to be read.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

# So many runs side by side feed the lanes of one core (docs/performance.md).
SIDE_BY_SIDE = 32

Array = NDArray[np.float64]
Pairs = tuple[Array, Array]


class PoseBatch(NamedTuple):
    """Poses of the centres of mass: world X, Y in m, heading in rad."""

    x_m: Array
    y_m: Array
    theta_rad: Array


class EstimateBatch(NamedTuple):
    """States of the robots, as `hil.core.types.Estimate` has one; `driven_hard` is of bool."""

    t_host_s: Array
    pose: PoseBatch
    eta1_m_s: Array
    theta_dot_rad_s: Array
    z1_m: Pairs
    z2_m_s: Pairs
    sides_at_limit: Pairs
    driven_hard: NDArray[np.bool_]


class ReferenceBatch(NamedTuple):
    """Desired flat outputs and their first three time derivatives, world axes."""

    z1_m: Pairs
    z1_dot_m_s: Pairs
    z1_ddot_m_s2: Pairs
    z1_dddot_m_s3: Pairs


@dataclass(frozen=True, slots=True)
class CommandBatch:
    """Body speeds wanted of the robots, and every internal term worth plotting in `trace`."""

    eta1_m_s: Array
    theta_dot_rad_s: Array
    trace: Mapping[str, Array] = field(default_factory=dict)


class OuterLawBatch(Protocol):
    """An outer law of several runs; `where` are the places of those whose tick it is, rising, among its laws.

    What it does to a run is what the run's own law does, and depends on no other run.
    """

    def reset_batch(
        self, where: NDArray[np.intp], reference: ReferenceBatch, estimate: EstimateBatch
    ) -> None:
        """Start anew those at `where`."""

    def step_batch(
        self,
        where: NDArray[np.intp],
        reference: ReferenceBatch,
        estimate: EstimateBatch,
        dt_s: Array,
    ) -> CommandBatch:
        """Return the commands of those at `where` for the next `dt_s`."""


class MakesBatches(Protocol):
    """An outer law whose class can step several runs at once."""

    @classmethod
    def batch(cls, laws: Sequence[Self]) -> OuterLawBatch:
        """Return what does for each run what its law, just made, would do."""


# Rows of what a law is asked, one number a run: those of `asked` in their order.
ROWS = 22


def asked(rows: Array) -> tuple[ReferenceBatch, EstimateBatch, Array]:
    """Return reference, estimate and step of several runs from an array of ROWS rows, a column a run."""
    t, x, y, theta, eta1, turn, *rest, dt_s = rows
    z1, z2, sides = (rest[0], rest[1]), (rest[2], rest[3]), (rest[4], rest[5])
    pose, hard = PoseBatch(x, y, theta), rest[6] != 0.0
    reference = ReferenceBatch(*zip(rest[7::2], rest[8::2], strict=True))
    return reference, EstimateBatch(t, pose, eta1, turn, z1, z2, sides, hard), dt_s


def column_of(reference: Any, estimate: Any, dt_s: float) -> list[float]:
    """Return one run's column of such an array, from values of hil.core.types."""
    pose = estimate.pose
    return [
        estimate.t_host_s,
        pose.x_m,
        pose.y_m,
        pose.theta_rad,
        estimate.eta1_m_s,
        estimate.theta_dot_rad_s,
        *estimate.z1_m,
        *estimate.z2_m_s,
        *estimate.sides_at_limit,
        float(estimate.driven_hard),
        *reference.z1_m,
        *reference.z1_dot_m_s,
        *reference.z1_ddot_m_s2,
        *reference.z1_dddot_m_s3,
        dt_s,
    ]
