"""What a replay needs of a record, read as far as it is intact."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hil.core.errors import BadInput
from hil.record import layout
from hil.record.manifest import Manifest, read_manifest
from hil.record.reader import altered_files, read_table
from hil.record.tape import Tape, read_tape
from hil.record.tlog import LoggedFrame, read_tlog

if TYPE_CHECKING:
    from hil.record.journal import Columns


@dataclass(frozen=True, slots=True)
class Source:
    """What a replay needs of a record, as far as it is intact; `problems` says what is not."""

    path: Path
    manifest: Manifest
    tape: Tape
    samples: Columns
    frames: Columns
    link: tuple[LoggedFrame, ...]
    problems: tuple[str, ...]

    @property
    def has_video(self) -> bool:
        """Say whether every frame was kept, so that the localiser can be replayed too."""
        return (self.path / layout.CAMERA).is_file()


def read_source(path: Path) -> Source:
    """Return what is intact of a record; raises BadInput when nothing can be replayed."""
    manifest = read_manifest(path)
    if not (path / layout.TAPE).is_file():
        raise BadInput(f"{path}: has no {layout.TAPE}: recorded without one, nothing to replay")
    problems = altered_files(path, manifest)
    if manifest.outcome == "running":
        problems.append("cut off in mid-run: the record was never closed")
    tape = read_tape(path / layout.TAPE)
    if not tape.entries:
        raise BadInput(f"{path}: {layout.TAPE} is empty: nothing to replay (an imported log?)")
    if tape.problem:
        problems.append(tape.problem)
    tables = []
    for finished, journal in (
        (layout.SAMPLES, layout.SAMPLES_JOURNAL),
        (layout.FRAMES, layout.FRAMES_JOURNAL),
    ):
        try:
            tables.append(read_table(path, finished, journal, required=True))
        except BadInput as error:
            problems.append(str(error))
            tables.append({})
    samples, frames = tables
    link = tuple(read_tlog(path / layout.LINK)) if (path / layout.LINK).is_file() else ()
    return Source(path, manifest, tape, samples, frames, link, tuple(problems))
