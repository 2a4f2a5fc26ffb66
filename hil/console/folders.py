"""The records folder, which the page sees, and the console's own folder in it.

Everything that a page names is a path inside the records folder: no `..`, nothing hidden, no link that leads
out of it.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from hil.core.errors import BadInput
from hil.core.files import is_left
from hil.core.text import visible
from hil.record import layout

OWN = ".console"
BIN = ".bin"
SET_UP = "set-up"
# An experiment's records lie one folder deeper, a chapter's two.
_DEPTH = 4


@dataclass(frozen=True, slots=True)
class Folders:
    """Where the records lie (`root`) and where the user's own files are found (`work`)."""

    root: Path
    work: Path

    @property
    def own(self) -> Path:
        """Return the console's own folder: token, reports made, index."""
        return self.root / OWN

    @property
    def set_up(self) -> Path:
        """Return the folder of the calibration and robot files that the console writes."""
        return self.root / SET_UP

    def make(self) -> None:
        """Make the folders; raises BadInput."""
        try:
            for folder in (self.own, self.own / "reports", self.set_up):
                folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BadInput(
                f"--records {self.root}: cannot be made: {error.strerror or error}; name another folder"
            ) from None

    def record(self, name: str) -> Path:
        """Return the folder of a record by its name in the list; raises BadInput."""
        path = confined(self.root, name)
        if not (path / layout.MANIFEST).is_file():
            raise BadInput(f"record {visible(name)}: there is none of this name")
        return path

    def name_of(self, record: Path) -> str:
        """Return the name of a record in the list."""
        return record.relative_to(self.root).as_posix()

    def work_file(self, name: str, suffix: str) -> Path:
        """Return a file of the user's own, in the folder where the console was started or in `root`.

        Raises BadInput for one that is elsewhere or is none of this kind.
        """
        for base in (self.work, self.root):
            try:
                path = confined(base, name)
            except BadInput:
                continue
            if path.is_file() and path.suffix == suffix:
                return path
        raise BadInput(
            f"{visible(name)}: no {suffix} file of this name in {self.work} (where the console was "
            f"started) or {self.root}"
        )

    def records(self) -> Iterator[Path]:
        """Yield the folder of every record, hidden ones and those behind links aside."""
        yield from _records(self.root, _DEPTH)


def confined(root: Path, name: str) -> Path:
    """Return the path `name` inside `root`; raises BadInput for one that would leave it or is hidden."""
    parts = PurePosixPath(name).parts
    plain = bool(parts) and not any(
        part in {"/", "..", "."} or part.startswith(".") or "\\" in part or "\0" in part
        for part in parts
    )
    if not plain:
        raise BadInput(f"{visible(name)}: is no path inside {root.name}")
    path = root.joinpath(*parts)
    if not path.resolve().is_relative_to(root.resolve()):
        raise BadInput(f"{visible(name)}: leads out of {root.name}")
    return path


def _records(folder: Path, depth: int) -> Iterator[Path]:
    try:
        entries = list(os.scandir(folder))
    except OSError:
        return
    for entry in entries:
        if entry.name.startswith(".") or not entry.is_dir(follow_symlinks=False):
            continue
        path = Path(entry.path)
        if os.path.isfile(os.path.join(entry.path, layout.MANIFEST)):
            yield path
        elif depth > 1:
            yield from _records(path, depth - 1)


def require_closed(record: Path, name: str) -> None:
    """Raise BadInput for a record that some process is writing, this console's or another."""
    reserve = record / layout.RESERVE
    if reserve.exists() and not is_left(reserve):
        raise BadInput(f"record {visible(name)}: its run is on: stop it first, or wait for its end")


def in_bin(root: Path, record: Path) -> Path:
    """Move a record into the bin and return where it lies now; raises OSError."""
    folder = root / BIN
    folder.mkdir(exist_ok=True)
    flat = record.relative_to(root).as_posix().replace("/", "__")
    place, number = folder / flat, 2
    while place.exists():
        place, number = folder / f"{flat}-{number}", number + 1
    (folder / f"{place.name}.from").write_text(
        record.relative_to(root).as_posix(), encoding="utf-8"
    )
    record.rename(place)
    return place


def out_of_bin(root: Path, name: str) -> Path:
    """Put a record of the bin back where it was; raises BadInput, OSError."""
    folder = root / BIN
    if PurePosixPath(name).name != name or name.startswith("."):
        raise BadInput(f"{visible(name)}: is no record in the bin")
    origin = folder / f"{name}.from"
    if not (folder / name).is_dir() or not origin.is_file():
        raise BadInput(f"{visible(name)}: is no record in the bin")
    place = confined(root, origin.read_text(encoding="utf-8"))
    if place.exists():
        raise BadInput(f"{visible(name)}: its place {place} is taken")
    place.parent.mkdir(parents=True, exist_ok=True)
    (folder / name).rename(place)
    origin.unlink()
    return place
