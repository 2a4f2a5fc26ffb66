"""Files put in place whole, read with a bound on their size, and TOML with one line of what is wrong."""

from __future__ import annotations

import errno
import os
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from hil.core.errors import BadInput, HilError, RigFault

try:
    import fcntl
except ImportError:  # Windows has none
    fcntl = None  # type: ignore[assignment]

PART = ".part"  # ends the name of a file in work
TEXT_BYTES = 4_000_000  # scenarios, robots, laws, mappings: the largest shipped one has 12 KB
RECORD_BYTES = 64_000_000  # manifests, tables as text
LOG_BYTES = 512_000_000  # logs: a day at the link's full rate


def replace_file(path: Path, data: bytes, *, durable: bool = False) -> None:
    """Put `data` at `path` in one step, so that no reader and no crash sees half of it.

    With `durable` it has also reached the disk when this returns, and survives a loss of power.
    That takes milliseconds, so a record asks for it once, at its very end. Raises OSError.
    """
    with replacing(path) as part, part.open("wb") as file:
        file.write(data)
        if durable:
            file.flush()
            os.fsync(file.fileno())


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a name beside `path` to write to; the file takes the place of `path` when all went well.

    After an error the half-written file is gone and `path` is as it was. Raises OSError.
    """
    if not path.name:
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    part = path.with_name(f"{path.name}{PART}")
    try:
        yield part
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


# A disk, or a limit, that is at its end.
_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO}


def claim_folder(folder: Path) -> None:
    """Make the folder that `--out` names, or take an empty one; raises BadInput for any other, untouched."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise BadInput(f"--out {folder}: the folder is not empty; name a new one")
    except OSError as error:
        raise BadInput(f"--out {folder}: cannot be made: {error.strerror}") from None


def hold(file: IO[bytes]) -> None:
    """Lock an open file for this process, and for what it forks, until it is closed or they are gone.

    Raises OSError where another holds it. Does nothing where the system has no such lock (Windows).
    """
    if fcntl is not None:
        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)


def is_left(path: Path) -> bool:
    """Say whether a file that somebody held (`hold`) is there and nobody holds it any more."""
    if fcntl is None:
        return False
    try:
        with path.open("rb") as file:
            fcntl.flock(file.fileno(), fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Wait until no other process is in here for this folder, and stay alone there; raises OSError.

    Where the system or the file system has no such lock it is entered at once.
    """
    if fcntl is None:
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def unwritable(what: str, error: OSError) -> HilError:
    """Return what is to be raised for a file that cannot be written, which `what` names.

    A path that is wrong is the caller's affair (BadInput), a disk that is full is not (RigFault).
    """
    kind = RigFault if error.errno in _FULL else BadInput
    return kind(f"{what}: cannot be written: {error.strerror or error}")


def read_toml(path: Path, what: str = "") -> dict[str, Any]:
    """Return the table of a TOML file.

    `what` says what the file is, for example "mapping". Raises BadInput with one line when it
    cannot be read, is no UTF-8 or no TOML.
    """
    name = f"{what} {path}".strip()
    try:
        return parse_toml(read_text(path), str(path))
    except OSError as error:
        raise BadInput(f"{name}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise BadInput(f"{name}: cannot be read: {error}") from None


def parse_toml(text: str, name: str) -> dict[str, Any]:
    """Return the table that TOML `text` says; raises BadInput, which names `name`."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # a number or brackets beyond what Python takes
        raise BadInput(f"{name}: not valid TOML: {error}") from None


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
    """Return a text file with plain line ends and no byte-order mark.

    Raises BadInput, OSError, UnicodeDecodeError.
    """
    text = read_bounded(path, limit_bytes).decode(encoding).removeprefix("\ufeff")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def is_file(path: Path) -> bool:
    """Say whether there is such a file; there is none of a name that is too long for any."""
    try:
        return path.is_file()
    except OSError:
        return False


def check_size(path: Path, limit_bytes: int = LOG_BYTES) -> None:
    """Raise BadInput for a file that is too large to be read as a whole; OSError when it is not there."""
    size = path.stat().st_size
    if size > limit_bytes:
        raise BadInput(
            f"{path}: {size} bytes; at most {limit_bytes} bytes are read of a log; cut it into parts"
        )
