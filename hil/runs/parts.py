"""What a session is made of, what it tells on the way, and how it ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Protocol

from hil.analysis.metrics import LinkStats
from hil.record.memory import RunSink

if TYPE_CHECKING:
    from hil.control.references import Reference
    from hil.control.vehicles.vehicle import Vehicle
    from hil.core.clocks import CameraClock
    from hil.core.rig import Rig
    from hil.core.types import Estimate, Estimator, OuterLaw, ReferenceState
    from hil.record.manifest import Outcome
    from hil.record.reader import RunRecord
    from hil.record.timeline import Timeline
    from hil.wire.link import BoardLink
    from vision.looking import Looker

Progress = Callable[[float], None]
# Takes host time, state of the robot, and whether it is armed, once a tick.
Publish = Callable[[float, "Estimate", bool], None]


class Orders(Protocol):
    """What a session asks for orders."""

    def hold(self) -> bool:
        """Return whether the robot is to be kept at rest still, before it is armed."""

    def at_tick(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Take what was ordered since the tick before."""


class NoOrders:
    """Nobody orders anything."""

    def hold(self) -> bool:
        """Return False."""
        return False

    def at_tick(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Do nothing."""


@dataclass(frozen=True, slots=True)
class Parts:
    """What a session is made of."""

    rig: Rig
    link: BoardLink
    camera_clock: CameraClock
    localiser: Looker
    estimator: Estimator
    law: OuterLaw
    reference: Reference
    vehicle: Vehicle
    recorder: RunSink
    timeline: Timeline
    own_terms: tuple[str, ...] = ()  # of the law's trace, kept in columns of their own
    orders: Orders = field(default_factory=NoOrders)  # of an operator, while the run is on


@dataclass(frozen=True, slots=True)
class Ending:
    """How the controlled part ended; `detail` names the cause of a fault."""

    outcome: Literal["complete", "fault", "interrupted"]
    detail: str = ""


class OpenRecord(RunSink, Protocol):
    """A record of one run, in a folder or in memory, until it is closed."""

    def close(self, outcome: Outcome, detail: str = "", link: LinkStats | None = None) -> RunRecord:
        """Finish it and return the run; raises RecordFault where it cannot be finished."""


def closed(record: OpenRecord, ending: Ending, link: BoardLink | None) -> RunRecord:
    """Close the record of a run that ended so; `link` counted its frames, None where there was none yet."""
    stats = _stats(link) if link is not None else None
    return record.close(ending.outcome, ending.detail, stats)


def _stats(link: BoardLink) -> LinkStats:
    counters = link.counters
    return LinkStats(
        frames_sent=link.frames_sent,
        frames_received=counters.frames,
        frames_lost=counters.lost,
        bytes_rejected=counters.skipped_bytes,
    )


@dataclass(frozen=True, slots=True)
class Situation:
    """What the outer law is asked about at one tick; `t_s` counts from the first one."""

    t_s: float
    reference: ReferenceState
    estimate: Estimate
