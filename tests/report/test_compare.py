"""Comparison: same task or a refusal, conditions that differ are named, verdicts are honest."""

from __future__ import annotations

import dataclasses
import io
import math
import subprocess
import sys

import numpy as np
import pytest
from rich.console import Console

from hil.core.errors import BadInput
from hil.core.figures import BY_NAME
from hil.report.compare import (
    best_entry,
    better_of,
    compare_runs,
    differences,
    findings,
    labels,
    text_table,
    to_json,
)
from hil.report.html import render
from tests.record.synthetic import make_run, scenario


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pair")
    return [
        make_run(folder / "slow", "pid", rate_hz=2.0),
        make_run(folder / "fast", "asg-ism", rate_hz=2.6),
    ]


def test_the_faster_run_wins_by_its_figures(pair):
    """Error exp(-2.6 t) against exp(-2 t): the faster one settles first; effort goes the other way."""
    comparison = compare_runs(pair)
    text = "\n".join(findings(comparison))
    assert "Speed (settling time to 20 mm): pid" in text
    assert "asg-ism is better" in text.splitlines()[1]
    assert "pid is better" in next(line for line in text.splitlines() if "Control effort" in line)
    assert "no interval" in text
    assert comparison.holds
    assert comparison.warnings == ()


def test_a_law_against_itself_shows_no_difference(pair):
    """Negative control: one run twice gives no winner in any figure."""
    comparison = compare_runs([pair[0], pair[0]])
    assert all("no clear difference" in line for line in findings(comparison)[:-1])
    for name, metric in BY_NAME.items():
        values = [entry.figures.values[name] for entry in comparison.entries]
        assert better_of(metric, values) is None


def test_other_tasks_are_refused_in_one_line(pair, tmp_path):
    """Another scenario, start, reference or duration: refused with what differs."""
    for key, value in (
        ("name", "scenario-2"),
        ("start", {"x_m": 0.1, "y_m": 0.2, "theta_rad": 0.6}),
        ("reference", {"kind": "point", "x_m": 0.0, "y_m": 0.0}),
        ("duration_s", 5.0),
    ):
        other = make_run(tmp_path / key, tree=scenario() | {key: value})
        with pytest.raises(BadInput, match=f"cannot be compared .* scenario {key} differs"):
            compare_runs([pair[0], other])
    with pytest.raises(BadInput, match="at least 2"):
        compare_runs(pair[:1])


def test_other_conditions_are_named(pair, tmp_path):
    """Another seed, limit or robot is compared, and named with both values."""
    tree = scenario() | {"control": {"rate_hz": 30.0, "eta1_max_m_s": 0.7}}
    other = make_run(tmp_path / "other", seed=8, tree=tree)
    warnings = compare_runs([pair[0], other]).warnings
    assert any("seed 8 against 1" in line for line in warnings)
    assert any("control.eta1_max_m_s 0.7 against 0.5" in line for line in warnings)


def test_gains_are_the_subject_not_a_condition():
    """Gains and gain set belong to the laws and are no warning; a mass is."""
    here = {"control": {"gain_set": "tuned", "gains": {"k": 1}}, "robot": {"mass_kg": 3.0}}
    there = {"control": {"gain_set": "thesis", "gains": {"k": 2}}, "robot": {"mass_kg": 3.1}}
    assert differences(here, there) == [("robot.mass_kg", 3.0, 3.1)]


def test_altered_and_failed_runs_are_named(tmp_path, pair):
    """A record that was altered says so in the comparison; a failed requirement fails it."""
    run = make_run(tmp_path / "bad", "asg-ism", rate_hz=0.1)
    (run.path / "link.tlog").write_bytes(b"x")
    from hil.record.reader import read_run  # noqa: PLC0415 - reads what was just altered

    comparison = compare_runs([pair[0], read_run(run.path)])
    assert any("link.tlog has 1 bytes" in line for line in comparison.warnings)
    assert [entry.holds for entry in comparison.entries] == [True, False]
    assert not comparison.holds


def test_better_of_knows_direction_gap_and_absence():
    """Lower or higher as declared; within 5 % no winner; never settled loses; NaN otherwise not."""
    assert better_of(BY_NAME["ise_m2_s"], [2.0, 1.0]) == 1
    assert better_of(BY_NAME["ise_m2_s"], [1.04, 1.0]) is None
    assert better_of(BY_NAME["in_layer_share"], [0.5, 1.0]) == 1
    assert better_of(BY_NAME["settling_20mm_s"], [math.nan, 9.0]) == 1
    assert better_of(BY_NAME["settling_20mm_s"], [math.nan, math.nan]) is None
    assert better_of(BY_NAME["reaching_s"], [math.nan, 0.0]) is None
    assert better_of(BY_NAME["turn_rad"], [-1.0, 1.0]) is None
    assert better_of(BY_NAME["deadline_misses"], [0.0, 3.0]) == 0


def test_labels_are_as_short_as_they_can_be(pair):
    """Different laws: the law; the same law: what tells the runs apart."""
    assert labels(pair) == ["pid", "asg-ism"]
    assert labels([pair[0], pair[0]]) == ["pid, run 1", "pid, run 2"]


