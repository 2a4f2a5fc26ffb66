"""`hil experiment` from the command line: its report, its refusals, and what stops it on the way."""

from __future__ import annotations

import json
import shutil
import signal
from pathlib import Path

import pytest

from hil.config.deck import load_deck
from hil.record.manifest import read_manifest
from hil.study.experiment import Conditions, claim, deck_specs
from hil.study.side_by_side import run_all
from hil.study.work_folder import sole_writer
from tests.studies.commands import hil, stopped

pytestmark = pytest.mark.realtime

DECK = 'scenarios = ["scenario-1"]\nlaws = ["pid", "asg-ism"]\n'
WORDS = ["experiment", "deck.toml", "--camera", "pose", "--set", "duration_s=0.6", "--out", "e"]
RUNS = ("scenario-1-pid", "scenario-1-asg-ism")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with deck.toml and its finished experiment in `e`."""
    folder = tmp_path_factory.mktemp("experiment")
    (folder / "deck.toml").write_text(DECK, encoding="utf-8")
    said = hil(folder, *WORDS, "--json")
    assert said.returncode == 1, said.stderr  # nobody rests at the point after 0.6 s
    (folder / "said.json").write_text(said.stdout, encoding="utf-8")
    return folder


def inodes(folder: Path) -> list[int]:
    return [(folder / run / "samples.parquet").stat().st_ino for run in RUNS]


def test_one_report_of_all_runs(made: Path) -> None:
    """Both laws of the deck, each with a whole record, and nothing else in the folder."""
    said = json.loads((made / "said.json").read_text(encoding="utf-8"))
    assert said["report"] == "e/report.html"
    assert len(said["comparisons"]) == 1
    names = {item.name for item in (made / "e").iterdir()}
    assert names == {"experiment.json", "report.html", *RUNS}
    assert {read_manifest(made / "e" / run).outcome for run in RUNS} == {"complete"}


def test_bad_input_is_one_line(tmp_path: Path) -> None:
    """A deck of what is not there is refused before anything is made."""
    (tmp_path / "deck.toml").write_text(DECK.replace("scenario-1", "scenario-9"), encoding="utf-8")
    said = hil(tmp_path, *WORDS)
    assert (said.returncode, said.stdout, said.stderr.count("\n")) == (2, "", 1)
    assert "scenario-9" in said.stderr
    assert not (tmp_path / "e").exists()


def test_damaged_record_is_made_anew(made: Path, tmp_path: Path) -> None:
    """It is set aside and told; the record of the other law stays, the plan is made anew as well."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    folder = tmp_path / "e"
    before = inodes(folder)
    samples = folder / RUNS[0] / "samples.parquet"
    whole = samples.read_bytes()
    samples.write_bytes(whole[:2000])
    (folder / "experiment.json").write_bytes(b"")
    said = hil(tmp_path, *WORDS, "--json")
    assert said.returncode == 1
    assert f"e/{RUNS[0]}: samples.parquet has 2000 bytes" in said.stderr
    assert "experiment.json: damaged or lost" in said.stderr
    assert "1 of 2 runs are there already" in said.stderr
    assert (folder / "set-aside" / f"{RUNS[0]}-1").is_dir()
    assert inodes(folder)[1] == before[1]
    assert samples.read_bytes() == whole
    assert json.loads((folder / "experiment.json").read_bytes())["runs"]


@pytest.mark.parametrize(
    ("file", "damage", "lost"),
    [
        ("inputs.tape", lambda path: path.unlink(), True),
        ("manifest.json", lambda path: path.write_bytes(b""), True),
        ("manifest.json", lambda path: path.unlink(), True),
        ("frames.parquet", lambda path: path.write_bytes(bytes(path.stat().st_size)), True),
        ("run.rrd", lambda path: path.unlink(), False),  # may be deleted to save space
    ],
)
def test_what_a_damaged_file_costs(made: Path, tmp_path: Path, file: str, damage, lost) -> None:
    """Its own run, unless it is only looked at; never another one."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    conditions = Conditions("twin", "pose", "asg-ism", 1, 1, ("duration_s=0.6",), "test")
    specs = deck_specs(load_deck(str(tmp_path / "deck.toml")), conditions, tmp_path / "e")
    damage(tmp_path / "e" / RUNS[0] / file)
    said: list[str] = []
    assert claim(tmp_path / "e", specs, said.append) == (specs[:1] if lost else [])
    assert [file in line for line in said] == ([True] if lost else [])


def test_damaged_plan_of_another_experiment_is_not_taken_over(made: Path, tmp_path: Path) -> None:
    """Without its plan the records say whose they are."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    (tmp_path / "e/experiment.json").unlink()
    before = inodes(tmp_path / "e")
    said = hil(tmp_path, *WORDS, "--seed", "2")
    assert said.returncode == 2
    assert "is not one of this command's" in said.stderr
    assert inodes(tmp_path / "e") == before


def test_one_writer_at_a_time(made: Path, tmp_path: Path) -> None:
    """A second command on a folder that is being written to is refused."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    with sole_writer(tmp_path / "e/.lock", "test"):
        said = hil(tmp_path, *WORDS)
    assert said.returncode == 2
    assert "is writing there" in said.stderr


def test_stopped_experiment_goes_on(tmp_path: Path) -> None:
    """Runs under way are stopped and closed, no worker is left, the same command does the rest."""
    (tmp_path / "deck.toml").write_text(DECK, encoding="utf-8")
    words = [*WORDS, "--repeats", "2"]
    for number, expected in ((signal.SIGTERM, 143), (signal.SIGKILL, -signal.SIGKILL)):
        status, errors = stopped(tmp_path, words, number, workers=2)
        assert status == expected
        assert "Traceback" not in errors
        for manifest in (tmp_path / "e").glob("*/manifest.json"):
            assert read_manifest(manifest.parent).outcome != "running"
    conditions = Conditions("twin", "pose", "asg-ism", 1, 2, ("duration_s=0.6",), "test")
    specs = deck_specs(load_deck(str(tmp_path / "deck.toml")), conditions, tmp_path / "e")
    run_all(claim(tmp_path / "e", specs), lambda _name, _t_s: None)
    records = [read_manifest(p.parent) for p in (tmp_path / "e").glob("scenario-*/manifest.json")]
    assert sorted((r.outer, r.seed) for r in records) == [
        ("asg-ism", 1), ("asg-ism", 2), ("pid", 1), ("pid", 2),
    ]  # fmt: skip
    assert {r.outcome for r in records} == {"complete"}
