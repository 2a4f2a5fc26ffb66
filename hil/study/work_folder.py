"""The folder of work that can be stopped and gone on with: one writer, damage set aside, SIGTERM.

The lock is the system's own on a file beside what it guards: it ends with its process, however that
dies, so nothing stale is left to be cleaned up by hand.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import IO, Any

from hil.core.errors import BadInput, Stopped
from hil.core.files import PART

LOCK, SET_ASIDE = ".lock", "set-aside"
_INTERRUPTED_AGAIN = 3


def is_new(folder: Path, plan: str) -> bool:
    """Say whether a folder holds nothing yet, or no more than a start cut off before its `plan`."""
    if not folder.exists():
        return True
    if not folder.is_dir():
        return False
    return {item.name for item in folder.iterdir()} <= {f"{plan}{PART}", LOCK}


def set_aside(path: Path, folder: Path) -> Path:
    """Move what is damaged into `set-aside/` of a folder under a name of its own; return where."""
    aside = folder / SET_ASIDE
    aside.mkdir(exist_ok=True)
    number = 1
    while (target := aside / f"{path.name}-{number}").exists():
        number += 1
    path.rename(target)
    return target


class Terminated(Stopped):
    """SIGTERM came; caught wherever Ctrl-C is, so that both leave the same behind."""

    def __init__(self) -> None:
        super().__init__(signal.SIGTERM)


@contextmanager
def sole_writer(lock: Path, what: str) -> Iterator[None]:
    """Hold the lock file while entered; `what` names the guarded thing in the refusal.

    Raises BadInput when another process holds it, or when the file cannot be made.
    """
    file = _locked(lock, what)
    try:
        yield
    finally:
        with suppress(OSError):
            lock.unlink()
        file.close()


def _locked(lock: Path, what: str) -> IO[str]:
    for _ in range(_INTERRUPTED_AGAIN):
        try:
            file = lock.open("a+", encoding="utf-8")
        except OSError as error:
            raise BadInput(f"{what}: cannot be written to: {error.strerror}") from None
        if not _take(file):
            file.seek(0)
            holder = file.read(40).strip()
            file.close()
            who = f"process {holder}" if holder else "another process"
            raise BadInput(f"{what}: {who} is writing there; wait for its end, or name a new one")
        # The holder before unlinks its file at the end: a lock on that one guards nothing.
        with suppress(OSError):
            if os.path.samestat(os.fstat(file.fileno()), lock.stat()):
                file.truncate(0)
                file.write(str(os.getpid()))
                file.flush()
                return file
        file.close()
    raise BadInput(f"{what}: another process is writing there; wait for its end")


def _take(file: IO[str]) -> bool:
    """Lock an open file without waiting; say whether it was free."""
    if sys.platform == "win32":
        import msvcrt  # noqa: PLC0415 - this system only

        with suppress(OSError):
            file.seek(100)  # beyond the text, which others may read
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
            return True
        return False
    import fcntl  # noqa: PLC0415 - every other system

    with suppress(OSError):
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return True
    return False


@contextmanager
def sigterm_stops() -> Iterator[None]:
    """Raise Terminated in this thread when SIGTERM comes while entered (main thread only)."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise Terminated

    before: Any = signal.signal(signal.SIGTERM, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
