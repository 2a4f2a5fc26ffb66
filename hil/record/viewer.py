"""Opens recorded runs in the Rerun viewer, or says how to look at them from elsewhere."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from hil.record import layout
from hil.record.reader import read_run
from hil.record.rrd import write_rrd


def open_viewer(folders: Sequence[Path]) -> str:
    """Open one or several runs on a common timeline; return a line for the user.

    Where there is no display the viewer is not started and the line says how to view the file
    elsewhere. Raises BadInput for a folder that is not a run record.
    """
    path = viewable_file(folders)
    if not has_display(os.environ):
        return (
            f"no display here; recording: {path}; copy it and open it with `rerun FILE`, "
            f"or serve it to a browser: `rerun --serve-web {path}`"
        )
    subprocess.Popen(
        [sys.executable, "-m", "rerun", str(path)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # the viewer outlives this command
    )
    return f"viewer opened on {path}"


def viewable_file(folders: Sequence[Path]) -> Path:
    """Return a Rerun file of the runs: a single run's own, else one made for the purpose."""
    runs = [read_run(folder) for folder in folders]
    own = runs[0].path / layout.RERUN
    if len(runs) == 1 and own.is_file():
        return own
    path = Path(tempfile.mkdtemp(prefix="hil-view-")) / "runs.rrd"
    write_rrd(path, runs)
    return path


def has_display(environ: Mapping[str, str], platform: str = sys.platform) -> bool:
    """Say whether a window can be opened: always on macOS and Windows, else by X11 or Wayland."""
    if platform in {"darwin", "win32"}:
        return True
    return bool(environ.get("DISPLAY") or environ.get("WAYLAND_DISPLAY"))
