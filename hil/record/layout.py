"""Names of the files of a run record."""

from pathlib import Path

from hil.core.errors import BadInput

MANIFEST = "manifest.json"
RESERVE = ".reserve"  # while the record is being written
SAMPLES = "samples.parquet"
SAMPLES_JOURNAL = "samples.journal"
FRAMES = "frames.parquet"
FRAMES_JOURNAL = "frames.journal"
LINK = "link.tlog"
TAPE = "inputs.tape"
EVENTS = "events.jsonl"
CAMERA = "camera.mkv"
CAMERA_SMALL = "camera-small.avi"
RERUN = "run.rrd"
FIGURES = "metrics.json"
PICTURES = "pictures"
PLUGINS = "plugins"  # texts of laws, estimators, ... that came from files

FILES = frozenset({
    MANIFEST, RESERVE, SAMPLES, SAMPLES_JOURNAL, FRAMES, FRAMES_JOURNAL, LINK, TAPE, EVENTS, CAMERA,
    CAMERA_SMALL, RERUN, FIGURES,
})  # fmt: skip


def refuse_own_file(path: Path, what: str) -> None:
    """Raise BadInput where a file to be written, named by `what`, is one of a record's own."""
    folders = [path.parent, path.parent.parent] if path.parent.name in {PICTURES, PLUGINS} else []
    own = path.name in FILES and (path.parent / MANIFEST).is_file()
    if own or any((folder / MANIFEST).is_file() for folder in folders):
        raise BadInput(
            f"{what} {path}: is a file of a run record, which stays as it is; name another"
        )