def test_json_and_table_hold_every_figure(pair):
    """JSON has each run's figures with units; the table has a row for each figure."""
    comparison = compare_runs(pair)
    tree = to_json(comparison)
    assert [run["label"] for run in tree["runs"]] == ["pid", "asg-ism"]
    assert set(tree["runs"][0]["figures"]) == set(BY_NAME)
    assert tree["runs"][0]["figures"]["reaching_s"]["value"] is None
    out = io.StringIO()
    Console(file=out, width=120).print(text_table(comparison))
    assert all(metric.label in out.getvalue() for metric in BY_NAME.values())


def altered(run, **changes):
    """Return a run whose manifest says something else."""
    return dataclasses.replace(run, manifest=run.manifest.model_copy(update=changes))


def test_a_run_that_was_stopped_wins_nothing(pair, tmp_path):
    """A run that ended by a fault is shown, named, and better in nothing; of three, two are judged."""
    slow, fast = pair
    stopped = altered(fast, outcome="fault", outcome_detail="camera: robot not seen")
    comparison = compare_runs([slow, stopped])
    assert len(findings(comparison)) == 1
    assert "nothing can be concluded" in findings(comparison)[0]
    assert any("not set against" in line for line in comparison.warnings)
    assert all(best_entry(comparison, metric) is None for metric in BY_NAME.values())
    assert to_json(comparison)["runs"][1]["figures"]["ise_m2_s"]["value"] is not None
    page = render([comparison], command="test")
    assert "nothing can be concluded" in page
    other = make_run(tmp_path / "other", "asg-ism", seed=2, rate_hz=1.5)
    three = compare_runs([slow, stopped, other])
    text = "\n".join(findings(three))
    assert three.entries[1].label not in text
    assert "is better" in text
    assert best_entry(three, BY_NAME["ise_m2_s"]) in {0, 2}


def test_never_settled_of_a_stopped_run_loses_against_nobody(pair):
    """A settling time that a stopped run has not reached is no finding either."""
    stopped = altered(pair[1], outcome="interrupted")
    assert best_entry(compare_runs([pair[0], stopped]), BY_NAME["settling_20mm_s"]) is None


def test_a_replay_is_set_against_nothing(pair):
    """Its path is the record's, whatever its law commands: no findings, and a note says why."""
    slow, fast = pair
    for target in ("replay:somewhere/run", "replay:."):
        comparison = compare_runs([slow, altered(fast, target=target)])
        assert "nothing can be concluded" in findings(comparison)[0]
        assert any("open loop" in line for line in comparison.warnings)
    both = [altered(run, target="replay:x") for run in pair]
    assert "0 of 2 runs" in findings(compare_runs(both))[0]


def test_figures_that_were_not_recorded_are_not_called_equal(pair):
    """A log without PWM: its chatter is not recorded, which is no equality."""
    slow, fast = pair
    blank = dict(fast.samples)
    blank["pwm_left_counts"] = np.full_like(blank["t_s"], np.nan)
    comparison = compare_runs([slow, dataclasses.replace(fast, samples=blank)])
    text = findings(comparison)
    assert "not recorded" in next(line for line in text if line.startswith("PWM chatter"))
    assert "not recorded 1" in text[-1]


def test_a_replay_of_another_task_is_refused(pair, tmp_path):
    """A record of scenario-1 answered for scenario-2: its figures are of neither."""
    tape = make_run(tmp_path / "tape", "pid")
    own = altered(pair[1], target=f"replay:{tape.path}")
    assert len(compare_runs([pair[0], own]).entries) == 2
    second = make_run(tmp_path / "second", "pid", tree=scenario("scenario-2"))
    asked = altered(second, target=f"replay:{tape.path}")
    with pytest.raises(BadInput, match=r"is a replay of .* whose scenario name is another"):
        compare_runs([second, asked])


def test_a_run_shorter_than_its_path_is_named(tmp_path):
    """Waypoints of a minute in a run of 4 s: the note has both times."""
    points = ((0.0, 0.0), (3.0, 0.0), (3.0, 3.0))
    tree = scenario() | {"reference": {"kind": "waypoints", "points_m": points}}
    runs = [make_run(tmp_path / law, law, tree=tree) for law in ("pid", "asg-ism")]
    warnings = compare_runs(runs).warnings
    assert sum("the run ends after 4 s" in line for line in warnings) == 2


def test_a_run_says_at_its_start_that_it_ends_too_soon(tmp_path):
    """`hil run` of a hairpin: one note with the time that the path takes."""
    hairpin = 'reference={kind="waypoints",points_m=[[-0.6,-0.35],[0.3,-0.35],[-0.5,-0.34]]}'
    done = subprocess.run(
        [sys.executable, "-m", "hil", "run", "scenario-1", "--camera", "pose", "--set", hairpin,
         "--set", "duration_s=1", "--set", "requirements=[]", "--out", str(tmp_path / "run")],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0
    assert "note: reference.points_m: the way takes" in done.stdout
