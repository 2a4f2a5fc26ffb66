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

_STAMP = struct.Struct(">Q")
_MAGIC_2 = 0xFD
_HEADER_2 = 10
_CHECKSUM = 2
_SIGNATURE = 13


class LoggedFrame(NamedTuple):
    """One frame of a log: wall time, and the frame from its magic byte to its checksum."""

    unix_us: int
    frame: bytes


def log_entry(unix_us: int, frame: bytes) -> bytes:
    """Return what a log has of one whole MAVLink frame, sent or received at that wall time."""
    return _STAMP.pack(unix_us) + frame


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
