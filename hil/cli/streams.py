"""stdout and stderr that take everything, whatever their reader and their letters are.

A reader may go away (`| head`, a lost terminal): what follows is dropped. A letter that the encoding of
the locale does not have (a Greek one on a Windows pipe) is written as its number.

A command is not over because nobody reads on: what it still has to write elsewhere is written, and
its exit status is its own.
"""

from __future__ import annotations

import codecs
import errno
import io
import os
import sys
from typing import Any, TextIO

_GONE = {errno.EPIPE, errno.EIO, errno.EBADF, errno.ENXIO}


class _Outlet(io.FileIO):
    """A descriptor that takes everything once its other end has gone, or once it has failed."""

    _shut = False

    def write(self, data: Any) -> int:
        """Write, or drop; raises OSError once for anything but a reader that has gone."""
        if self._shut:
            return len(data)
        try:
            return super().write(data)
        except OSError as error:
            self._shut = True
            if error.errno in _GONE:
                return len(data)
            raise


def let_readers_go() -> None:
    """Put such streams in place of stdout and stderr."""
    if os.name != "posix":
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors=_errors_of(stream))
        return
    sys.stdout, sys.stderr = _outlet(sys.stdout, 1), _outlet(sys.stderr, 2)


def _outlet(stream: TextIO | None, descriptor: int) -> TextIO:
    if not isinstance(stream, io.TextIOWrapper) or not _writes_to(stream, descriptor):
        return open(os.devnull, "w", encoding="utf-8") if stream is None else stream
    stream.flush()
    return io.TextIOWrapper(
        io.BufferedWriter(_Outlet(descriptor, "w", closefd=False)),
        encoding=stream.encoding,
        errors=_errors_of(stream),
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )


def takes_every_letter(stream: TextIO) -> bool:
    """Say whether the encoding of a stream has every letter."""
    return codecs.lookup(stream.encoding or "utf-8").name.startswith("utf")


def _errors_of(stream: TextIO) -> str:
    return (stream.errors or "strict") if takes_every_letter(stream) else "backslashreplace"


def _writes_to(stream: TextIO, descriptor: int) -> bool:
    """Return whether a stream ends there: one that a caller put in its place stays his."""
    try:
        return stream.fileno() == descriptor
    except OSError:  # kept in memory
        return False
