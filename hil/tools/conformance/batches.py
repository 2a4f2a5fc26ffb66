"""What a law that steps several runs at once must do: for each what its own law does, in any company."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hil.config.control import OuterLimits
from hil.core.batch import CommandBatch, OuterLawBatch, asked, column_of
from hil.core.types import OuterCommand, OuterLaw
from hil.tools.conformance.floor import Episode
from hil.tools.conformance.report import Violation

CHECK = "many at once"
# What rounding may make of a command, share of its limit: sines and roots differ in their last digits.
ROUNDING = 1e-9
# Episodes that begin later than the others, so that not every run is asked each time.
_LATE_TICKS = 7

# Forward speed, turn rate and trace of each tick of one run.
Steps = list[tuple[float, float, dict[str, float]]]


def makes_batches(law: object) -> bool:
    """Say whether a law's class can step several runs at once."""
    return callable(getattr(type(law), "batch", None))


def agreement(
    make: Callable[[], OuterLaw],
    episodes: Sequence[Episode],
    alone: Sequence[Sequence[OuterCommand]],
    limits: OuterLimits,
    dt_s: float,
) -> str:
    """Return how well the commands of all episodes at once agree with `alone`, those of `step`.

    In other company, and after a reset, they must be the same to the bit. Raises Violation.
    """
    batch = _batch_of(make, len(episodes))
    many = _steps(batch, episodes, dt_s)
    _require_same(many, _steps(batch, episodes, dt_s), episodes, "again after a reset")
    order = [*range(len(episodes))][::-1]
    turned = _steps(_batch_of(make, len(order)), [episodes[i] for i in order], dt_s)
    _require_same(many, [turned[i] for i in order], episodes, "in another order")
    for one, episode in zip(many, episodes, strict=True):
        single = _steps(_batch_of(make, 1), [episode], dt_s)
        _require_same([one], single, [episode], "alone in its batch")
    worst = max(
        _worst(one, two, episode, limits)
        for one, two, episode in zip(many, alone, episodes, strict=True)
    )
    return "as step to the last bit" if worst == 0.0 else f"as step to {worst:.1g} of the limits"


def _batch_of(make: Callable[[], OuterLaw], count: int) -> OuterLawBatch:
    laws = [make() for _ in range(count)]
    kind: Any = type(laws[0])
    batch: OuterLawBatch = kind.batch(laws)
    return batch


def _steps(batch: OuterLawBatch, episodes: Sequence[Episode], dt_s: float) -> list[Steps]:
    """Return what the batch commands in each episode; every other one begins some ticks later."""
    found: list[Steps] = [[] for _ in episodes]
    begins = [_LATE_TICKS * (place % 2) for place in range(len(episodes))]
    ends = [begin + len(one.estimates) for begin, one in zip(begins, episodes, strict=True)]
    for tick in range(max(ends)):
        where = [i for i in range(len(episodes)) if begins[i] <= tick < ends[i]]
        if not where:
            continue
        rows = _rows(episodes, where, [tick - begins[i] for i in where], dt_s)
        new = [column for column, i in enumerate(where) if tick == begins[i]]
        _step(batch, np.array(where, np.intp), rows, new, found)
    return found


def _rows(
    episodes: Sequence[Episode], where: Sequence[int], ticks: Sequence[int], dt_s: float
) -> NDArray[np.float64]:
    columns = [
        column_of(episodes[i].references[tick], episodes[i].estimates[tick], dt_s)
        for i, tick in zip(where, ticks, strict=True)
    ]
    rows = np.array(columns).T
    rows.setflags(write=False)
    return rows


def _step(
    batch: OuterLawBatch,
    where: NDArray[np.intp],
    rows: NDArray[np.float64],
    new: Sequence[int],
    found: list[Steps],
) -> None:
    if new:
        batch.reset_batch(where[new], *asked(rows[:, new])[:2])
    command = batch.step_batch(where, *asked(rows))
    if not isinstance(command, CommandBatch):
        raise Violation(
            f"step_batch returned {type(command).__name__}, a hil.CommandBatch is needed"
        )
    values = [command.eta1_m_s, command.theta_dot_rad_s, *command.trace.values()]
    columns = [np.broadcast_to(np.asarray(value, float), where.shape) for value in values]
    for column, i in enumerate(where):
        eta1, turn, *terms = (float(values[column]) for values in columns)
        found[i].append((eta1, turn, dict(zip(command.trace, terms, strict=True))))


def _require_same(
    one: Sequence[Steps], two: Sequence[Steps], episodes: Sequence[Episode], what: str
) -> None:
    for a, b, episode in zip(one, two, episodes, strict=True):
        for tick, (now, then) in enumerate(zip(a, b, strict=True)):
            if repr(now) != repr(then):
                raise Violation(
                    f"{what}: {episode.name}, tick {tick}: {then[0]!r} m/s, {then[1]!r} rad/s, with the "
                    f"others {now[0]!r} m/s, {now[1]!r} rad/s"
                )


def _worst(
    many: Steps, alone: Sequence[OuterCommand], episode: Episode, limits: OuterLimits
) -> float:
    """Return the largest difference as a share of the limits; raises Violation beyond rounding."""
    worst = 0.0
    for tick, ((eta1, turn, trace), step) in enumerate(zip(many, alone, strict=True)):
        if set(trace) != set(step.trace):
            raise Violation(
                f"{episode.name}, tick {tick}: its trace has {', '.join(sorted(trace)) or 'nothing'}, "
                f"that of step {', '.join(sorted(step.trace)) or 'nothing'}"
            )
        off = max(
            abs(eta1 - step.eta1_m_s) / limits.eta1_max_m_s,
            abs(turn - step.theta_dot_rad_s) / limits.theta_dot_max_rad_s,
        )
        worst = max(worst, off)
        if not off <= ROUNDING:
            raise Violation(
                f"{episode.name}, tick {tick}: step_batch returned {eta1:.9g} m/s, {turn:.9g} rad/s, step "
                f"{step.eta1_m_s:.9g} m/s, {step.theta_dot_rad_s:.9g} rad/s"
            )
        for name, value in trace.items():
            told = float(step.trace[name])
            if not np.isclose(value, told, rtol=1e-6, atol=1e-9, equal_nan=True):
                raise Violation(
                    f"{episode.name}, tick {tick}: trace[{name!r}] = {value:.9g} of step_batch, {told:.9g} "
                    "of step"
                )
    return worst
