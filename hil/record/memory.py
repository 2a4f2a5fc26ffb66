"""A run kept in memory instead of in a folder: for replays and for campaigns of many runs."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from hil.analysis import metrics
from hil.record.reader import Event, RunRecord
from hil.record.schema import FRAME_NAMES

if TYPE_CHECKING:
    from hil.core.rig import Picture
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

    def frame(self, row: Sequence[float], image: Picture | None = None) -> None:
        """Take one camera frame in the order of schema.FRAME_NAMES, and its image."""

    def event(self, t_s: float, kind: str, text: str) -> None:
        """Take one line of what happened."""

    def identify(self, dialect_hash: str, parameter_hash: str, firmware_build_id: str) -> None:
        """Take who the board said it is."""


class Rows:
    """A table as one typed array, 8 bytes a value: a tuple of numbers takes four times that."""

    def __init__(self, width: int) -> None:
        self._width = width
        self._values = array("d")

    def append(self, row: Sequence[float]) -> None:
        """Take one row; raises ValueError for one of another width."""
        if len(row) != self._width:
            raise ValueError(f"a row of {len(row)} values, the table has {self._width} columns")
        self._values.extend(row)

    def take(self, rows: bytes) -> None:
        """Append whole rows as they lie in memory, 8 bytes a value."""
        if len(rows) % (8 * self._width):
            raise ValueError(f"{len(rows)} bytes are no rows of {self._width} values")
        self._values.frombytes(rows)

    def __len__(self) -> int:
        """Return how many rows there are."""
        return len(self._values) // self._width

    def __getitem__(self, place: int) -> Sequence[float]:
        """Return one row, from the end for a place below 0."""
        place = range(len(self))[place]
        return self._values[place * self._width : (place + 1) * self._width]

    def columns(self, names: Sequence[str]) -> Columns:
        """Return the table by column."""
        table = np.frombuffer(self._values, np.float64).reshape(len(self), self._width)
        return dict(zip(names, table.T.copy(), strict=True))


@dataclass(slots=True)
class MemoryRecorder:
    """Keeps rows as they come; images are not kept, link frames only with `keep_link`."""

    manifest: Manifest
    keep_link: bool = False
    rows: Rows = field(init=False)
    frames: Rows = field(default_factory=lambda: Rows(len(FRAME_NAMES)))
    events: list[Event] = field(default_factory=list)
    link_frames: list[tuple[float, bytes]] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Make room for the columns that the manifest names."""
        self.rows = Rows(len(self.manifest.sample_names))

    def start(self, unix_us: int) -> None:
        """Leave the manifest's wall time: a replay's is that of its record."""

    def append(self, row: Sequence[float]) -> None:
        """Take one outer tick in the order of the manifest's sample_names."""
        self.rows.append(row)

    def frame(self, row: Sequence[float], image: Picture | None = None) -> None:  # noqa: ARG002
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
        stats = link or metrics.LinkStats()
        ended = {
            "outcome": outcome,
            "outcome_detail": detail,
            "tick_count": len(self.rows),
            "link": {name: float(getattr(stats, name)) for name in stats.__dataclass_fields__},
        }
        return RunRecord(
            path=Path(),
            manifest=self.manifest.model_copy(update=ended),
            samples=self.rows.columns(self.manifest.sample_names),
            frames=self.frames.columns(FRAME_NAMES),
            events=tuple(self.events),
        ).with_own_figures()
