"""Repeats until an interval is narrow enough: what `hil experiment --until-interval` goes by."""

from dataclasses import replace
from pathlib import Path

import pytest

from hil.config.load import load_scenario
from hil.core.errors import BadInput
from hil.report.repeats import repeats_of
from hil.runs.execute import RunSpec, execute_in_memory
from hil.study.until import Until

SEEDS = range(1, 25)


@pytest.fixture(scope="module")
def records():
    """Return half a second of both laws with 24 seeds."""
    scenario = load_scenario("ahead", ["duration_s=0.5", "requirements=[]"])
    return [
        execute_in_memory(RunSpec(scenario, "twin", "pose", law, "asg-ism", seed, Path()))
        for seed in SEEDS
        for law in ("pid", "asg-ism")
    ]


def test_it_stops_when_every_difference_is_narrow_and_not_before(records):
    """The same runs are enough for a wide interval and not for a hundredth of it; both are told."""
    said = []
    assert Until.of("iae_m_s", 0.05, "twin").reached(records, said.append)
    assert not Until.of("iae_m_s", 1e-6, "twin").reached(records, said.append)
    assert said[0].startswith("24 repeats")
    assert said[0].endswith("narrow enough")
    assert "not yet: ahead: asg-ism over asg-ism" in said[1]


def test_fewer_repeats_than_the_first_look_are_never_enough(records):
    """However narrow the interval of eight pairs is."""
    assert not Until.of("iae_m_s", 10.0, "twin").reached(records[:10], lambda _text: None)


def test_a_run_that_ended_early_does_not_count(records):
    """What is looked at is what the report tells: pairs with a run that was stopped are left out of both."""
    told = [
        replace(record, manifest=record.manifest.model_copy(update={"outcome": "fault"}))
        if record.manifest.seed > 20 and record.manifest.outer == "pid"
        else record
        for record in records
    ]
    assert repeats_of(told).contrasts[0].results["iae_m_s"].left_out == 4
    # Of 24 pairs 20 are left, fewer than the first look needs.
    assert not Until.of("iae_m_s", 10.0, "twin").reached(told, lambda _text: None)
    assert Until.of("iae_m_s", 10.0, "twin").reached(records, lambda _text: None)


def test_parts_grow_by_half_and_share_their_beginning():
    """Each part holds the runs of the one before, so that none is made twice."""
    specs = [
        RunSpec(None, "twin", "pose", law, "asg-ism", seed, Path())
        for seed in range(5, 65)
        for law in ("pid", "asg-ism")
    ]
    parts = list(Until.of("iae_m_s", 1.0, "twin").parts(specs, 5, 60))
    assert [len(part) for part in parts] == [48, 72, 108, 120]
    assert parts[1][:48] == parts[0]


def test_what_has_no_difference_and_a_rig_are_refused(records):
    """One law alone; an order that is drawn for a fixed number; an unknown figure."""
    alone = [record for record in records if record.manifest.outer == "pid"]
    with pytest.raises(BadInput, match="needs two laws"):
        Until.of("iae_m_s", 1.0, "twin").reached(alone, lambda _text: None)
    with pytest.raises(BadInput, match="give --repeats"):
        Until.of("iae_m_s", 1.0, "serial:/dev/ttyUSB0")
    with pytest.raises(BadInput, match="no such figure"):
        Until.of("iae", 1.0, "twin")
