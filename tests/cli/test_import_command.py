"""`hil import` as a person runs it: a record, one line for what is none, nothing left when it is stopped."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from hil.record.reader import read_run
from hil.record.recorder import Recorder
from tests.cli.command import hil
from tests.replay.logs import MAP, arc_rows, write_rows


@pytest.fixture
def words(tmp_path: Path) -> tuple[object, ...]:
    """Return the command that imports 200 rows into the folder `run`."""
    write_rows(tmp_path / "log.csv", arc_rows())
    (tmp_path / "log.toml").write_text(MAP, encoding="utf-8")
    return (
        "import",
        tmp_path / "log.csv",
        "--map",
        tmp_path / "log.toml",
        "--out",
        tmp_path / "run",
    )


def test_a_log_becomes_a_whole_record(words: tuple[object, ...], tmp_path: Path) -> None:
    """Its rows and requirements are those of the log, and its files are as the manifest says."""
    done = hil(*words, "--json")
    assert done.status == 0, done.err
    record = read_run(tmp_path / "run")
    assert (record.problems, record.samples["t_s"].size) == ((), 200)
    assert done.json["outcome"] == "complete"


def test_bad_input_is_one_line_and_leaves_no_folder(
    words: tuple[object, ...], tmp_path: Path
) -> None:
    """A log that is not there, one without rows, and a folder that is taken."""
    (tmp_path / "log.csv").rename(tmp_path / "moved.csv")
    assert "log.csv" in hil(*words).refusal
    (tmp_path / "log.csv").write_text("t,x\n", encoding="utf-8")
    assert "log.csv" in hil(*words).refusal
    assert not (tmp_path / "run").exists()
    (tmp_path / "moved.csv").replace(tmp_path / "log.csv")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "mine.txt").write_text("kept", encoding="utf-8")
    assert "the folder is not empty" in hil(*words).refusal
    assert [item.name for item in (tmp_path / "run").iterdir()] == ["mine.txt"]


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_in_the_middle_leaves_nothing(
    words: tuple[object, ...], tmp_path: Path, monkeypatch, number: signal.Signals, status: int
) -> None:
    """Half of a log is no record; the same command then makes the whole one."""
    append, rows = Recorder.append, []

    def stopped(self, row) -> None:
        rows.append(row)
        if len(rows) == 100:
            signal.raise_signal(number)
        append(self, row)

    with monkeypatch.context() as patch:
        patch.setattr(Recorder, "append", stopped)
        done = hil(*words)
    assert (done.status, done.out) == (status, "")
    assert done.err.splitlines()[-1].startswith("hil: stopped by ")
    assert len(rows) == 100
    assert not (tmp_path / "run").exists()
    assert hil(*words).status == 0
    assert read_run(tmp_path / "run").problems == ()
