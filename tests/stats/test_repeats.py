"""Repeats on the twin: paired by seed, resumed after an interruption, 2 x 2 laws."""

from __future__ import annotations

import csv
import dataclasses
import json
import os
import shutil
from pathlib import Path

import pytest

from hil.config.deck import Deck
from hil.core.errors import BadInput
from hil.record.reader import RunRecord
from hil.report.compare import HEADLINES
from hil.report.csv_table import write_csv
from hil.report.html import render
from hil.report.repeats import repeats_of, text_tables
from hil.runs.execute import execute, execute_in_memory
from hil.study.experiment import Conditions, claim, deck_specs, study

DECK = Deck(scenarios=("scenario-1",), laws=("pid", "asg-ism"))


def conditions(**changes: object) -> Conditions:
    values: dict[str, object] = {
        "target": "twin", "camera": "pose", "inner": "asg-ism", "seed": 1, "repeats": 2,
        "overrides": ("duration_s=1",), "command": "test",
    }  # fmt: skip
    return Conditions(**(values | changes))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def four_arms(tmp_path_factory: pytest.TempPathFactory) -> list[RunRecord]:
    """Both outer laws over both inner laws, three seeds, in memory."""
    specs = deck_specs(DECK, conditions(inner="both", repeats=3), tmp_path_factory.mktemp("x"))
    return [execute_in_memory(spec) for spec in specs]


def test_matrix_of_laws_gives_every_arm_and_the_three_factors(four_arms: list[RunRecord]) -> None:
    """2 x 2 laws: three arms against the baseline, and outer, inner and interaction."""
    found = repeats_of(four_arms)
    assert found is not None
    assert found.seeds == (1, 2, 3)
    assert list(found.arms) == [
        "pid over pid", "pid over asg-ism", "asg-ism over pid", "asg-ism over asg-ism",
    ]  # fmt: skip
    assert len(found.contrasts) == 6
    names = [contrast.name.split(":")[0] for contrast in found.contrasts[3:]]
    assert names == ["outer law", "inner law", "interaction"]
    # The main effect is the mean of the two simple ones, figure by figure.
    ise = "ise_m2_s"
    over_pid = found.contrasts[1].results[ise].mean
    both_changed = found.contrasts[2].results[ise].mean
    inner_changed = found.contrasts[0].results[ise].mean
    outer = found.contrasts[3].results[ise].mean
    assert outer == pytest.approx((over_pid + both_changed - inner_changed) / 2)


def test_the_interaction_shows_no_run_that_nobody_made(four_arms: list[RunRecord]) -> None:
    """It is named by its laws, and its sides, sums of two runs, are not shown as values."""
    found = repeats_of(four_arms)
    assert found is not None
    contrast = found.contrasts[-1]
    assert contrast.is_interaction
    assert contrast.name == ("interaction: asg-ism - pid over asg-ism, less asg-ism - pid over pid")
    cells = [list(column.cells) for column in text_tables(found, HEADLINES)[-1].columns]
    assert set(cells[1]) == set(cells[2]) == {""}
    assert all(cells[3])
    others = [list(column.cells) for column in text_tables(found, HEADLINES)[0].columns]
    assert all(others[1])


def test_pairs_met_the_same_noise(four_arms: list[RunRecord]) -> None:
    """Both laws of a seed saw the same frames dropped and the same link delays before the start."""
    pid, asg = (
        next(r for r in four_arms if (r.manifest.outer, r.manifest.seed) == (law, 2))
        for law in ("pid", "asg-ism")
    )
    before = pid.frames["t_arrival_s"] < 0
    count = int(before.sum())
    assert count > 10
    assert (pid.frames["t_cam_s"][:count] == asg.frames["t_cam_s"][:count]).all()
    assert (pid.frames["x_m"][:count] == asg.frames["x_m"][:count]).all()


def test_same_law_under_two_names_shows_nothing(four_arms: list[RunRecord]) -> None:
    """Negative control: the ASG-ISM runs relabelled as a third law differ from themselves by 0."""
    own = [r for r in four_arms if (r.manifest.outer, r.manifest.inner) == ("asg-ism", "asg-ism")]
    copies = [
        dataclasses.replace(r, manifest=r.manifest.model_copy(update={"outer": "copy"}))
        for r in own
    ]
    found = repeats_of([*own, *copies])
    assert found is not None
    for result in found.contrasts[0].results.values():
        assert result.interval.contains_zero
        assert not result.certain


