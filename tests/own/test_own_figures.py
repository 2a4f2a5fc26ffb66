"""Figures of merit and tuning costs from files: where they appear, what they cannot do, refusals."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import hil as api
from hil.analysis.costs import COST_FAILED, cost_of
from hil.core.errors import BadInput
from hil.core.figures import BESIDE, BY_NAME, metric_of
from hil.core.registries import FIGURES
from hil.core.time_limit import TooLongError, time_limit
from hil.record.manifest import read_manifest
from hil.record.reader import read_run
from hil.report.csv_table import write_csv
from hil.study.campaign.plan import ROW_COLUMNS
from tests.cli.command import hil, run_pose
from tests.own.starts import figure_text, template, written
from tests.own.test_docs import refused, shorter, walk

NEAR = template("figure.py", "near")
COST = template("cost.py", "own-cost")
BRIEF = ("--set", "duration_s=1.0")


def test_page_on_own_figures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Every block of the page, in its order; runs at their full length, searches shortened."""
    monkeypatch.chdir(tmp_path)
    slow = {"tune", "experiment"}
    done = walk("own-figure.md", lambda words: shorter(words) if words[0] in slow else words)
    early = {line for line, end in done if end.status == 1}
    assert all(line.startswith("hil experiment") for line in early)
    assert refused(done) == []
    assert len(done) == 11
    assert metric_of("stray_m").unit == "m"
    assert "largest stray" in Path("both.html").read_text()
    assert "largest stray" in dict(done)["hil compare run other --report both.html"].out
    assert "stray_m" in pq.read_table("campaign/results.parquet").column_names
    (gains,) = Path().glob("straight.toml")
    assert 'cost = "straight (error over time and stray)"' in gains.read_text()


def test_a_figure_stands_beside_the_built_in_ones_and_is_kept(tmp_path: Path):
    """Value by hand from the columns; metrics.json, --json, CSV, and text and hash in the record."""
    file = written(tmp_path / "near.py", NEAR)
    out = tmp_path / "run"
    done = run_pose("--figure", file, "--outer", "pid", "--json", "--out", out)
    assert done.status == 0, done.err
    table = pq.read_table(out / "samples.parquet").to_pydict()
    error = np.hypot(table["true_delta1_x_m"], table["true_delta1_y_m"])
    steps = zip(np.diff(table["t_s"]), error, strict=False)
    by_hand = sum(dt_s for dt_s, far_m in steps if far_m <= 0.05)
    kept = json.loads((out / "metrics.json").read_text())["figures"]["near"]
    assert kept == {"value": pytest.approx(by_hand), "unit": "s"}
    assert done.json["figures"]["near"] == kept
    (plugin,) = read_manifest(out).plugins
    assert plugin.sha256 == hashlib.sha256(NEAR.encode()).hexdigest()
    assert (out / plugin.file).read_text() == NEAR
    assert hil("compare", out, out, "--csv", tmp_path / "all.csv").status == 0
    assert (tmp_path / "all.csv").read_text().splitlines()[0].endswith(",near")


def test_samples_are_the_same_with_and_without(tmp_path: Path):
    """A figure judges a run and changes nothing in it."""
    file = written(tmp_path / "near.py", NEAR)
    digests = []
    for name, more in (("with", ("--figure", file)), ("without", ())):
        run_pose(*BRIEF, *more, "--out", tmp_path / name)
        digests.append(read_manifest(tmp_path / name).files["samples.parquet"].sha256)
    assert digests[0] == digests[1]


