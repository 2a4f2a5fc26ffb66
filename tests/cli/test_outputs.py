"""What a command writes beside a record: never over a record's own files, nor one output over another."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import hil as api
from hil.record.layout import FILES
from tests.cli.command import hil, run_pose

TICKS = ("--set", "duration_s=0.2")


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Two records of one scenario."""
    folder = tmp_path_factory.mktemp("outputs")
    for law in ("pid", "asg-ism"):
        run_pose("--outer", law, *TICKS, "--out", folder / law)
    return folder / "pid", folder / "asg-ism"


def contents(folder: Path) -> dict[str, bytes]:
    """Return every file of a folder."""
    return {str(file): file.read_bytes() for file in sorted(folder.rglob("*")) if file.is_file()}


def test_every_file_of_a_record_is_known_as_one(runs: tuple[Path, Path]) -> None:
    """The list of a record's own names has all that a run writes."""
    assert {file.name for file in runs[0].iterdir() if file.is_file()} <= FILES


@pytest.mark.parametrize(
    "option", ["--report", "--csv", "--rerun", "--junit"],
)  # fmt: skip
@pytest.mark.parametrize("name", ["manifest.json", "samples.parquet"])
def test_a_comparison_does_not_write_over_what_it_compares(
    runs: tuple[Path, Path], option: str, name: str
) -> None:
    """One line, and both records are as they were, to the byte."""
    before = contents(runs[0].parent)
    done = hil("compare", *runs, option, runs[0] / name)
    assert f"{option} {runs[0] / name}: is a file of a run record" in done.refusal
    assert contents(runs[0].parent) == before


def test_neither_does_an_export_nor_a_report_from_python(runs: tuple[Path, Path]) -> None:
    """The same for `hil export`, and for `Run.report`."""
    before = contents(runs[0].parent)
    target = runs[0] / "metrics.json"
    assert (
        "is a file of a run record"
        in hil("export", runs[1], "--to", "csv", "--out", target).refusal
    )
    run = api.open_record(runs[0])
    for place, said in ((target, "is a file of a run record"), (".", "cannot be written")):
        with pytest.raises(api.BadInput, match=said):
            run.report(place)
    assert contents(runs[0].parent) == before


def test_a_file_beside_those_of_a_record_is_written(runs: tuple[Path, Path]) -> None:
    """A report may lie in the folder of its record."""
    hil("compare", *runs, "--report", runs[1] / "report.html", "--csv", runs[1] / "figures.csv")
    assert (runs[1] / "report.html").stat().st_size > 1000
    assert (runs[1] / "figures.csv").read_text(encoding="utf-8").startswith("record,")


def test_two_outputs_are_two_files(runs: tuple[Path, Path], tmp_path: Path) -> None:
    """The second would take the first one's place; told before either is written."""
    one = tmp_path / "x"
    done = hil("compare", *runs, "--report", one, "--csv", tmp_path / "." / "x")
    assert "--report and --csv both name" in done.refusal
    assert not one.exists()


@pytest.mark.parametrize("option", ["--outer", "--camera", "--on"])
def test_a_variable_that_is_not_set_chooses_nothing(tmp_path: Path, option: str) -> None:
    """`--outer "$LAW"` with no LAW is not the scenario's own law."""
    assert "is empty" in run_pose(*TICKS, option, "", "--out", tmp_path / "run").refusal
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("experiment", "own.toml"), "is a scenario (base = 'lab'), a deck is needed"),
        (("check", "robot", "own.toml"), "is a scenario (base = 'lab'), a robot is needed"),
        (("falsify", "scenario-1", "--box", "none"), "box 'none'"),
    ],
)
def test_a_file_of_another_kind_is_called_what_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], says: str
) -> None:
    """A scenario where a deck is wanted is not "no built-in deck 'lab'"."""
    monkeypatch.chdir(tmp_path)
    assert hil("new", "scenario", "own").status == 0
    assert says in hil(*words).refusal


def test_a_file_of_windows_notepad_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A byte-order mark and line ends of two characters change nothing."""
    monkeypatch.chdir(tmp_path)
    assert hil("new", "scenario", "own").status == 0
    file = Path("own.toml")
    text = file.read_text(encoding="utf-8")
    plain = api.load_scenario(file)
    file.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    assert api.load_scenario(file) == plain


@pytest.mark.parametrize(
    "change",
    ["duration_s=true", "robot.mass_kg=false", "control.gains.tuned.pid.kd2_s=true"],
)  # fmt: skip
def test_true_is_no_number(tmp_path: Path, change: str) -> None:
    """It was taken for 1."""
    assert "a number is needed" in run_pose("--set", change, "--out", tmp_path / "run").refusal


@pytest.mark.parametrize("coding", ["ascii", "cp1252"])
def test_a_locale_without_greek_letters_loses_no_answer(
    runs: tuple[Path, Path], tmp_path: Path, coding: str
) -> None:
    """The table has a delta, and the JSON is JSON: as on a pipe of Windows."""
    named = tmp_path / "Läufe" / "run"
    shutil.copytree(runs[0], named)
    where = os.environ | {"PYTHONIOENCODING": coding, "PYTHONUTF8": "0"}
    table, document = (
        subprocess.run(
            [sys.executable, "-m", "hil", "compare", named, runs[1], *more],
            capture_output=True, env=where, check=False,
        )
        for more in ((), ("--json",))
    )  # fmt: skip
    assert (table.returncode, table.stderr) == (1, b"")
    assert b"\\u03b4" in table.stdout
    assert document.returncode == 1
    assert str(named) in json.dumps(json.loads(document.stdout.decode(coding)), ensure_ascii=False)
