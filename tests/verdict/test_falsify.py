"""The search for a counterexample: margin, box, reduction, and what is kept."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from hil.analysis.metrics import Verdict
from hil.cli.falsify import command
from hil.config.deck import load_deck
from hil.config.load import load_scenario
from hil.core.errors import BadInput
from hil.core.registries import OUTER_LAWS
from hil.runs.execute import RunSpec, execute_in_memory
from hil.study.falsify.box import load_box
from hil.study.falsify.keep import Asked, add_to_deck, write_scenario
from hil.study.falsify.margin import FURTHEST, OneRun, Outcome, margin_of
from hil.study.falsify.search import Trial, falsify

BOX = """
[range]
"mismatch.mass_kg" = { low = 0.8, high = 2.0 }
"start.x_m" = { low = -0.1, high = 0.1, offset = true }
"link.latency_s" = { low = 0.0, high = 0.2 }
[[disturbance]]
target = "slope_x_rad"
shape = "step"
least = -0.1
largest = 0.1
"""


def box_of(tmp_path, scenario="ahead", text=BOX):
    file = tmp_path / "box.toml"
    file.write_text(text)
    return load_box(str(file), load_scenario(scenario))


@pytest.mark.parametrize(
    ("value", "low", "high", "margin"),
    [
        (0.01, None, 0.02, 0.5),
        (0.03, None, 0.02, -0.5),
        (0.02, None, 0.02, 0.0),
        (-0.5, -1.0, None, 0.5),
        (0.5, None, 0.0, -0.5),
        (float("nan"), None, 1.0, -1.0),
        (1e9, None, 1.0, -FURTHEST),
    ],
)
def test_margin_is_negative_exactly_where_the_requirement_fails(value, low, high, margin):
    """By hand; relative to the bound, over 1 for a bound of zero."""
    holds = (low is None or value >= low) and (high is None or value <= high)
    found, _ = margin_of([Verdict("x", value, "m", low, high, holds)])
    assert found == pytest.approx(margin)
    assert (found >= 0) == holds


def test_the_worst_requirement_decides():
    """And is named."""
    verdicts = [Verdict("a", 1.0, "m", None, 2.0, True), Verdict("b", 3.0, "s", None, 2.0, False)]
    assert margin_of(verdicts) == (-0.5, "b <= 2 s")


def test_box_holds_the_scenario_itself(tmp_path):
    """Its point departs in nothing; offsets count from the scenario; a disturbance of 0 is none."""
    box = box_of(tmp_path)
    assert box.departures(box.usual) == {}
    assert box.at(box.usual) == load_scenario("ahead")
    axis = next(axis for axis in box.axes if axis.key == "start.x_m")
    assert (axis.low, axis.high) == pytest.approx((-0.65, -0.45))
    moved = box.at((*box.usual[:-1], 1.0))
    assert [(d.target, d.amplitude) for d in moved.disturbances] == [("slope_x_rad", 0.1)]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "nothing to search"),
        ('[range]\n"robot.mas_kg" = {low=1, high=2}\n', "has no such number"),
        ('[range]\n"robot.mass_kg" = {low=2, high=1}\n', "must be below high"),
    ],
)
def test_a_box_that_is_none_is_told(tmp_path, text, told):
    """In one line, with what to do."""
    with pytest.raises(BadInput, match=told):
        box_of(tmp_path, text=text)


def test_default_box_fits_every_task_of_the_suite():
    """Keys that a task does not have are left out; its corners are scenarios."""
    for name in load_deck("suite").scenarios:
        box = load_box("default", load_scenario(name))
        assert len(box.axes) > 15
        for share in (0.0, 1.0):
            box.at([share] * len(box.axes))


def bowl(box, fails):
    """Return what runs points: the margin of `fails` applied to the values by key."""

    def run(points):
        found = []
        for point in points:
            values = {
                axis.key: axis.value(share) for axis, share in zip(box.axes, point, strict=True)
            }
            found.append(Trial(tuple(point), Outcome(fails(values), "x <= 1")))
        return found

    return run


def test_counterexample_is_reduced_to_the_one_departure_that_matters(tmp_path):
    """Fails from a mass of 1.5 on, whatever the rest: one departure is left, just beyond 1.5."""
    box = box_of(tmp_path)
    found = falsify(box, bowl(box, lambda v: 1.5 - v["mismatch.mass_kg"]), runs=101, seed=1)
    ((key, value),) = box.departures(found.reduced.point).items()
    assert key == "mismatch.mass_kg"
    assert 1.5 < value < 1.52
    assert found.worst.outcome.margin <= found.reduced.outcome.margin < 0


def test_two_that_only_fail_together_both_stay(tmp_path):
    """A delay and a slope: neither alone violates anything, so the reduction keeps both."""
    box = box_of(tmp_path)

    def fails(v):
        return 0.15 - min(v["link.latency_s"], 2 * abs(v["disturbance.slope_x_rad"]))

    found = falsify(box, bowl(box, fails), runs=301, seed=1)
    assert set(box.departures(found.reduced.point)) == {"link.latency_s", "disturbance.slope_x_rad"}


def test_nothing_is_found_where_nothing_fails(tmp_path):
    """And refused runs are not taken for failures."""
    box = box_of(tmp_path)
    assert (
        falsify(box, bowl(box, lambda v: 0.1 + v["link.latency_s"]), runs=51, seed=1).reduced
        is None
    )

    def refused(points):
        return [Trial(tuple(p), Outcome(-1.0, "lost", refused=i > 0)) if i else
                Trial(tuple(p), Outcome(1.0, "")) for i, p in enumerate(points)]  # fmt: skip

    found = falsify(box, refused, runs=51, seed=1)
    assert found.reduced is None
    assert found.refused > 0


def test_against_another_law_both_margins_count():
    """What the other law fails as well is no counterexample against it."""
    ours = Outcome(-0.5, "x")
    assert Trial((), ours, Outcome(0.2, "")).counts
    assert not Trial((), ours, Outcome(-0.1, "")).counts
    assert Trial((), ours, Outcome(0.2, "")).objective == pytest.approx(-0.7)


MOVED = """
[range]
"start.theta_rad" = { low = -0.8, high = 0.8, offset = true }
"start.x_m" = { low = -0.08, high = 0.08, offset = true }
"""


def test_what_the_task_asks_for_moves_with_its_start(tmp_path):
    """Turned 0.8 rad to the right there is 0.8 rad less to turn to the right: both bounds move by that.

    The point lies at (0.65, 0.7) m from the start, 0.822 rad counter-clockwise from X; 80 mm further on it is
    at 0.887 rad. z1 begins 30 mm ahead of the centre of mass: cos(0.7708) x 30 = 21.5 mm in X.
    """
    box = box_of(tmp_path, "scenario-1", MOVED)
    usual = {r.metric: r for r in box.at(box.usual).requirements}
    assert (usual["turn_rad"].min, usual["turn_rad"].max) == (-3.1416, -0.2)
    turned = {r.metric: r for r in box.at((0.0, 0.5)).requirements}
    assert (turned["turn_rad"].min, turned["turn_rad"].max) == pytest.approx((-2.3416, 0.6))
    assert turned["start_offset_x_m"].max == pytest.approx(-0.2 + 0.0215, abs=2e-4)
    assert turned["delta1_worst_last_second_m"] == usual["delta1_worst_last_second_m"]
    # turned 0.8 rad to the left the point is 1.55 rad to the right: it may be met in reverse, by +1.59 rad
    beside = {r.metric: r for r in box.at((1.0, 0.5)).requirements}
    assert (beside["turn_rad"].min, beside["turn_rad"].max) == pytest.approx(
        (-3.9416, 2.1416), abs=1e-3
    )
    moved = {r.metric: r for r in box.at((0.5, 1.0)).requirements}
    assert moved["turn_rad"].max == pytest.approx(-0.2 + 0.887 - 0.822, abs=1e-3)
    assert moved["start_offset_x_m"].max == pytest.approx(-0.12)


def test_a_robot_that_begins_turned_is_no_counterexample(tmp_path):
    """Scenario 1 from 0.7 rad further right holds all; as it states them its requirements would not."""
    box = box_of(tmp_path, "scenario-1", MOVED)
    scenario = box.at((0.0625, 0.5))
    assert scenario.start.theta_rad == pytest.approx(1.5708 - 0.7, abs=1e-3)
    assert OneRun()((scenario, "pid", 3)).margin > 0.0
    stated = scenario.model_copy(update={"requirements": box.scenario.requirements})
    outcome = OneRun()((stated, "pid", 3))  # negative control
    assert outcome.margin < 0.0
    assert "turn_rad" in outcome.why


def test_what_is_kept_replays_the_run(tmp_path):
    """The written scenario gives the margin of the search, to the last digit, and the deck holds it."""
    task = load_scenario("ahead", ["duration_s=4"])
    box = load_box(str(box_file(tmp_path)), task)
    point = list(box.usual)
    point[0], point[1], point[-1] = 1.0, 0.8, 0.9
    run = OneRun()
    outcome = run((box.at(point), "pid", 5))
    keep = tmp_path / "kept"
    keep.mkdir()
    asked = Asked("pid", 5)
    file = write_scenario(keep, "ahead", box, Trial(tuple(point), outcome), asked)
    scenario = load_scenario(str(file))
    assert scenario.control.outer == "pid"
    assert scenario.requirements == box.at(point).requirements
    spec = RunSpec(scenario, "twin", scenario.camera_source, "pid", "asg-ism", 5, tmp_path)
    replayed, _ = margin_of(execute_in_memory(spec).verdicts())
    assert replayed == outcome.margin
    deck = load_deck(str(add_to_deck(keep, file, asked)))
    assert add_to_deck(keep, file, asked).read_text().count(file.name) == 1
    assert deck.laws == ("pid",)
    (cell,) = deck.cells()
    assert deck.scenario_of(cell).name == scenario.name


OVER = {
    "disturbances": ['disturbances=[{target="force_left_n",shape="step",amplitude=1.0}]'],
    "a table": ["start={x_m=-0.5,y_m=-0.3,theta_rad=1.0}", 'name="x"', 'description="y"'],
    "another kind": [
        'reference={kind="circle",radius_m=0.4,rate_rad_s=0.3}',
        "requirements=[{metric='iae_m_s',max=0.1}]",
    ],
    "nothing off": ["mismatch={}", "robot.mass_kg=3.1", "board.PID_KP=0.02"],
    "faults": [
        'faults=[{kind="motor_weak",side="left",start_s=1.0}]',
        "control.estimator=camera-only",
    ],
}


@pytest.mark.parametrize("overrides", OVER.values(), ids=OVER)
def test_what_was_set_for_the_search_is_in_what_is_kept(tmp_path, overrides):
    """Whatever --set changed, with values or tables, the kept file is the scenario that failed."""
    box = load_box(str(box_file(tmp_path)), load_scenario("ahead", overrides))
    point = (1.0, *box.usual[1:-1], 0.9)
    file = write_scenario(
        tmp_path, "ahead", box, Trial(point, Outcome(-0.5, "it fails")), Asked("pid", 5)
    )
    kept, wanted = (
        one.model_dump(mode="json") for one in (load_scenario(str(file)), box.at(point))
    )
    for own in ("name", "description", "camera_source"):
        kept.pop(own), wanted.pop(own)
    assert kept["control"].pop("outer") == "pid"
    wanted["control"].pop("outer")
    believed = {key: 1.0 for key in kept["mismatch"]}
    assert kept.pop("mismatch") == believed | wanted.pop("mismatch")
    assert kept == wanted


def test_a_law_from_a_file_and_the_wheel_law_are_in_what_is_kept(tmp_path, monkeypatch):
    """In another process, in another folder, the kept files still name the law and the wheel law."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(OWN_LAW)
    (tmp_path / "counterexamples").mkdir()
    keep, asked = Path("counterexamples"), Asked(OUTER_LAWS.get("mine.py").name, 5, inner="pid")
    box = box_of(tmp_path)
    trial = Trial(box.usual, Outcome(-0.5, "it fails"))
    file = write_scenario(keep, "ahead", box, trial, asked)
    assert f'control.outer = "{Path("..") / "mine.py"}:mine"' in file.read_text()
    assert "--seed 5 --inner pid" in file.read_text()
    deck = add_to_deck(keep, file, asked)
    assert deck.name == "deck-mine-over-pid-seed5.toml"
    assert "--seed 5 --inner pid" in deck.read_text()
    monkeypatch.chdir(tmp_path.parent)
    assert load_scenario(str(tmp_path / file)).control.outer == "mine"
    assert load_deck(str(tmp_path / deck)).laws == ("mine",)


