"""Telemetry log `link.tlog`: each frame after its wall time, 8 bytes big-endian microseconds.

The format of MAVLink ground stations; `mavlogdump.py` and MAVProxy read it (docs/run-record.md).
"""

from __future__ import annotations

import shutil
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from hil.core.errors import BadInput
from hil.core.files import LOG_BYTES, read_bounded
from hil.record.writing import GuardedFile, Keeping

_STAMP = struct.Struct(">Q")
_MAGIC_2 = 0xFD
_HEADER_2 = 10
_CHECKSUM = 2
_SIGNATURE = 13


class LoggedFrame(NamedTuple):
    """One frame of a log: wall time, and the frame from its magic byte to its checksum."""

    unix_us: int
    frame: bytes


class TlogWriter:
    """Writes whole MAVLink frames of both directions in the order in which they are given."""

    def __init__(self, path: Path, start_unix_us: int, keeping: Keeping) -> None:
        self._file = GuardedFile(path, keeping)
        self.start_unix_us = start_unix_us

    def write(self, t_s: float, frame: bytes) -> None:
        """Append one frame sent or received at `t_s` after the start."""
        stamp = self.start_unix_us + round(t_s * 1e6)
        self._file.write(_STAMP.pack(stamp) + frame)

    def flush(self) -> None:
        """Make the frames so far survive the death of this process."""
        self._file.flush()

    def close(self) -> None:
        """Flush and close; safe to call twice."""
        self._file.close()


def read_tlog(path: Path) -> Iterator[LoggedFrame]:
    """Yield every whole frame of a MAVLink 2 log; a torn last frame ends the iteration."""
    data = read_bounded(path, LOG_BYTES)
    at = 0
    while at + 8 + _HEADER_2 <= len(data):
        (stamp,) = _STAMP.unpack_from(data, at)
        start = at + 8
        if data[start] != _MAGIC_2:
            return
        signed = data[start + 2] & 1
        end = start + _HEADER_2 + data[start + 1] + _CHECKSUM + signed * _SIGNATURE
        if end > len(data):
            return
        yield LoggedFrame(stamp, data[start:end])
        at = end


def install_dialect(folder: Path | None = None) -> Path:
    """Copy the project's dialect to where MAVLink tools look for one, as `hil.py`; return it.

    That is the `dialects/v20` folder of the installed pymavlink unless another one is given.
    `mavlogdump.py --dialect hil` and MAVProxy then read the project's own messages by name.
    Raises BadInput when the folder cannot be written.
    """
    import pymavlink.dialects.v20 as dialects  # noqa: PLC0415 - for this errand only

    from hil.wire import dialect  # noqa: PLC0415

    target = (folder or Path(next(iter(dialects.__path__)))) / "hil.py"
    try:
        shutil.copyfile(str(dialect.__file__), target)
    except OSError as error:
        raise BadInput(f"{target}: the dialect cannot be put there: {error.strerror}") from None
    return target


if __name__ == "__main__":
    print(f"installed: {install_dialect()}")
