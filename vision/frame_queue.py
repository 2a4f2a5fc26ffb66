"""Camera frames handed from the thread that takes them to the one that waits for them."""

from __future__ import annotations

import contextlib
import os
import threading
from collections import deque

from hil.core.errors import RigFault
from hil.core.rig import Frame

# A host that falls behind wants the newest frames; older ones are as good as dropped.
_QUEUE_LENGTH = 4


class FrameQueue:
    """Frames from one thread to another, with a pipe that is readable while some are waiting."""

    def __init__(self) -> None:
        self._frames: deque[Frame] = deque(maxlen=_QUEUE_LENGTH)
        self._fault = ""
        self._reader, self._writer = os.pipe()
        os.set_blocking(self._reader, False)
        os.set_blocking(self._writer, False)
        self._lock = threading.Lock()

    def fileno(self) -> int:
        """Return the end of the pipe to wait on."""
        return self._reader

    def put(self, frame: Frame) -> None:
        """Add a frame; the oldest one makes room."""
        with self._lock:
            self._frames.append(frame)
            self._wake()

    def fail(self, reason: str) -> None:
        """Let `poll` raise RigFault once the waiting frames are taken."""
        with self._lock:
            self._fault = reason
            self._wake()

    def _wake(self) -> None:
        # A full pipe is readable already; a closed one has nobody waiting.
        with contextlib.suppress(OSError):
            os.write(self._writer, b".")

    def poll(self) -> Frame | None:
        """Return the oldest frame waiting, None if none; raises RigFault after `fail`."""
        with self._lock:
            if self._frames:
                frame = self._frames.popleft()
                if not self._frames and not self._fault:
                    self._drain()
                return frame
            if self._fault:
                raise RigFault(self._fault)
            return None

    def _drain(self) -> None:
        with contextlib.suppress(BlockingIOError):
            os.read(self._reader, 4096)

    def close(self) -> None:
        """Close the pipe; safe to call twice."""
        with self._lock:
            for descriptor in (self._reader, self._writer):
                if descriptor >= 0:
                    os.close(descriptor)
            self._reader = self._writer = -1
