"""A run that somebody watches: whatever the record is given, a watcher is given too.

The record comes first and is the same with a watcher or without. A watcher is called in the control
loop: it takes references and returns.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol

from hil.core.rig import whole

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hil.core.rig import Picture
    from hil.record.memory import RunSink
    from hil.runs.parts import Parts


class Watch(Protocol):
    """Whoever watches a run; times in s since the start of the controlled part."""

    def began(self, parts: Parts) -> None:
        """Take what the session is made of, before it is run; to be looked at only."""

    def tick(self, row: Sequence[float]) -> None:
        """Take one outer tick in the order of the manifest's sample_names."""

    def frame(self, row: Sequence[float], image: NDArray[np.uint8] | None) -> None:
        """Take one camera frame in the order of schema.FRAME_NAMES; its image is only to be read."""

    def event(self, t_s: float, kind: str, text: str) -> None:
        """Take one line of what happened."""

    def notes(self) -> Sequence[tuple[str, str]]:
        """Return (kind, text) of what the watcher has to add to the events, each once."""


class WatchedSink:
    """A record's sink that passes everything on, and then tells the watcher."""

    def __init__(self, sink: RunSink, watch: Watch) -> None:
        self._sink = sink
        self._watch = watch
        self.link_frame: Callable[[float, bytes], None] = sink.link_frame
        self.start: Callable[[int], None] = sink.start
        self.identify: Callable[[str, str, str], None] = sink.identify

    def append(self, row: Sequence[float]) -> None:
        """Take one outer tick."""
        self._sink.append(row)
        self._watch.tick(row)
        self._add_notes(row[0])

    def frame(self, row: Sequence[float], image: Picture | None = None) -> None:
        """Take one camera frame and its image."""
        self._sink.frame(row, image)
        self._watch.frame(row, None if image is None else whole(image))

    def event(self, t_s: float, kind: str, text: str) -> None:
        """Take one line of what happened; what the watcher has to add comes before it."""
        self._add_notes(t_s)
        self._sink.event(t_s, kind, text)
        self._watch.event(t_s, kind, text)

    def _add_notes(self, t_s: float) -> None:
        for kind, text in self._watch.notes():
            self._sink.event(t_s, kind, text)
            self._watch.event(t_s, kind, text)
