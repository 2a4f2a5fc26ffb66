"""Comparison: same task or a refusal, conditions that differ are named, verdicts are honest."""

from __future__ import annotations

import io
import math

import pytest
from rich.console import Console

from hil.core.errors import BadInput
from hil.core.figures import BY_NAME
from hil.report.compare import (
    better_of,
    compare_runs,
    differences,
    findings,
    labels,
    text_table,
    to_json,
)
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
