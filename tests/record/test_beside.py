"""The viewer's file from a process beside the run: the same file, and no run needs that process."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from hil.record.beside import ViewerFile
from hil.record.reader import RunRecord, read_run
from hil.record.rrd import write_rrd
from tests.record.synthetic import make_run

pytestmark = pytest.mark.skipif(
    not hasattr(os, "fork") or threading.active_count() > 1, reason="needs a fork of one thread"
)


def printed(path: Path) -> list[str]:
    """Return what Rerun's own command line reads in a file, without the ids that every file has anew."""
    command = [sys.executable, "-m", "rerun", "rrd", "print", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return sorted(line.split(" - ", 1)[-1] for line in done.stdout.splitlines() if "/pid/" in line)


@pytest.fixture
def run(tmp_path: Path) -> RunRecord:
    """Return a finished run that has no viewer's file yet."""
    make_run(tmp_path / "run", "pid", rerun=False)
    return read_run(tmp_path / "run")


def beside(viewer: ViewerFile) -> int:
    """Return the process of an entered viewer's file; there is one."""
    assert viewer._pid > 0
    return viewer._pid


def test_it_holds_what_the_file_written_here_holds(run: RunRecord, tmp_path: Path) -> None:
    """Entities and rows as Rerun reads them; the other process is gone in the end."""
    write_rrd(tmp_path / "here.rrd", [run])
    with ViewerFile() as viewer:
        pid = beside(viewer)
        viewer.write(run)
    assert printed(run.path / "run.rrd") == printed(tmp_path / "here.rrd") != []
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_a_process_that_has_gone_away_is_not_missed(run: RunRecord) -> None:
    """Killed before it is asked: the file is written here."""
    with ViewerFile() as viewer:
        os.kill(beside(viewer), signal.SIGKILL)
        viewer.write(run)
    assert printed(run.path / "run.rrd")


def test_a_line_feed_in_a_folders_name_is_a_byte_as_any_other(
    run: RunRecord, tmp_path: Path
) -> None:
    """The record whose name is its beginning is left alone."""
    make_run(tmp_path / "run\nx", "pid", rerun=False)
    with ViewerFile() as viewer:
        viewer.write(read_run(tmp_path / "run\nx"))
    assert printed(tmp_path / "run\nx" / "run.rrd")
    assert not (run.path / "run.rrd").exists()


def test_signals_of_the_terminal_are_not_for_it(run: RunRecord) -> None:
    """Ctrl-C reaches every process of a terminal; the record is finished all the same."""
    with ViewerFile() as viewer:
        viewer.write(run)  # it is up by then
        (run.path / "run.rrd").unlink()
        os.kill(beside(viewer), signal.SIGINT)
        os.kill(beside(viewer), signal.SIGTERM)
        viewer.write(run)
    assert (run.path / "run.rrd").is_file()


def test_a_file_that_cannot_be_written_is_the_same_error(run: RunRecord) -> None:
    """A limit on the size of files, in force in both processes: OSError, and nothing half-written."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, before[1]))
    try:
        with ViewerFile() as viewer, pytest.raises(OSError, match="too large"):
            viewer.write(run)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert not list(run.path.glob("run.rrd*"))


def test_not_entered_it_begins_no_process(run: RunRecord, monkeypatch: pytest.MonkeyPatch) -> None:
    """As every run from Python has it."""
    monkeypatch.setattr(os, "fork", None)
    ViewerFile().write(run)
    assert printed(run.path / "run.rrd")
