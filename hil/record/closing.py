"""Closes a run record in one straight line: tables, figures, the viewer's file, and the manifest last."""

from __future__ import annotations

import dataclasses
import json
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from hil.core.files import PART, replace_file
from hil.record import layout
from hil.record.journal import Columns, journal_to_parquet
from hil.record.manifest import Manifest, file_entry, write_manifest
from hil.record.reader import RunRecord, read_events, read_pictures
from hil.record.schema import FRAME_COLUMNS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.record.beside import ViewerFile
    from hil.record.schema import Column
    from hil.record.writing import Keeping


def finish(keeping: Keeping, ended: Manifest, viewer: ViewerFile | None) -> RunRecord:
    """Turn what was written into the finished record of `ended`; its files are closed already.

    Raises OSError and RecordFault for what cannot be written, and whatever a figure of one's own or a folder
    that has gone away makes of it: the record is then to be given up.
    """
    folder = keeping.folder
    samples = _table(folder, layout.SAMPLES_JOURNAL, layout.SAMPLES, ended.sample_columns)
    frames = _table(folder, layout.FRAMES_JOURNAL, layout.FRAMES, FRAME_COLUMNS)
    run = RunRecord(
        path=folder,
        manifest=ended,
        samples=samples,
        frames=frames,
        events=read_events(folder / layout.EVENTS),
        pictures=read_pictures(folder / layout.PICTURES),
    ).with_own_figures()
    _write_figures(run)
    if viewer is not None:
        viewer.write(run)
    keeping.release()
    sealed = _seal(run)
    keeping.leave()
    return sealed


def give_up(keeping: Keeping, ended: Manifest) -> None:
    """Leave what was written as it is, and say in the manifest how it ended, where that goes."""
    with suppress(OSError):
        for part in keeping.folder.rglob(f"*{PART}"):
            part.unlink()
    keeping.release()
    with suppress(OSError):
        write_manifest(keeping.folder, ended, durable=True)
    keeping.leave()


def _table(folder: Path, journal: str, parquet: str, schema: Sequence[Column]) -> Columns:
    columns = journal_to_parquet(folder / journal, folder / parquet, schema)
    (folder / journal).unlink()
    return columns


def _write_figures(run: RunRecord) -> None:
    verdicts = [verdict.to_json() for verdict in run.verdicts()]
    tree = run.figures().to_json() | {"requirements": verdicts}
    replace_file(run.path / layout.FIGURES, json.dumps(tree, indent=1).encode() + b"\n")


def _seal(run: RunRecord) -> RunRecord:
    """Write the final manifest with size and SHA-256 of every file."""
    files = {
        file.relative_to(run.path).as_posix(): file_entry(file)
        for file in sorted(run.path.rglob("*"))
        if file.is_file() and file.name not in {layout.MANIFEST, layout.RESERVE}
    }
    manifest = run.manifest.model_copy(update={"files": files})
    write_manifest(run.path, manifest, durable=True)
    return dataclasses.replace(run, manifest=manifest)
