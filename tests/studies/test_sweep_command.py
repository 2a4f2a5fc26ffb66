"""`hil sweep` from the command line: its answers, its refusals, and what stops it on the way."""

from __future__ import annotations

import json
import os
import shutil
import signal
from pathlib import Path

import pytest

from hil.study.campaign.plan import Campaign, load_campaign
from hil.study.campaign.results import ResultStore
from hil.study.campaign.work import run_campaign
from hil.study.work_folder import Terminated, sole_writer
from tests.studies.commands import hil, stopped

pytestmark = pytest.mark.realtime

# The start at 5 m lies outside the fence: every run there is a fault.
TEXT = """
scenario = "scenario-1"
set = ["duration_s=0.6", "requirements=[]"]
seeds = 2
[grid]
"start.x_m" = [-0.6, 5.0]
"""


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with c.toml and its finished campaign in `s`."""
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "c.toml").write_text(TEXT, encoding="utf-8")
    made = hil(folder, "sweep", "c.toml", "--out", "s", "--workers", "1", "--json")
    assert made.returncode == 3, made.stderr
    (folder / "said.json").write_text(made.stdout, encoding="utf-8")
    return folder


def copy(campaign: Path, folder: Path) -> Path:
    shutil.copytree(campaign, folder, dirs_exist_ok=True)
    return folder / "s"


def test_answers_say_where_nothing_can_be_said(campaign: Path) -> None:
    """Runs outside the fence are counted with their cause, and their place has no verdict."""
    said = json.loads((campaign / "said.json").read_text(encoding="utf-8"))
    assert said["endings"]["fault"]["runs"] == 4
    assert said["endings"]["fault"]["commonest_cause"].startswith("geofence")
    inside, outside = said["answers"][0]["stations"]
    assert (inside["pairs"], outside["pairs"]) == (2, 0)
    assert outside["verdict"] == "without runs to compare"
    assert inside["verdict"] in {"better", "worse", "not told apart"}
    ((name, rows),) = said["programs"].items()
    assert name.startswith("skid-steer-hil ")
    assert rows == 8
    page = (campaign / "s/report.html").read_text(encoding="utf-8")
    assert "4 of 8 runs ended in a fault" in page
    assert f"Made by {name}" in page
    assert "without runs to compare at 5" in page


def test_a_campaign_without_one_whole_run_is_no_success(tmp_path: Path) -> None:
    """All in a fault: said with the cause, and the exit status of a fault."""
    text = TEXT.replace("-0.6, 5.0", "5.0").replace("seeds = 2", "seeds = 1")
    (tmp_path / "c.toml").write_text(text, encoding="utf-8")
    made = hil(tmp_path, "sweep", "c.toml", "--out", "s", "--workers", "1")
    assert made.returncode == 3
    assert "2 of 2 runs ended in a fault (most often: geofence: robot seen at (5.000" in made.stdout
    assert "not told apart" not in made.stdout


def test_bad_input_is_one_line(tmp_path: Path) -> None:
    """A value that no scenario has is refused before anything is made."""
    (tmp_path / "c.toml").write_text(TEXT + '"link.latenzy_s" = [0.1]\n', encoding="utf-8")
    made = hil(tmp_path, "sweep", "c.toml", "--out", "s")
    assert (made.returncode, made.stdout, made.stderr.count("\n")) == (2, "", 1)
    assert "link.latency_s" in made.stderr
    assert not (tmp_path / "s").exists()


def test_leftovers_and_damage_are_mended_and_told(campaign: Path, tmp_path: Path) -> None:
    """A torn part, cut results and an emptied plan: the same command ends with the same file."""
    store = copy(campaign, tmp_path)
    whole = (store / "results.parquet").read_bytes()
    (store / "parts").mkdir()
    (store / "parts/000000000-113.parquet.part").write_bytes(whole[:100])
    (store / "parts/000000000-3.parquet").write_bytes(whole[:-1])
    (store / "results.parquet").write_bytes(whole[:3000])
    (store / "campaign.json").write_bytes(b"")
    made = hil(tmp_path, "sweep", "c.toml", "--out", "s", "--workers", "1")
    assert made.returncode == 3, made.stderr
    for name in ("campaign.json", "results.parquet", "000000000-3.parquet"):
        assert f"{name}: damaged" in made.stderr
    assert (store / "results.parquet").read_bytes() == whole
    assert sorted(item.name for item in store.iterdir()) == [
        "campaign.json", "report.html", "results.parquet", "set-aside",
    ]  # fmt: skip
    assert json.loads((store / "campaign.json").read_bytes())["campaign"]["name"] == "c"


def test_start_that_was_cut_off_is_an_empty_folder(campaign: Path, tmp_path: Path) -> None:
    """Only the plan's own leftover is there: the campaign begins."""
    (tmp_path / "campaign.json.part").write_bytes(b"{")
    store = ResultStore(tmp_path, load_campaign(str(campaign / "c.toml")))
    assert not store.done.any()
    assert sorted(item.name for item in tmp_path.iterdir()) == ["campaign.json", "parts"]


def test_one_writer_at_a_time(campaign: Path, tmp_path: Path) -> None:
    """A second command on a folder that is being written to is refused."""
    store = copy(campaign, tmp_path)
    with sole_writer(store / ".lock", "test"):
        made = hil(tmp_path, "sweep", "c.toml", "--out", "s")
    assert made.returncode == 2
    assert "is writing there" in made.stderr


def test_sigterm_keeps_the_rows_there_are(tmp_path: Path) -> None:
    """Rows that came before the signal are on disk, and are not run again."""
    campaign = longer(tmp_path)

    def stop(done: int, _total: int) -> None:
        if done == 5:
            os.kill(os.getpid(), signal.SIGTERM)

    with pytest.raises(Terminated):
        run_campaign(campaign, tmp_path / "s", 1, progress=stop)
    _, totals = run_campaign(campaign, tmp_path / "s", 1)
    assert (totals.runs, totals.runs_now) == (20, 15)


def test_killed_campaign_leaves_no_worker_and_goes_on(tmp_path: Path) -> None:
    """The caller of a pipeline sees its end, and the same command does the rest."""
    longer(tmp_path)
    words = ["sweep", "c.toml", "--out", "s", "--workers", "2"]
    status, _ = stopped(tmp_path, words, signal.SIGKILL, workers=2)
    assert status == -signal.SIGKILL
    made = hil(tmp_path, *words, "--json")
    assert made.returncode == 0, made.stderr
    assert json.loads(made.stdout)["runs"] == 20


def longer(folder: Path) -> Campaign:
    """Return a campaign of 20 runs inside the fence, written to c.toml."""
    path = folder / "c.toml"
    path.write_text(TEXT.replace(", 5.0", "").replace("seeds = 2", "seeds = 10"), encoding="utf-8")
    return load_campaign(str(path))
