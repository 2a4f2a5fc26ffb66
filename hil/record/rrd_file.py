"""A Rerun recording written to a file as it is made, with an error where the file cannot be written.

Rerun's own writer waits for ever once a file cannot be written. So it writes into a pipe, which a thread
here empties into the file; once that fails, the rest is thrown away and the error is raised.
"""

from __future__ import annotations

import os
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import rerun as rr

Put = Callable[[], None]
_BLOCK_BYTES = 1 << 16


@contextmanager
def written_by(recording: rr.RecordingStream, path: Path) -> Iterator[Put]:
    """Give what writes to `path` all that the recording was sent by now; at the end it is whole.

    Raises OSError when the file cannot be written.
    """
    if not hasattr(os, "mkfifo"):
        memory = recording.memory_recording()
        yield recording.flush
        path.write_bytes(memory.drain_as_bytes() or b"")
        return
    with tempfile.TemporaryDirectory(prefix="hil-rrd-") as folder, path.open("wb") as file:
        pipe = Path(folder) / "pipe"
        os.mkfifo(pipe)
        reading = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
        held_open = os.open(pipe, os.O_WRONLY)  # so that there is no end before Rerun has come
        os.set_blocking(reading, True)
        emptier = _Emptier(reading, file.fileno())
        emptier.start()
        try:
            recording.save(pipe)
            yield lambda: emptier.after(recording.flush)
        finally:
            recording.disconnect()  # ends the file, and closes Rerun's end of the pipe
            os.close(held_open)
            emptier.join()
            os.close(reading)
        emptier.check()


class _Emptier(threading.Thread):
    """Reads a pipe to its end and writes what comes to an open file."""

    def __init__(self, pipe: int, file: int) -> None:
        super().__init__(name="rrd-writer", daemon=True)
        self._pipe = pipe
        self._file = file
        self._error: OSError | None = None

    def run(self) -> None:
        while block := os.read(self._pipe, _BLOCK_BYTES):
            if self._error is None:
                self._put(block)

    def _put(self, block: bytes) -> None:
        try:
            while block:
                block = block[os.write(self._file, block) :]
        except OSError as error:
            self._error = error

    def after(self, flush: Put) -> None:
        """Flush, and raise what has gone wrong by then."""
        flush()
        self.check()

    def check(self) -> None:
        """Raise what went wrong, if anything did."""
        if self._error is not None:
            raise self._error
