"""Files of a record while it is written: the first one that cannot be written ends the record.

A disk that fills up, a limit on the size of files, a folder that goes away: the first such error is
raised as RecordFault, once. Whatever is written after it is dropped without a word, so that the
robot can be stopped by the same code as ever. What reached the disk before stays readable.
"""

from __future__ import annotations

import errno
import os
from contextlib import suppress
from pathlib import Path
from typing import IO, Self

from hil.core.errors import BadInput, RecordFault
from hil.core.files import claim_folder, hold
from hil.record import layout

# Room for the last manifest on a disk that has none left, bytes.
_RESERVE_BYTES = 65_536


class Keeping:
    """The files of a record that are open, whether they can still be written, and space kept for the end."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._reserve = folder / layout.RESERVE
        self._held: IO[bytes] | None = None
        self._files: list[GuardedFile] = []
        self.fault: RecordFault | None = None

    @classmethod
    def of_new_folder(cls, folder: Path) -> Self:
        """Make the folder of a record, or take an empty one; anything else is refused untouched.

        Raises BadInput, RecordFault.
        """
        claim_folder(folder)
        keeping = cls(folder)
        try:
            keeping.reserve()
        except OSError as error:
            raise keeping.fail(error) from None
        return keeping

    def open(self, name: str) -> GuardedFile:
        """Open a new file of the record; raises OSError."""
        file = GuardedFile(self.folder / name, self)
        self._files.append(file)
        return file

    def flush(self) -> None:
        """Hand everything so far to the system, so that it survives the death of this process."""
        for file in self._files:
            file.flush()

    def close(self) -> None:
        """Flush and close every file; raises RecordFault once. Safe to call twice."""
        for file in self._files:
            file.close()

    def fail(self, error: OSError, path: Path | None = None) -> RecordFault:
        """Note the first error, and return what is to be raised for it."""
        if self.fault is None:
            what = error.strerror or " ".join(str(error).split())
            where = f" ({path.name})" if path is not None else ""
            self.fault = RecordFault(
                f"record {self.folder}: cannot be written any more: {what}{where}; "
                "what was written before is kept"
            )
        return self.fault

    def reserve(self) -> None:
        """Take the folder for this process and keep space back; raises BadInput, OSError.

        The file of that space is held until `leave`: a reader that finds it and nobody holding it knows that
        this process has gone.
        """
        try:
            file = self._reserve.open("xb")
        except FileExistsError:
            raise BadInput(
                f"--out {self.folder}: another process writes there; name a new one"
            ) from None
        self._held = file
        with suppress(OSError):  # a file system without locks
            hold(file)
        try:
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(file.fileno(), 0, _RESERVE_BYTES)
            else:
                file.write(bytes(_RESERVE_BYTES))
        except OSError as error:
            if error.errno == errno.ENOSPC:
                raise

    def release(self) -> None:
        """Give the space kept back to what is written last."""
        if self._held is not None:
            with suppress(OSError):
                self._held.truncate(0)

    def leave(self) -> None:
        """Give the folder up: its last manifest is written, or cannot be."""
        with suppress(OSError):
            self._reserve.unlink(missing_ok=True)
        if self._held is not None:
            with suppress(OSError):
                self._held.close()

    def check(self, file: Path) -> None:
        """Raise RecordFault when a file of the record has gone away."""
        if self.fault is None and not file.exists():
            raise self.fail(FileNotFoundError(errno.ENOENT, "the folder has gone away"))


class GuardedFile:
    """A binary file of a record; after the first error of any of them nothing is written."""

    def __init__(self, path: Path, keeping: Keeping) -> None:
        self._path = path
        self._keeping = keeping
        self._file: IO[bytes] = path.open("wb")
        self._write = self._file.write

    def write(self, data: bytes) -> int:
        """Append bytes; raises RecordFault once."""
        if self._keeping.fault is not None:
            return 0
        try:
            return self._write(data)
        except OSError as error:
            raise self._keeping.fail(error, self._path) from None

    def flush(self) -> None:
        """Hand everything to the system; raises RecordFault once."""
        if self._keeping.fault is not None:
            return
        try:
            self._file.flush()
        except OSError as error:
            raise self._keeping.fail(error, self._path) from None

    def close(self) -> None:
        """Flush and close; raises RecordFault once. Safe to call twice."""
        try:
            self._file.close()
        except OSError as error:
            if self._keeping.fault is None:
                raise self._keeping.fail(error, self._path) from None
