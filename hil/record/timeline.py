"""The time base of a record: host time in, seconds since the first tick of control out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from hil.record.tick_rows import frame_row

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hil.core.rig import Frame
    from hil.core.types import PoseMeasurement
    from hil.record.memory import RunSink


class Timeline:
    """Writes frames, events and link traffic to a recorder with t = 0 at the start of control.

    What happens before that instant is known is held back (a few seconds of connecting) and then
    written with its negative times. `unix_us` tells the wall time: it is asked at the start, once.
    """

    def __init__(self, recorder: RunSink, unix_us: Callable[[], int]) -> None:
        self._recorder = recorder
        self._unix_us = unix_us
        self._origin_s: float | None = None
        self._held: list[tuple[float, Callable[[float], None]]] = []
        # Is given each frame that is held back, with the host's time in its row: to be looked at only.
        self.early: Callable[[Sequence[float], NDArray[np.uint8] | None], None] | None = None

    def start(self, t_host_s: float) -> None:
        """Make `t_host_s` the record's zero; a second call changes nothing."""
        if self._origin_s is not None:
            return
        self._origin_s = t_host_s
        self._recorder.start(self._unix_us())
        for t_s, write in self._held:
            write(t_s - t_host_s)
        self._held.clear()

    @property
    def origin_s(self) -> float | None:
        """Host time of the record's zero, None before it is known."""
        return self._origin_s

    def _at(self, t_host_s: float, write: Callable[[float], None]) -> None:
        if self._origin_s is None:
            self._held.append((t_host_s, write))
        else:
            write(t_host_s - self._origin_s)

    def link_frame(self, t_host_s: float, data: bytes) -> None:
        """Record one MAVLink frame of either way: it names its sender itself."""
        if self._origin_s is not None:  # the short way: this runs for every frame
            self._recorder.link_frame(t_host_s - self._origin_s, data)
        else:
            self._held.append((t_host_s, lambda t_s: self._recorder.link_frame(t_s, data)))

    def camera_frame(
        self, frame: Frame, t_host_s: float, t_exposure_s: float, measurement: PoseMeasurement
    ) -> None:
        """Record one camera frame, what was seen in it, and its image if it has one."""
        latency_s = t_host_s - t_exposure_s
        if self._origin_s is not None:  # the short way: this runs for every frame
            t_s = t_host_s - self._origin_s
            row = frame_row(frame, t_s, t_s - latency_s, measurement)
            self._recorder.frame(row, frame.picture)
            return
        if self.early is not None:
            self.early(frame_row(frame, t_host_s, t_exposure_s, measurement), frame.image)
        self._at(
            t_host_s,
            lambda t_s: self._recorder.frame(
                frame_row(frame, t_s, t_s - latency_s, measurement), frame.picture
            ),
        )

    def event(self, t_host_s: float, kind: str, text: str) -> None:
        """Record what happened."""
        self._at(t_host_s, lambda t_s: self._recorder.event(t_s, kind, text))