def test_a_requirement_on_it_decides_the_exit_status(tmp_path: Path):
    """By file or by name; a scenario's file names it relative to itself."""
    written(tmp_path / "near.py", NEAR)
    for metric, least, status in (("./near.py", 5.0, 0), ("./near.py", 19.0, 1), ("near", 5.0, 0)):
        figures = 'figures = ["./near.py"]\n' if metric == "near" else ""
        text = (
            f'base = "scenario-1"\nname = "held"\n{figures}[[requirements]]\nmetric = "{metric}"\n'
        )
        file = written(tmp_path / "held.toml", f"{text}min = {least}\n")
        done = hil(
            "run", file, "--camera", "pose", "--json", "--out", tmp_path / f"{metric[-2:]}{least}"
        )
        assert done.status == status, done.err
        (told,) = done.json["requirements"]
        assert told["holds"] is (status == 0)
        assert told["text"] == f"{least:g} <= near s"


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("return 1.0 / 0", r"line 8\): raised ZeroDivisionError"),
        ('return run.columns["nope"]', r"line 8\): raised KeyError: 'nope'"),
        ("return float('nan')", r"\): gave NaN"),
        ("return float('inf')", r"\): gave inf, a finite number is needed"),
        ('return "3"', r"\): gave '3', a finite number is needed"),
        ("return None", r"raised TypeError"),
        ("return run.error_m", r"raised TypeError"),
        ('run.columns["t_s"][0] = 7.0; return 1.0', r"line 8\): raised ValueError: .*read-only"),
        ("raise SystemExit(5)", r"line 8\): raised SystemExit: 5"),
        ("raise BaseException('over')", r"line 8\): raised BaseException: over"),
    ],
)
def test_one_that_fails_leaves_the_record_whole(body: str, said: str, tmp_path: Path):
    """It has no value in that run, one line says why, and a requirement on it does not hold."""
    file = written(tmp_path / "failing.py", figure_text("failing_m", body))
    out = tmp_path / "run"
    bound = f'requirements=[{{metric="{file}", max=1.0}}]'
    done = run_pose(*BRIEF, "--set", bound, "--out", out)
    assert done.status == 1, done.err
    assert done.err == ""
    notes = [line for line in done.out.splitlines() if line.startswith("note: figure of merit")]
    assert len(notes) == 1
    assert re.search(said, notes[0]), notes
    record = read_run(out)
    assert (record.problems, record.manifest.outcome) == ((), "complete")
    assert math.isnan(record.figures().values["failing_m"])
    assert math.isfinite(record.figures().values["ise_m2_s"])
    assert hil("replay", out).status == 0


def test_what_is_changed_of_the_scenario_is_not_kept(tmp_path: Path):
    """A figure that writes to the tree it was given changes its own copy: the record says what ran."""
    body = 'run.scenario["name"] = "other"; run.scenario["requirements"].clear(); return 1.0'
    file = written(tmp_path / "writing.py", figure_text("writing_m", body))
    plain, judged = run_pose(*BRIEF, "--out", tmp_path / "plain"), tmp_path / "judged"
    done = run_pose(*BRIEF, "--figure", file, "--out", judged)
    assert done.status == plain.status, done.err
    scenario = read_manifest(judged).scenario
    before = read_manifest(tmp_path / "plain").scenario
    assert scenario["name"] == "scenario-1"
    assert scenario["requirements"] == before["requirements"] != []


def passes_over() -> None:
    """Go on for ever, whatever Exception comes."""
    while True:
        with contextlib.suppress(Exception):
            sum(range(1000))


def test_time_is_up_also_for_code_that_passes_over_errors():
    """A loop that catches every Exception is ended by the limit like any other."""
    with pytest.raises(TooLongError), time_limit(0.05):
        passes_over()


def test_one_that_takes_too_long_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The record is closed all the same: Ctrl-C waits for it meanwhile."""
    monkeypatch.setattr("hil.analysis.own_figures.TIME_MAX_S", 0.05)
    file = written(tmp_path / "endless.py", figure_text("endless_m", "while True: pass"))
    done = run_pose(*BRIEF, "--figure", file, "--out", tmp_path / "run")
    assert (
        "note: figure of merit endless_m (endless.py, line 8): took longer than 0.05 s" in done.out
    )
    assert read_run(tmp_path / "run").problems == ()


def test_records_are_judged_afterwards_and_read_without_the_file(tmp_path: Path):
    """`compare --figure` computes from old records; a recorded value needs no code of anyone's."""
    file = written(tmp_path / "near.py", NEAR)
    for law in ("pid", "asg-ism"):
        run_pose("--outer", law, "--out", tmp_path / law)
    done = hil("compare", tmp_path / "pid", tmp_path / "asg-ism", "--figure", file, "--json")
    values = [run["figures"]["near"]["value"] for run in done.json["runs"]]
    assert all(15.0 < value < 20.0 for value in values)
    run_pose("--outer", "pid", "--figure", file, "--out", tmp_path / "third")
    file.unlink()
    again = hil("compare", tmp_path / "third", tmp_path / "asg-ism", "--json").json["runs"]
    assert again[0]["figures"]["near"]["value"] == values[0]
    assert "near" not in again[1]["figures"]
    assert "time within 50 mm" in hil("compare", tmp_path / "third", tmp_path / "asg-ism").out
    # Whoever judges by another text is no obstacle to an exact replay.
    assert "bit for bit" in hil("replay", tmp_path / "third").out


