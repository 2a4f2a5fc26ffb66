"""What others hand over can neither fill the memory, nor drive a terminal, a page or a spreadsheet."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from hil.config.load import load_scenario
from hil.core.errors import BadInput
from hil.core.files import LOG_BYTES, TEXT_BYTES
from hil.record.log_import import import_log
from hil.record.reader import read_run
from hil.record.rrd import write_rrd
from hil.record.tlog import read_tlog
from hil.report.compare import compare_runs
from hil.report.csv_table import write_csv
from hil.report.html import render
from hil.runs.execute import RunSpec, execute
from hil.tools.serve_folder import default_names, user_folder

pytestmark = pytest.mark.realtime

HIL = [sys.executable, "-m", "hil"]
FORMULA = '=HYPERLINK("http://x","y")'
MARKUP = "[red]x[/red]<script>alert(1)</script>"
CONTROL = "\x1b[31mred\x1b]0;t\x07"


def sparse(path: Path, size: int) -> Path:
    """Make a file that is as large as it says and takes no room."""
    with path.open("wb") as file:
        file.truncate(size)
    return path


@pytest.mark.parametrize("name", ["big.toml", "law.py"])
def test_a_text_of_a_gigabyte_is_refused_unread(tmp_path: Path, name: str) -> None:
    """One line with the size and the limit, status 2."""
    big = sparse(tmp_path / name, 1_000_000_000)
    arguments = [str(big)] if name == "big.toml" else ["circle", "--outer", str(big)]
    done = subprocess.run(
        [*HIL, "run", *arguments], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert done.returncode == 2, done.stderr
    assert f"1000000000 bytes; at most {TEXT_BYTES} bytes" in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("name", ["log.tlog", "log.csv"])
def test_a_log_of_a_gigabyte_is_refused_unread(tmp_path: Path, name: str) -> None:
    """So are logs, with a limit of their own."""
    big = sparse(tmp_path / name, 1_000_000_000)
    with pytest.raises(BadInput, match=r"1000 MB, the limit is"):
        import_log(big, None, tmp_path / "out", "hil import")
    if name.endswith("tlog"):
        with pytest.raises(BadInput, match=f"at most {LOG_BYTES} bytes"):
            list(read_tlog(big))


def test_endless_files_are_no_scenarios() -> None:
    """A device that never ends is read to the limit only."""
    with pytest.raises(BadInput):
        load_scenario("/dev/zero")


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a short record whose free texts are hostile: name, description, outcome, events, versions."""
    folder = tmp_path_factory.mktemp("hostile") / "run"
    scenario = load_scenario("scenario-1", ["duration_s=0.5"])
    execute(RunSpec(scenario, "twin", "pose", "pid", "asg-ism", 1, folder, rerun=False))
    path = folder / "manifest.json"
    tree = json.loads(path.read_text())
    tree["scenario"]["description"] = MARKUP + CONTROL
    tree |= {"target": FORMULA, "camera": f"-1{CONTROL}", "command": MARKUP + CONTROL}
    tree |= {"outcome": "fault", "outcome_detail": MARKUP + CONTROL, "git_revision": MARKUP}
    tree["versions"] = {MARKUP: CONTROL + MARKUP}
    path.write_text(json.dumps(tree))
    with (folder / "events.jsonl").open("a") as events:
        events.write(json.dumps({"t_s": 0.5, "kind": MARKUP, "text": MARKUP + CONTROL}) + "\n")
    return folder


def test_a_spreadsheet_runs_no_formula(hostile: Path, tmp_path: Path) -> None:
    """A cell that would be one begins with an apostrophe; controls are made visible."""
    table = tmp_path / "t.csv"
    write_csv(table, [read_run(hostile)])
    with table.open(newline="") as file:
        (row,) = csv.DictReader(file)
    assert row["target"] == "'" + FORMULA
    assert row["camera"].startswith("'-1\\x1b")
    assert "\x1b" not in table.read_text()
    assert float(row["seed"]) == 1


def test_the_report_holds_no_script_and_no_control_character(hostile: Path) -> None:
    """Everything a record says is text in the page."""
    run = read_run(hostile)
    page = render([compare_runs([run, run])], command=MARKUP + CONTROL, title=MARKUP)
    assert "<script>alert" not in page
    assert "\x1b" not in page
    assert "\x07" not in page


def test_the_viewer_is_given_no_control_character(hostile: Path, tmp_path: Path) -> None:
    """Names and events of the Rerun file are text that shows."""
    run = read_run(hostile)
    scenario = run.manifest.scenario | {"name": MARKUP + CONTROL}
    named = replace(run, manifest=run.manifest.model_copy(update={"scenario": scenario}))
    write_rrd(tmp_path / "run.rrd", [named])
    data = (tmp_path / "run.rrd").read_bytes()
    assert b"\x1b[31m" not in data
    assert b"\x1b]0;" not in data
    assert b"\\x1b[31mred" in data


def test_a_terminal_is_shown_what_was_typed(hostile: Path) -> None:
    """No escape sequence reaches stdout or stderr of the command that looks at the record."""
    done = subprocess.run(
        [*HIL, "compare", str(hostile), str(hostile)], capture_output=True, text=True, check=False
    )
    assert "\x1b" not in done.stdout + done.stderr
    assert "Traceback" not in done.stderr


def test_the_twin_serves_in_a_folder_of_the_user_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Mode 0700 in the user's runtime folder; one that others can use is refused."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    folder = user_folder()
    assert folder == tmp_path / "hil"
    assert folder.stat().st_mode & 0o777 == 0o700
    names = [pair[0].name for pair, _ in zip(default_names(), range(2), strict=False)]
    assert names == ["twin", "twin-2"]
    folder.chmod(0o755)
    with pytest.raises(BadInput, match="only you can use"):
        user_folder()


def test_two_twins_serve_side_by_side(tmp_path: Path) -> None:
    """The second takes names of its own; both clean up behind them."""
    environment = os.environ | {"XDG_RUNTIME_DIR": str(tmp_path)}
    serve = [*HIL, "twin", "serve", "--camera", "pose"]
    both = [
        subprocess.Popen(serve, env=environment, stderr=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    try:
        deadline_s = time.monotonic() + 30.0
        names = {"twin", "twin.sock", "twin-2", "twin-2.sock"}
        while time.monotonic() < deadline_s and not names <= _names(tmp_path / "hil"):
            time.sleep(0.05)
        assert names <= _names(tmp_path / "hil")
    finally:
        for server in both:
            server.terminate()
        said = [server.communicate(timeout=20)[1] for server in both]
    assert [server.returncode for server in both] == [143, 143], said
    assert not names & _names(tmp_path / "hil")


def _names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()} if folder.is_dir() else set()
