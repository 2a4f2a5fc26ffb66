"""A run kept in memory instead of in a folder: for replays and for campaigns of many runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from hil.analysis import metrics
from hil.record.reader import Event, RunRecord
from hil.record.schema import FRAME_NAMES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.record.journal import Columns
    from hil.record.manifest import Manifest, Outcome


class RunSink(Protocol):
    """Where a session puts what happens; times in s since the start of the controlled part."""

    @property
    def link_frame(self) -> Callable[[float, bytes], None]:
        """Take one MAVLink frame with its time."""

    def start(self, unix_us: int) -> None:
        """Take the wall time of t_s = 0, before anything that is dated by it."""

    def append(self, row: Sequence[float]) -> None:
        """Take one outer tick in the order of the manifest's sample_names."""

    def frame(self, row: Sequence[float], image: NDArray[np.uint8] | None = None) -> None:
        """Take one camera frame in the order of schema.FRAME_NAMES, and its image."""

    def event(self, t_s: float, kind: str, text: str) -> None:
        """Take one line of what happened."""

    def identify(self, dialect_hash: str, parameter_hash: str, firmware_build_id: str) -> None:
        """Take who the board said it is."""


@dataclass(slots=True)
class MemoryRecorder:
    """Keeps rows as they come; images are not kept, link frames only with `keep_link`."""

    manifest: Manifest
    keep_link: bool = False
    rows: list[Sequence[float]] = field(default_factory=list)
    frames: list[Sequence[float]] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    link_frames: list[tuple[float, bytes]] = field(default_factory=list)

    def start(self, unix_us: int) -> None:
        """Leave the manifest's wall time: a replay's is that of its record."""

    def append(self, row: Sequence[float]) -> None:
        """Take one outer tick in the order of the manifest's sample_names."""
        self.rows.append(row)

    def frame(self, row: Sequence[float], image: NDArray[np.uint8] | None = None) -> None:  # noqa: ARG002
        """Take one camera frame in the order of schema.FRAME_NAMES."""
        self.frames.append(row)

    def event(self, t_s: float, kind: str, text: str) -> None:
        """Take one line of what happened."""
        self.events.append(Event(t_s, kind, text))

    def link_frame(self, t_s: float, data: bytes) -> None:
        """Take one MAVLink frame."""
        if self.keep_link:
            self.link_frames.append((t_s, data))

    def identify(self, dialect_hash: str, parameter_hash: str, firmware_build_id: str) -> None:
        """Put into the manifest who the board said it is."""
        self.manifest = self.manifest.model_copy(
            update={
                "dialect_hash": dialect_hash,
                "parameter_hash": parameter_hash,
                "firmware_build_id": firmware_build_id,
            }
        )

    def close(
        self, outcome: Outcome, detail: str = "", link: metrics.LinkStats | None = None
    ) -> RunRecord:
        """Return the run; it has no folder, so its path is empty."""
        stats = asdict(link or metrics.LinkStats())
        ended = {
            "outcome": outcome,
            "outcome_detail": detail,
            "tick_count": len(self.rows),
            "link": {key: float(value) for key, value in stats.items()},
        }
        return RunRecord(
            path=Path(),
            manifest=self.manifest.model_copy(update=ended),
            samples=_columns(self.manifest.sample_names, self.rows),
            frames=_columns(FRAME_NAMES, self.frames),
            events=tuple(self.events),
        ).with_own_figures()


def _columns(names: Sequence[str], rows: Sequence[Sequence[float]]) -> Columns:
    table = np.array(rows, dtype=np.float64).reshape(len(rows), len(names))
    return {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(names)}