def test_repeats_and_campaigns_have_it(tmp_path: Path):
    """Paired differences of repeats, a column and a drawing of a campaign; workers know the file."""
    file = written(tmp_path / "near.py", NEAR)
    runs = [tmp_path / f"{law}-{seed}" for law in ("pid", "asg-ism") for seed in (1, 2)]
    for run in runs:
        law, seed = run.name.rsplit("-", 1)
        run_pose("--outer", law, "--seed", seed, "--figure", file, "--out", run)
    contrasts = hil("compare", *runs, "--json").json["statistics"]["contrasts"]
    assert contrasts[0]["figures"]["near"]["pairs"] == 2
    assert "within" in hil("compare", *runs).out.partition("All 2 seeds")[2]
    text = (
        'scenario = "scenario-1"\nfigures = ["./near.py"]\n[grid]\n"robot.mass_kg" = [3.0, 3.4]\n'
    )
    campaign = written(tmp_path / "c.toml", text)
    assert hil("sweep", campaign, "--workers", 2, "--out", tmp_path / "sweep").status == 0
    rows = pq.read_table(tmp_path / "sweep" / "results.parquet").to_pylist()
    assert len(rows) == 4
    assert all(row["near"] > 10.0 for row in rows)
    assert "time within 50 mm" in (tmp_path / "sweep" / "report.html").read_text()
    file.write_text(NEAR + "# another\n")
    assert "another campaign" in hil("sweep", campaign, "--out", tmp_path / "sweep").refusal


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "x = 1\n",
            "registers no figure of merit; a file needs a class or function under @hil.figure",
        ),
        ("def broken(:\n", "line 1: SyntaxError"),
        ("raise OSError('no disk')\n", "line 1: OSError: no disk"),
        (NEAR.replace('"near"', '"ise_m2_s"'), "two have this name"),
        (NEAR.replace('"near"', '"a b"'), "figure 'a b': a name begins with a letter"),
        (NEAR.replace('"near"', '"a-b"'), "write _ in place of -"),
        (NEAR.replace('unit="s"', "unit=3"), "unit = 3: needs a text of one line"),
        (NEAR.replace("smaller_is_better=False", 'smaller_is_better="no"'), "True, False, or None"),
    ],
)
def test_files_that_are_no_figure_are_refused(text: str, said: str, tmp_path: Path):
    """One line, status 2, and nothing written."""
    file = written(tmp_path / "wrong.py", text)
    out = tmp_path / "run"
    assert said in run_pose("--figure", file, "--out", out).refusal
    assert not out.exists()


def test_unknown_names_list_near_ones():
    """What was looked for, where, and what is near."""
    assert "no such figure" in run_pose("--figure", "ise").refusal
    assert "near: ise_m2_s" in run_pose("--figure", "ise").refusal
    refusal = hil("tune", "--cost", "usul", "--out", "never.toml").refusal
    assert "tuning cost 'usul'" in refusal
    assert "near: usual" in refusal


def test_two_figures_of_one_name_are_both_named(tmp_path: Path):
    """A second file with a figure of the same name is refused, with both files."""
    one, two = (written(tmp_path / f"{name}.py", NEAR) for name in ("one", "two"))
    refusal = run_pose("--figure", one, "--figure", two, "--out", tmp_path / "run").refusal
    assert str(one) in refusal
    assert str(two) in refusal


