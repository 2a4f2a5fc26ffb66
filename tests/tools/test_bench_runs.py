"""`hil bench batch`, `law`, `campaign`, `report` and `--against`: what is said was measured."""

from __future__ import annotations

import json
import math

import pytest

from hil.analysis.speed import Figure
from hil.study.campaign import speed
from hil.tools import bench_history, bench_plants, bench_runs
from hil.tools.bench import FORMAT, as_document
from sim_twin import _native
from tests.cli.command import hil


def figure(name: str, *values: float) -> Figure:
    """Return a figure of these values."""
    return Figure.of(name, "s", values, "")


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make what is timed short; the rendered path and long tables are left to the command itself."""
    monkeypatch.setattr(bench_runs, "_STEPS", 200)
    for name in ("_NATIVE_STEPS", "_LANE_STEPS", "_MUJOCO_STEPS", "_CHAINED", "_SIDE_BY_SIDE"):
        monkeypatch.setattr(bench_plants, name, 100_000 if name == "_SIDE_BY_SIDE" else 300)
    monkeypatch.setattr(bench_plants, "_PORT_STEPS", 1)
    monkeypatch.setattr(bench_plants, "_installed", lambda package: package == "mujoco")

    def worked(*_run: object) -> tuple[float, int]:
        assert sum(range(50_000)) > 0  # takes a while
        return 11.0, 1

    monkeypatch.setattr(bench_runs, "_simulated", worked)


@pytest.mark.usefixtures("short")
def test_batch_says_runs_and_times_real_time_of_each_path() -> None:
    """The contract of --json: format, machine, program, and each figure with all its values."""
    done = hil("bench", "batch", "--runs", 3, "--json")
    assert done.status == 0
    assert {key: done.json[key] for key in ("format", "what")} == {
        "format": FORMAT,
        "what": "batch",
    }
    assert done.json["program"].startswith("skid-steer-hil ")
    assert done.json["machine"]["cores"] >= 1
    found = {(item["name"], item["unit"]): item for item in done.json["figures"]}
    registers = {2, 4, _native.widest_register()}
    # Four ways of the pose camera, two tasks; rendered in two sizes; plant and kernel; peers; limits.
    plants = 2 + len(_native.lane_widths()) + 2 + 3 * len(registers)
    assert len(found) == 25 + plants
    assert ("MuJoCo, four wheels, one step of 0.0005 s", "ns") in found
    assert ("the same in numba", "ns") not in found  # what is not installed is left out
    assert ("the same, taken in by Python", "x real time") in found
    for item in found.values():
        assert len(item["values"]) == item["runs"] == 3
        assert 0.0 < item["least"] <= item["median"] <= item["largest"]
        assert item["values"] == sorted(item["values"])
    rate = found["pose camera, 10 s to a point", "runs/s"]
    times = found["pose camera, 10 s to a point", "x real time"]
    assert times["median"] / rate["median"] == pytest.approx(11.0, rel=0.9)


def test_the_simulated_time_of_a_run_is_that_of_its_rig() -> None:
    """Connecting, the controlled part and stopping; the same whoever takes in what arrives."""
    scenario = bench_runs.load_scenario("scenario-1", ["duration_s=1"])
    ways = (bench_runs.NATIVE, bench_runs.ASKED, bench_runs.PYTHON)
    one, *others = (bench_runs._simulated(scenario, "pose", "pid", way) for way in ways)
    assert 1.0 < one[0] < 3.0
    assert others == [one, one]
    both = bench_runs._simulated(scenario, "pose", "pid", bench_runs.TOGETHER)
    assert both[0] == pytest.approx(bench_runs.SIDE_BY_SIDE * one[0], rel=0.05)
    assert both[1] == bench_runs.SIDE_BY_SIDE


def test_the_campaign_is_the_built_in_one_with_fewer_runs() -> None:
    """Both ends of every axis and every law are in it."""
    campaign = speed.thinned(speed.load_campaign("limits"))
    jobs = campaign.jobs()
    assert 16 <= len(jobs) <= 2 * speed._CAMPAIGN_RUNS
    for axis, ends in campaign.file.grid.items():
        assert {dict(job.point)[axis] for job in jobs} == set(ends)
        assert len(ends) == 2
    assert {job.outer for job in jobs} == set(campaign.file.outer)


def test_a_campaign_is_timed_with_its_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two runs of one second on real workers: a rate, and the share of the workers' time."""
    monkeypatch.setattr(speed, "thinned", _two_runs)
    done = hil("bench", "campaign", "--runs", 1, "--json")
    rate, share = done.json["figures"]
    assert (rate["name"], rate["unit"]) == ("campaign of 2 runs", "runs/s")
    assert rate["median"] > 0.0
    assert 0.0 < share["median"] <= 1.0


def _two_runs(campaign: speed.Campaign) -> speed.Campaign:
    axis = next(iter(campaign.file.grid))
    grid = {axis: campaign.file.grid[axis][:1]}
    file = campaign.file.model_copy(update={"grid": grid, "seeds": 1})
    return speed.Campaign(file, campaign.base | {"duration_s": 1.0})


def test_a_ratio_has_an_interval_that_holds_what_changed() -> None:
    """Twice as long is told with an interval about 2; nothing changed is told with one about 1."""
    then = {("a", "s"): [1.0, 1.1, 0.9, 1.05, 0.95], ("b", "s"): [3.0, 3.3, 2.7, 3.1, 2.9]}
    now = [figure("a", 2.0, 2.2, 1.8, 2.1, 1.9), figure("b", 3.0, 3.2, 2.8, 3.1, 2.9)]
    doubled, same = bench_history.compared([*now, figure("new", 1.0)], then)
    assert doubled.ratio == pytest.approx(2.0)
    assert 1.5 < doubled.low < 2.0 < doubled.high < 2.6
    assert same.low < 1.0 < same.high
    again, _ = bench_history.compared(now, then)
    assert (again.low, again.high) == (doubled.low, doubled.high)


def test_one_value_has_a_ratio_and_no_interval() -> None:
    """An unknown end is null in JSON, not a number that looks measured."""
    ratios = bench_history.compared([figure("a", 2.0)], {("a", "s"): [1.0]})
    assert ratios[0].ratio == 2.0
    assert math.isnan(ratios[0].low)
    assert bench_history.as_list(ratios)[0]["high"] is None


@pytest.mark.usefixtures("short")
def test_against_a_file_of_this_command_compares_and_any_other_is_refused(tmp_path) -> None:
    """--against takes what --json printed; other files, kinds and commands are refused in one line."""
    file = tmp_path / "then.json"
    file.write_text(json.dumps(hil("bench", "batch", "--runs", 2, "--json").json), encoding="utf-8")
    done = hil("bench", "batch", "--runs", 2, "--against", file, "--json")
    assert done.status == 0
    assert len(done.json["against"]) == len(done.json["figures"]) > 17
    assert all(item["low"] <= item["ratio"] * 1.001 for item in done.json["against"])
    assert "now / then" in hil("bench", "batch", "--runs", 1, "--against", file).out
    other = tmp_path / "other.json"
    other.write_text(json.dumps(as_document("law", [figure("a", 1.0)])), encoding="utf-8")
    assert "'batch' is needed" in hil("bench", "batch", "--against", other).refusal
    other.write_text("{}", encoding="utf-8")
    assert "not a measurement" in hil("bench", "batch", "--against", other).refusal
    other.write_text("no", encoding="utf-8")
    assert "not JSON" in hil("bench", "batch", "--against", other).refusal
    assert "--against" in hil("bench", "wheels", "--against", file).refusal
