"""Measures the list of many records: `python -m tests.console.many_records [COUNT]`."""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from pathlib import Path

import hil
from hil.console.folders import Folders
from hil.console.listing import Listing, Wanted


def main() -> None:
    """Copy the two files of one record that a list reads, list them anew, and again from the index."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 5000
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "runs"
        hil.run("scenario-1", camera="pose", duration_s=1.0, out=root / "run-00000")
        for number in range(1, count):
            copy = root / f"run-{number:05d}"
            copy.mkdir()
            for name in ("manifest.json", "metrics.json"):
                shutil.copyfile(root / "run-00000" / name, copy / name)
        folders = Folders(root, Path(folder))
        folders.make()
        for what in ("first time", "from the index"):
            listing = Listing(folders)  # reads the index that is there
            start_s, start_cpu_s = time.perf_counter(), time.process_time()
            found = listing.page(Wanted(law="asg-ism"), 0, 100)
            took_s = time.perf_counter() - start_s
            cpu_s = time.process_time() - start_cpu_s
            said = f"{took_s:.2f} s, {cpu_s:.2f} s of them this program's"
            print(f"{what}: {found['found']} of {found['total']} records in {said}")


if __name__ == "__main__":
    main()
