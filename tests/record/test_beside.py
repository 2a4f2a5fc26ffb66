"""The viewer's file from a process beside the run: the same file, and no run needs that process.

Each is tried in a process of its own, as `hil run` is one: what other tests have left running in this one
(a thread is enough) would leave the file to be written here.
"""

from __future__ import annotations

import multiprocessing
import os
import resource
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from hil.record.beside import ViewerFile
from hil.record.reader import RunRecord, read_run
from hil.record.rrd import write_rrd
from tests.record.synthetic import make_run

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs a fork")


def alone(act: Callable[[Path], None], folder: Path) -> None:
    """Do it in a new process of one thread; what fails there fails here."""
    process = multiprocessing.get_context("spawn").Process(target=act, args=(folder,))
    process.start()
    process.join()
    assert process.exitcode == 0, "what it said is on stderr"


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


def _written_and_gone(folder: Path) -> None:
    with ViewerFile() as viewer:
        pid = beside(viewer)
        viewer.write(read_run(folder))
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_it_holds_what_the_file_written_here_holds(run: RunRecord, tmp_path: Path) -> None:
    """Entities and rows as Rerun reads them; the other process is gone in the end."""
    write_rrd(tmp_path / "here.rrd", [run])
    alone(_written_and_gone, run.path)
    assert printed(run.path / "run.rrd") == printed(tmp_path / "here.rrd") != []


def _killed_first(folder: Path) -> None:
    with ViewerFile() as viewer:
        os.kill(beside(viewer), signal.SIGKILL)
        viewer.write(read_run(folder))


def test_a_process_that_has_gone_away_is_not_missed(run: RunRecord) -> None:
    """Killed before it is asked: the file is written here."""
    alone(_killed_first, run.path)
    assert printed(run.path / "run.rrd")


def test_a_line_feed_in_a_folders_name_is_a_byte_as_any_other(
    run: RunRecord, tmp_path: Path
) -> None:
    """The record whose name is its beginning is left alone."""
    make_run(tmp_path / "run\nx", "pid", rerun=False)
    alone(_written_and_gone, tmp_path / "run\nx")
    assert printed(tmp_path / "run\nx" / "run.rrd")
    assert not (run.path / "run.rrd").exists()


def _signalled(folder: Path) -> None:
    with ViewerFile() as viewer:
        viewer.write(read_run(folder))  # it is up by then
        (folder / "run.rrd").unlink()
        os.kill(beside(viewer), signal.SIGINT)
        os.kill(beside(viewer), signal.SIGTERM)
        viewer.write(read_run(folder))
        os.kill(beside(viewer), 0)


def test_signals_of_the_terminal_are_not_for_it(run: RunRecord) -> None:
    """Ctrl-C reaches every process of a terminal; the record is finished all the same."""
    alone(_signalled, run.path)
    assert (run.path / "run.rrd").is_file()


def _too_large(folder: Path) -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, resource.RLIM_INFINITY))
    with ViewerFile() as viewer:
        beside(viewer)
        with pytest.raises(OSError, match="too large"):
            viewer.write(read_run(folder))


def test_a_file_that_cannot_be_written_is_the_same_error(run: RunRecord) -> None:
    """A limit on the size of files, in force in both processes: OSError, and nothing half-written."""
    alone(_too_large, run.path)
    assert not list(run.path.glob("run.rrd*"))


def test_not_entered_it_begins_no_process(run: RunRecord, monkeypatch: pytest.MonkeyPatch) -> None:
    """As every run from Python has it."""
    monkeypatch.setattr(os, "fork", None)
    ViewerFile().write(run)
    assert printed(run.path / "run.rrd")