def test_one_file_may_hold_a_law_a_figure_and_a_cost(tmp_path: Path):
    """Each is known with the file as its origin, whichever of them loads it first."""
    file = written(
        tmp_path / "lab.py", template("law.py", "lab-law") + "\n\n" + NEAR + "\n\n" + COST
    )
    out = tmp_path / "run"
    done = run_pose(*BRIEF, "--outer", file, "--figure", file, "--out", out)
    assert done.status == 1, done.err
    assert {(p.kind, p.name) for p in read_manifest(out).plugins} == {
        ("outer law", "lab-law"),
        ("figure of merit", "near"),
    }
    assert cost_of(f"{file}:own-cost").name == "own-cost"


def test_an_installed_package_brings_both(tmp_path: Path):
    """Entry points make the names known; a package that fails is told and breaks nothing."""
    written(tmp_path / "goodlab.py", NEAR + "\n\n" + COST)
    points = "[skid_steer_hil.figures]\ngoodlab = goodlab\nbadlab = no_such_module_of_badlab\n"
    info = tmp_path / "goodlab-1.0.dist-info"
    info.mkdir()
    written(info / "METADATA", "Metadata-Version: 2.1\nName: goodlab\nVersion: 1.0\n")
    written(
        info / "entry_points.txt", f"{points}[skid_steer_hil.tuning_costs]\ngoodlab = goodlab\n"
    )
    code = (
        "import json; from hil.core.registries import FIGURES, TUNING_COSTS as costs; "
        "print(json.dumps([FIGURES.get('near').origin, costs.get('own-cost').origin, FIGURES.failed]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    figure, cost, failed = json.loads(done.stdout)
    assert figure == "package goodlab"
    assert cost.endswith("goodlab")
    assert failed == {"goodlab": "ModuleNotFoundError: No module named 'no_such_module_of_badlab'"}


def test_a_figure_of_this_process_needs_no_file():
    """Decorated in a notebook, it is named like any other; built-in names are refused."""

    @api.figure("of_a_notebook_m", unit="m", meaning="the last error", label="last")
    def last(run: api.RunData) -> float:
        return float(run.error_m[-1])

    run = api.run(
        "scenario-1", camera="pose", in_memory=True, duration_s=0.5, figures=["of_a_notebook_m"]
    )
    assert run.figures["of_a_notebook_m"] == run.figures["delta1_final_m"]
    assert set(run.figures) == {*BY_NAME, "of_a_notebook_m"}
    api.check_figure(last)
    with pytest.raises(api.BadInput, match="two have this name"):
        api.figure("ise_m2_s", unit="m", meaning="x")(last)
    assert cost_of("usual").of({}) == COST_FAILED


def test_a_name_that_tables_have_is_refused(tmp_path: Path):
    """Whatever stands beside the figures in results and CSV is no figure's name; all such are known."""
    table = tmp_path / "runs.csv"
    write_csv(table, [])
    beside = set(table.read_text().strip().split(",")) - set(BY_NAME)
    assert beside | ROW_COLUMNS == BESIDE
    for name in sorted(BESIDE):
        file = written(tmp_path / f"{name}.py", figure_text(name, "return 1.0"))
        with pytest.raises(BadInput, match=f"tables have a column {name} beside"):
            FIGURES.load_file(str(file))
    assert FIGURES.load_file(str(written(tmp_path / "x.py", figure_text("seeds", "return 1.0"))))


def test_a_figure_that_interrupts_leaves_a_closed_record(tmp_path: Path):
    """The run is whole and its record says interrupted, status 130; what was written is readable."""
    file = written(tmp_path / "stop.py", figure_text("stop_m", "raise KeyboardInterrupt"))
    done = run_pose("--figure", file, *BRIEF, "--out", tmp_path / "run")
    assert done.status == 130
    record = read_run(tmp_path / "run")
    assert (record.manifest.outcome, record.manifest.outcome_detail) == ("interrupted", "Ctrl-C")
    assert record.samples["t_s"].size == 31
    assert record.problems == ()
