"""Reports of records, made once and kept in the console's own folder: `python -m hil.console.reports`."""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from hil.api import compare, open_record
from hil.console.folders import Folders
from hil.core.errors import HilError
from hil.core.files import replacing
from hil.record import layout


def report_file(folders: Folders, records: Sequence[Path]) -> Path:
    """Return where the report of these records is kept; another state of one is another file."""
    said = hashlib.sha256()
    for record in records:
        state = os.stat(record / layout.MANIFEST)
        said.update(f"{folders.name_of(record)}\0{state.st_mtime_ns}\0{state.st_size}\0".encode())
    return folders.own / "reports" / f"{said.hexdigest()[:32]}.html"


def write_report(folders: Folders, records: Sequence[Path]) -> Path:
    """Write the report of one record, or of several side by side, unless it is there already.

    Raises BadInput.
    """
    file = report_file(folders, records)
    if file.is_file():
        return file
    file.parent.mkdir(parents=True, exist_ok=True)
    with replacing(file) as part:
        if len(records) == 1:
            open_record(records[0]).report(part)
        else:
            compare(*records).report(part)
    return file


def main() -> int:
    """Write the report of RECORDS NAME...; says where it is, or what is wrong in one line."""
    root, *names = sys.argv[1:]
    folders = Folders(Path(root), Path())
    try:
        print(write_report(folders, [folders.record(name) for name in names]))
    except HilError as error:
        print(f"hil: {error}", file=sys.stderr)
        return error.exit_status
    return 0


if __name__ == "__main__":
    sys.exit(main())
