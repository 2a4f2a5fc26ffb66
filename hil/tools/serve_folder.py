"""Where a served twin puts its port and socket by default: in a folder of the user alone."""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

from hil.core.errors import BadInput

_MOST_TWINS = 20


def user_folder() -> Path:
    """Return the folder, made with mode 0700; raises BadInput when another user made it first."""
    runtime = os.environ.get("XDG_RUNTIME_DIR", "")
    base = Path(runtime) if runtime and Path(runtime).is_dir() else None
    own = os.getuid() if hasattr(os, "getuid") else 0
    folder = base / "hil" if base else Path(tempfile.gettempdir()) / f"hil-{own}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError as error:
        raise BadInput(f"{folder}: {error.strerror}; give --pty and --frames") from None
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != own or found.st_mode & 0o077:
        raise BadInput(
            f"{folder}: must be a folder that only you can use (mode 0700, owner {own}); "
            "remove it, or give --pty and --frames"
        )
    return folder


def default_names() -> Iterator[tuple[Path, Path]]:
    """Yield pairs of port and socket, for the first twin, the second, ..."""
    folder = user_folder()
    for number in range(1, _MOST_TWINS + 1):
        name = "twin" if number == 1 else f"twin-{number}"
        yield folder / name, folder / f"{name}.sock"
