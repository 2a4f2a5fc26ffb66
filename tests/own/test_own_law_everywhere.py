"""An own law in a file, in every command that takes a law: experiment, sweep, tune, replay, a scenario."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from hil.core.errors import BadInput
from hil.core.registries import OUTER_LAWS
from hil.study.campaign.plan import load_campaign
from hil.study.tune import boxes_of
from hil.study.tuning_verdict import pairs_of
from tests.cli.command import hil, run_pose
from tests.own.starts import law_text, written

DECK = 'scenarios = ["./short.toml"]\nlaws = ["pid"]\n'
SHORT = 'base = "scenario-1"\nname = "short"\nduration_s = 0.5\n'


@pytest.fixture
def law(tmp_path: Path) -> Path:
    """Return a law's file beside a short scenario and a deck."""
    written(tmp_path / "short.toml", SHORT)
    written(tmp_path / "deck.toml", DECK.replace("./short", str(tmp_path / "short")))
    return written(tmp_path / "everywhere.py", law_text("everywhere"))


def test_experiment_runs_it_beside_the_built_in_ones(law: Path, tmp_path: Path):
    """--outer is repeatable and takes the place of the deck's laws; the report names all three."""
    out = tmp_path / "exp"
    done = hil(
        "experiment", tmp_path / "deck.toml", "--camera", "pose", "--out", out,
        "--outer", law, "--outer", "pid", "--outer", "asg-ism",
    )  # fmt: skip
    assert done.status == 1, done.err
    found = {path.parent.name for path in out.glob("*/manifest.json")}
    assert found == {"short-everywhere", "short-pid", "short-asg-ism"}
    assert "everywhere" in (out / "report.html").read_text()
    table = hil("compare", *sorted(path.parent for path in out.glob("*/manifest.json")), "--json")
    assert "everywhere" in table.out
    twice = hil("experiment", tmp_path / "deck.toml", "--outer", law, "--outer", law)
    assert "'everywhere' is listed 2 times" in twice.refusal
    # Another text of the law is another experiment.
    law.write_text(law.read_text() + "# edited\n")
    again = hil(
        "experiment", tmp_path / "deck.toml", "--camera", "pose", "--out", out,
        "--outer", law, "--outer", "pid", "--outer", "asg-ism",
    )  # fmt: skip
    assert "another experiment" in again.refusal


def test_campaign_runs_it_and_its_text_belongs_to_the_campaign(law: Path, tmp_path: Path):
    """`outer = ["./law.py"]` counts from the campaign's folder; workers know the law."""
    text = (
        'scenario = "./short.toml"\nouter = ["./everywhere.py", "pid"]\n'
        '[grid]\n"control.gains.tuned.everywhere.speed_s" = [0.5, 1.0]\n'
    )
    file = written(tmp_path / "c.toml", text)
    digest = load_campaign(str(file)).digest
    done = hil("sweep", file, "--out", tmp_path / "sweep", "--workers", "2")
    assert done.status == 1, done.err
    rows = pq.read_table(tmp_path / "sweep" / "results.parquet").to_pylist()
    assert sorted({row["outer"] for row in rows}) == ["everywhere", "pid"]
    assert {row["outcome"] for row in rows} == {"complete"}
    law.write_text(law.read_text() + "# edited\n")
    assert load_campaign(str(file)).digest != digest


def test_tune_searches_the_box_it_declares(law: Path, tmp_path: Path):
    """The gains found lie in the law's box; it is judged against both built-in laws."""
    out = tmp_path / "found.toml"
    done = hil(
        "tune", tmp_path / "short.toml", "--outer", law, "--candidates", 11, "--held-out", 2,
        "--workers", 2, "--out", out, "--json",
    )  # fmt: skip
    assert done.status == 0, done.err
    table = tomllib.loads(out.read_text())
    assert 0.2 <= table["everywhere"]["speed_s"] <= 5.0
    assert table["origin"]["candidates_everywhere"] == 11
    assert [set(v) - {"seeds", "failed"} for v in done.json["verdicts"]] == [
        {"everywhere - pid"}, {"everywhere - asg-ism"},
    ]  # fmt: skip


def test_a_law_without_a_box_cannot_be_tuned(tmp_path: Path):
    """A law that declares no search, or a box that is none, is one line and nothing is written."""
    text = law_text("boxless")
    box = 'search={"speed_s": (0.2, 1.0, 5.0), "turn_rad_s": (0.5, 2.0, 10.0)},'
    assert box in text
    none = written(tmp_path / "none.py", text.replace(box, ""))
    out = ("--out", tmp_path / "x.toml")
    assert "declares no search box" in hil("tune", "--outer", none, *out).refusal
    bad = written(
        tmp_path / "bad.py",
        text.replace(box, 'search={"speed_s": (5.0, 1.0, 0.2)},').replace("boxless", "badbox"),
    )
    assert "0 < least <= start <= largest" in hil("tune", "--outer", bad, *out).refusal
    assert not (tmp_path / "x.toml").exists()
    with pytest.raises(BadInput, match="near: pid"):
        boxes_of(["pidd"])


def test_which_laws_are_set_against_which():
    """The built-in pair as ever; an own law against both; two own ones also against each other."""
    assert pairs_of(["asg-ism", "pid"]) == [("asg-ism", "pid")]
    assert pairs_of(["mine"]) == [("mine", "pid"), ("mine", "asg-ism")]
    assert ("one", "two") in pairs_of(["one", "two"])


def test_replay_shadows_a_built_in_run_with_it(law: Path, tmp_path: Path):
    """What the own law would have commanded in each state of a PID run, with its gains set."""
    run = tmp_path / "run"
    assert run_pose("--outer", "pid", "--set", "duration_s=1", "--out", run).status == 1
    done = hil(
        "replay", run, "--outer", law, "--set", "control.gains.tuned.everywhere.speed_s=0.5", "--json"
    )  # fmt: skip
    assert done.status == 0, done.err
    assert (done.json["kind"], done.json["law"]) == ("shadow", "everywhere")


@pytest.mark.usefixtures("law")
def test_a_scenario_names_it(tmp_path: Path):
    """`control.outer = "./law.py"` counts from the scenario's folder, and its gains stand below."""
    file = written(
        tmp_path / "s.toml",
        SHORT + '[control]\nouter = "./everywhere.py"\n'
        "[control.gains.tuned.everywhere]\nspeed_s = 0.8\n",
    )
    out = tmp_path / "run"
    done = hil("run", file, "--camera", "pose", "--out", out)
    assert done.status == 1, done.err
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest["outer"] == "everywhere"
    assert manifest["gains"]["outer"]["speed_s"] == 0.8
    assert hil("replay", out).status == 0


def test_required_gains_start_where_the_search_does(tmp_path: Path):
    """A law whose gains have no defaults runs with the start of its search."""
    text = law_text("starting").replace('"speed per distance to the point", 1.0,', '"speed",')
    file = written(tmp_path / "starting.py", text)
    out = tmp_path / "run"
    assert run_pose("--outer", file, "--set", "duration_s=1", "--out", out).status == 1
    gains = json.loads((out / "manifest.json").read_text())["gains"]["outer"]
    assert gains == {"speed_s": 1.0, "turn_rad_s": 2.0}
    assert OUTER_LAWS.get("starting").search["speed_s"] == (0.2, 1.0, 5.0)
