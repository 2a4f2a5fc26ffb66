"""Names in the file system that a served twin holds: none is taken from a server that still runs.

A name that a server left behind when it was killed is taken over; one that is something else's is not.
"""

from __future__ import annotations

import contextlib
import os
import socket
import stat
import struct
from pathlib import Path
from types import ModuleType
from typing import BinaryIO

from hil.core.errors import BadInput

fcntl: ModuleType | None
try:
    import fcntl
except ImportError:  # no pseudo-terminals there either
    fcntl = None

_TERMINALS = ("/dev/pts/", "/dev/ttys")


class Claim:
    """A lock beside a name; the system gives it up with the process, however that ends."""

    def __init__(self, name: Path, option: str) -> None:
        self._path = name.with_name(f".{name.name}.lock")
        self.left_behind = self._path.exists()
        try:
            name.parent.mkdir(parents=True, exist_ok=True)
            self._file = self._open()
        except OSError as error:
            raise BadInput(f"{option} {name}: {error.strerror}; choose another path") from None
        if self._file is None:
            raise BadInput(f"{option} {name}: in use by another `hil twin serve`{self._holder()}")
        self._file.truncate(0)
        self._file.write(f"{os.getpid()}\n".encode())
        self._file.flush()

    def _open(self) -> BinaryIO | None:
        """Return the locked file, None when somebody else has the lock."""
        while True:
            file = self._path.open("a+b")
            if fcntl is None:
                return file
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                file.close()
                return None
            # Its holder may have removed it between the opening and the lock.
            with contextlib.suppress(OSError):
                if _same(file, self._path):
                    return file
            file.close()

    def _holder(self) -> str:
        with contextlib.suppress(OSError):
            pid = self._path.read_text(encoding="ascii", errors="replace").strip()
            if pid:
                return f" (pid {pid}); end that one or choose another path"
        return "; end that one or choose another path"

    def release(self) -> None:
        """Give the name up; safe to call twice."""
        if self._file is not None and not self._file.closed:
            with contextlib.suppress(OSError):
                self._path.unlink()
            self._file.close()


def _same(file: BinaryIO, path: Path) -> bool:
    there, here = path.stat(), os.fstat(file.fileno())
    return (there.st_dev, there.st_ino) == (here.st_dev, here.st_ino)


class PortName:
    """A symbolic link to a pseudo-terminal, claimed for as long as the server runs."""

    def __init__(self, link: Path, device: str) -> None:
        self._link, self._device = link, device
        self._claim = Claim(link, "--pty")
        try:
            self._make_room()
            link.symlink_to(device)
        except OSError as error:
            self._claim.release()
            raise BadInput(
                f"--pty {link}: {error.strerror}; choose a path that does not exist"
            ) from None
        except BadInput:
            self._claim.release()
            raise

    def _make_room(self) -> None:
        """Remove a link that a server left behind; raises BadInput for any other link."""
        if not self._link.is_symlink():
            return
        target = os.readlink(self._link)
        terminal = target.startswith(_TERMINALS)
        if not terminal or (Path(target).exists() and not self._claim.left_behind):
            raise BadInput(
                f"--pty {self._link}: is a link to {target} that no server left behind; "
                "choose a path that does not exist"
            )
        self._link.unlink()

    def release(self) -> None:
        """Remove the link unless it is another's by now."""
        with contextlib.suppress(OSError):
            if os.readlink(self._link) == self._device:
                self._link.unlink()
        self._claim.release()


def bind_socket(listener: socket.socket, path: Path) -> tuple[int, int]:
    """Give a listening socket its path; return what tells it from another one there later.

    A socket that nobody listens on is replaced. Raises BadInput for one in use and anything else.
    """
    try:
        if path.is_socket():
            holder = _listener_of(path)
            if holder is not None:
                raise BadInput(
                    f"--frames {path}: in use by another `hil twin serve`{holder}; "
                    "end that one or choose another path"
                )
            path.unlink()
        listener.bind(str(path))
        return _identity(path)
    except OSError as error:
        why = error.strerror or str(error)
        raise BadInput(f"--frames {path}: {why}; choose another path") from None


def release_socket(path: Path, identity: tuple[int, int]) -> None:
    """Remove the path unless another socket stands there by now."""
    with contextlib.suppress(OSError):
        if _identity(path) == identity:
            path.unlink()


def _identity(path: Path) -> tuple[int, int]:
    found = path.lstat()
    return (found.st_dev, found.st_ino) if stat.S_ISSOCK(found.st_mode) else (0, 0)


def _listener_of(path: Path) -> str | None:
    """Return " (pid ...)" of who listens there ("" where the system does not say), None when nobody."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.setblocking(False)
        try:
            probe.connect(str(path))
        except BlockingIOError:
            return ""  # its queue is full: somebody is there
        except (ConnectionRefusedError, FileNotFoundError):
            return None
        if not hasattr(socket, "SO_PEERCRED"):
            return ""
        size = struct.calcsize("3i")
        pid, _, _ = struct.unpack(
            "3i", probe.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, size)
        )
        return f" (pid {pid})"
