"""How runs end that have no figures: status, JSON and report say what happened."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from hil.record.manifest import read_manifest
from hil.record.reader import read_run
from hil.runs.execute import execute
from tests.cli.command import hil, run_pose

CAUSES = [
    ("camera.drop_ratio=1", "camera: robot seen 0 times"),
    ("start.x_m=5", "geofence: robot seen at (5.000"),
    ('faults=[{kind="link_cut"}]', ""),
    ('faults=[{kind="camera_stall"}]', "camera: "),
]


@pytest.mark.parametrize(("change", "cause"), CAUSES)
def test_a_fault_before_the_first_tick_is_status_3_with_its_cause(
    tmp_path: Path, change: str, cause: str
) -> None:
    """JSON has outcome, detail and null figures; the record is sealed and can be read again."""
    done = run_pose("--set", change, "--json", "--out", tmp_path / "run")
    assert done.status == 3
    assert done.json["outcome"] == "fault"
    assert cause in done.json["detail"]
    assert done.json["detail"]
    assert {figure["value"] for figure in done.json["figures"].values()} == {None}
    assert not any(item["holds"] for item in done.json["requirements"])
    assert read_manifest(tmp_path / "run").files["metrics.json"].bytes > 0
    assert read_run(tmp_path / "run").problems == ()


def test_a_fault_without_json_tells_cause_and_place(tmp_path: Path) -> None:
    """People get the cause in the first line and the record's folder in the last."""
    done = run_pose("--set", "start.x_m=5", "--out", tmp_path / "run")
    assert done.status == 3
    assert "fault - geofence" in done.out.splitlines()[0]
    assert done.out.splitlines()[-1] == f"record: {tmp_path / 'run'}"


def test_a_whole_run_of_one_tick_has_no_figures_and_fails_its_requirements(tmp_path: Path) -> None:
    """Nothing is said of a run of one tick: complete, null figures, status 1."""
    done = run_pose("--set", "duration_s=0.01", "--json", "--out", tmp_path / "run")
    assert done.status == 1
    assert done.json["outcome"] == "complete"
    assert done.json["figures"]["ise_m2_s"]["value"] is None


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Do an experiment's runs in this process, and without section 8.9: both cost seconds."""
    monkeypatch.setattr("hil.study.experiment.circle_study", lambda: None)
    monkeypatch.setattr(
        "hil.study.side_by_side.run_all", lambda specs, _: [execute(s) for s in specs]
    )


@pytest.mark.usefixtures("here")
def test_one_run_without_ticks_does_not_take_the_report_with_it(tmp_path: Path) -> None:
    """The experiment's report has the run as a fault, status 3; the same again when taken up."""
    away = tmp_path / "away.toml"
    away.write_text('base = "scenario-2"\nname = "away"\n[start]\nx_m = 5.0\n', encoding="utf-8")
    deck = tmp_path / "deck.toml"
    deck.write_text(f'scenarios = ["scenario-1", "{away}"]\n', encoding="utf-8")
    command = ("experiment", deck, "--camera", "pose", "--set", "duration_s=0.5")
    done = hil(*command, "--out", tmp_path / "e", "--json")
    assert done.status == 3
    runs = [run for item in done.json["comparisons"] for run in item["runs"]]
    assert [run["outcome"] for run in runs] == ["complete"] * 2 + ["fault"] * 2
    assert "geofence" in (tmp_path / "e" / "report.html").read_text(encoding="utf-8")
    (tmp_path / "e" / "report.html").unlink()
    again = hil(*command, "--out", tmp_path / "e")
    assert again.status == 3
    assert "4 of 4 runs are there already" in again.err
    assert "away" in again.out
    assert (tmp_path / "e" / "report.html").is_file()


@pytest.mark.usefixtures("here")
def test_a_deck_with_one_law_gives_a_report_of_one_run(
    tmp_path: Path,
) -> None:
    """One run is reported as it is, with nothing to compare it with."""
    deck = tmp_path / "deck.toml"
    deck.write_text('scenarios = ["scenario-1"]\nlaws = ["pid"]\n', encoding="utf-8")
    done = hil("experiment", deck, "--camera", "pose", "--set", "duration_s=0.5",
               "--out", tmp_path / "e", "--json")  # fmt: skip
    assert done.status == 1  # the robot is not there after half a second
    assert len(done.json["comparisons"][0]["runs"]) == 1
    assert done.json["comparisons"][0]["findings"] == ["One run: nothing to compare it with."]
    assert (tmp_path / "e" / "report.html").is_file()


def test_a_campaign_survives_runs_of_one_tick_and_says_how_runs_ended(tmp_path: Path) -> None:
    """Rows without figures are rows; a failed requirement is status 1, a fault 3."""
    file = tmp_path / "c.toml"
    head = 'scenario = "scenario-1"\n[grid]\n"link.latency_s" = [0.02, 0.03]\n'
    file.write_text(f'set = ["duration_s=0.01"]\n{head}', encoding="utf-8")
    done = hil("sweep", file, "--workers", 1, "--out", tmp_path / "one", "--json")
    assert done.status == 1
    assert (done.json["runs"], done.json["requirements_hold"]) == (4, 0)
    file.write_text(f'set = ["start.x_m=5"]\n{head}', encoding="utf-8")
    done = hil("sweep", file, "--workers", 1, "--out", tmp_path / "two", "--json")
    assert (done.status, done.json["ended_early"]) == (3, 4)


def test_compare_and_import_end_with_the_status_of_their_runs(tmp_path: Path) -> None:
    """A failed requirement is 1 and a fault 3, as `hil --help` says of every command."""
    run_pose("--set", "duration_s=0.5", "--out", tmp_path / "a")
    assert hil("compare", tmp_path / "a", tmp_path / "a").status == 1
    log, mapping = tmp_path / "log.csv", tmp_path / "map.toml"
    log.write_text("t,x,y,th\n0,0,0,0\n1,0.1,0,0\n2,0.2,0,0\n", encoding="utf-8")
    limits = 'requirements=[{metric="path_length_m",max=PLACE}]'
    for number, (limit, status) in enumerate((("0.1", 1), ("0.3", 0))):
        mapping.write_text(
            f"set = ['{limits.replace('PLACE', limit)}']\nt = {{ column = \"t\" }}\n[columns]\n"
            + "".join(
                f'est_{name} = {{ column = "{column}" }}\n'
                for name, column in (("x_m", "x"), ("y_m", "y"), ("theta_rad", "th"))
            ),
            encoding="utf-8",
        )
        done = hil("import", log, "--map", mapping, "--out", tmp_path / f"log-{number}", "--json")
        assert (done.status, done.json["requirements"][0]["holds"]) == (status, status == 0)


def test_requirements_that_hold_are_status_0(tmp_path: Path) -> None:
    """The negative control: the same commands end with 0 where everything holds."""
    asked = 'requirements=[{metric="duration_s",min=0.4}]'
    for name in ("a", "b"):
        out = tmp_path / name
        assert run_pose("--set", "duration_s=0.5", "--set", asked, "--out", out).status == 0
    assert hil("compare", tmp_path / "a", tmp_path / "b").status == 0
    assert json.loads((tmp_path / "a" / "metrics.json").read_bytes())["requirements"][0]["holds"]