def test_a_kept_file_is_never_written_over(tmp_path):
    """With one of two files thrown away the next gets a number of its own."""
    box = box_of(tmp_path)
    trial = Trial(box.usual, Outcome(-0.5, "it fails"))
    first, second = (write_scenario(tmp_path, "ahead", box, trial, Asked("pid", 5)) for _ in "12")
    first.unlink()
    assert write_scenario(tmp_path, "ahead", box, trial, Asked("pid", 5)) != second


OWN_LAW = """
import hil


@hil.outer_law("mine", summary="Stands still.")
class Mine:
    def __init__(self, gains, limits, d0_m):
        pass

    def reset(self, reference, estimate):
        pass

    def step(self, reference, estimate, dt_s):
        return hil.OuterCommand(0.0, 0.0, {})
"""


def box_file(tmp_path):
    file = tmp_path / "box.toml"
    file.write_text(BOX)
    return file


def test_falsify_from_the_command_line(tmp_path):
    """A requirement that no law can meet is violated as it stands: kept without a departure, exit 1."""
    task = tmp_path / "hopeless.toml"
    task.write_text(
        'base = "ahead"\nname = "hopeless"\nduration_s = 1.5\n'
        '[[requirements]]\nmetric = "delta1_worst_last_second_m"\nmax = 0.02\n'
    )
    asked = [str(task), "--outer", "pid", "--runs", "11", "--workers", "1",
             "--keep", str(tmp_path / "kept"), "--json"]  # fmt: skip
    run = CliRunner().invoke(command, asked, standalone_mode=False, catch_exceptions=False)
    document = json.loads(run.stdout)
    assert run.return_value == 1
    assert document["found"]
    assert document["counterexample"]["departures"] == {}
    assert document["counterexample"]["margin"] < -1
    assert load_scenario(document["file"]).duration_s == 1.5


def test_falsify_refuses_what_it_cannot_search():
    """A law against itself, and a scenario that asks nothing."""
    for asked, told in (
        (["ahead", "--outer", "pid", "--against", "pid"], "is the law itself"),
        (["ahead", "--set", "requirements=[]"], "has no \\[\\[requirements\\]\\]"),
    ):
        with pytest.raises(BadInput, match=told):
            CliRunner().invoke(command, asked, standalone_mode=False, catch_exceptions=False)