def test_runs_that_ended_early_do_not_count(four_arms: list[RunRecord]) -> None:
    """A run that was stopped has a small error integral: its pair is left out, and it is said."""
    early = [
        dataclasses.replace(r, manifest=r.manifest.model_copy(update={"outcome": "fault"}))
        if r.manifest.seed == 2 and r.manifest.outer == "pid"
        else r
        for r in four_arms
    ]
    found = repeats_of(early)
    assert found is not None
    result = found.contrasts[1].results["ise_m2_s"]
    assert (result.pairs, result.left_out) == (2, 1)
    assert any("1 runs ended early" in line for line in found.warnings)


def test_unlike_conditions_are_named(four_arms: list[RunRecord]) -> None:
    """Runs of another revision or with another limit among the repeats are pointed out."""
    other = four_arms[5].manifest
    tree = {**other.scenario, "safety": {**other.scenario["safety"], "pose_lost_s": 0.3}}
    changed = other.model_copy(update={"git_revision": "abc", "scenario": tree})
    mixed = [*four_arms[:5], dataclasses.replace(four_arms[5], manifest=changed), *four_arms[6:]]
    found = repeats_of(mixed)
    assert found is not None
    assert "the runs differ in safety.pose_lost_s" in found.warnings
    assert any("git revision" in line for line in found.warnings)


def test_report_shows_the_intervals(four_arms: list[RunRecord]) -> None:
    """The HTML has a table and a figure per scenario with repeats, and JSON is finite or null."""
    found = study(four_arms)
    assert found.repeats is not None
    page = render([found.comparison], command="test", repeats=[found.repeats])
    assert "Repeats, paired by seed" in page
    assert "12 runs on target twin" in page
    assert " of 12 paired runs completed" in page
    assert "This table is seed 1 alone" in page
    assert "95 % interval" in page
    json.dumps(found.to_json(), allow_nan=False)
    assert {entry.run.manifest.seed for entry in found.comparison.entries} == {1}


def test_figures_as_csv(four_arms: list[RunRecord], tmp_path: Path) -> None:
    """One row a run, numbers as they are; a figure that does not exist is an empty cell."""
    write_csv(tmp_path / "runs.csv", four_arms)
    with (tmp_path / "runs.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 12
    assert float(rows[0]["ise_m2_s"]) == four_arms[0].figures().values["ise_m2_s"]
    assert (rows[0]["outer"], rows[0]["reaching_s"]) == ("pid", "")


def test_interrupted_experiment_goes_on(tmp_path: Path) -> None:
    """Finished runs stay as they are, a run cut off is set aside and done anew."""
    folder = tmp_path / "experiment"
    specs = deck_specs(DECK, conditions(), folder)
    assert claim(folder, specs) == specs
    execute(specs[0])
    shutil.copytree(specs[0].out, specs[1].out)
    path = specs[1].out / "manifest.json"
    tree = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps(tree | {"outcome": "running"}), encoding="utf-8")
    stamp = os.stat(specs[0].out / "manifest.json").st_mtime_ns
    assert claim(folder, specs) == specs[1:]
    assert not specs[1].out.exists()
    assert (folder / "set-aside" / f"{specs[1].out.name}-1").is_dir()
    assert os.stat(specs[0].out / "manifest.json").st_mtime_ns == stamp
    more = deck_specs(DECK, conditions(repeats=3), folder)
    assert claim(folder, more) == [spec for spec in more if spec.out != specs[0].out]


def test_folder_of_something_else_is_refused(tmp_path: Path) -> None:
    """Another experiment's folder, or anybody's, is left alone."""
    folder = tmp_path / "experiment"
    claim(folder, deck_specs(DECK, conditions(), folder))
    other = deck_specs(DECK, conditions(overrides=("duration_s=2",)), folder)
    with pytest.raises(BadInput, match="another experiment"):
        claim(folder, other)
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "letter.txt").write_text("dear", encoding="utf-8")
    with pytest.raises(BadInput, match="neither empty nor an experiment"):
        claim(tmp_path / "own", deck_specs(DECK, conditions(), tmp_path / "own"))


def test_order_on_a_real_rig_is_drawn_block_by_block(tmp_path: Path) -> None:
    """Each repeat has every law once, in an order of its own that the seed decides."""
    serial = conditions(target="serial:/dev/null", repeats=12)
    specs = deck_specs(DECK, serial, tmp_path)
    blocks = [tuple(s.outer for s in specs[i : i + 2]) for i in range(0, 24, 2)]
    assert all(sorted(block) == ["asg-ism", "pid"] for block in blocks)
    assert len(set(blocks)) == 2
    assert [s.out for s in deck_specs(DECK, serial, tmp_path)] == [s.out for s in specs]
