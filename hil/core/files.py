"""Files that people hand over, read with a bound: what is too large to be one is refused unread."""

from __future__ import annotations

from pathlib import Path

from hil.core.errors import BadInput

TEXT_BYTES = 4_000_000  # scenarios, robots, laws, mappings: the largest shipped one has 12 KB
RECORD_BYTES = 64_000_000  # manifests, tables as text
LOG_BYTES = 512_000_000  # logs: a day at the link's full rate


def read_bounded(path: Path, limit_bytes: int = TEXT_BYTES) -> bytes:
    """Return a file's bytes; raises BadInput for a larger one (unread beyond the limit), OSError."""
    with path.open("rb") as file:
        data = file.read(limit_bytes + 1)
    if len(data) > limit_bytes:
        size = path.stat().st_size
        raise BadInput(
            f"{path}: {size} bytes; at most {limit_bytes} bytes are read of such a file; "
            "is it the right one?"
        )
    return data


def read_text(path: Path, limit_bytes: int = TEXT_BYTES, encoding: str = "utf-8") -> str:
    """Return a text file with plain line ends; raises BadInput, OSError, UnicodeDecodeError."""
    text = read_bounded(path, limit_bytes).decode(encoding)
    return text.replace("\r\n", "\n").replace("\r", "\n")


def check_size(path: Path, limit_bytes: int = LOG_BYTES) -> None:
    """Raise BadInput for a file that is too large to be read as a whole; OSError when it is not there."""
    size = path.stat().st_size
    if size > limit_bytes:
        raise BadInput(
            f"{path}: {size} bytes; at most {limit_bytes} bytes are read of a log; cut it into parts"
        )
