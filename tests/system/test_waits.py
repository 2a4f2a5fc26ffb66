"""A procedure is asked when there is something that it may look at, and only then; once for each scenario."""

import math
from dataclasses import replace
from random import Random

import pytest

from hil.board._firmware import stored_key
from hil.config.fit import board_parameters, check_fit
from hil.config.load import load_scenario
from hil.config.mismatch import true_robot
from hil.core.errors import BadInput
from hil.core.newest import of_newest
from hil.record.memory import MemoryRecorder
from hil.rigs.targets.simulated import twin_setup
from hil.runs.assembly import make_parts
from hil.runs.execute import execute_in_memory
from hil.runs.provenance import make_manifest, used_things
from hil.wire import handshake
from hil.wire.link import BoardLink
from sim_twin.twin import Twin
from tests.system.test_native_intake import ONE, differences, in_native, in_python, spec_of

# Its wheel law is not the board's own: all parameters are fetched, and set where they differ.
FETCHED = ONE | {"inner": "pid", "loss": 0.05}


@pytest.fixture
def steps(monkeypatch):
    """Return a list that gets the host's time of each step of a procedure."""
    times, step = [], BoardLink.step

    def noting(link):
        times.append(link.t_s)
        step(link)

    monkeypatch.setattr(BoardLink, "step", noting)
    return times


def test_native_code_comes_back_only_for_what_a_procedure_may_look_at(steps):
    """The run is that in which each arrival asks; of those steps few are left, the paced requests most."""
    native = in_native(FETCHED)
    asked = len(steps)
    steps.clear()
    assert differences(native, in_python(FETCHED)) == []
    assert 60 < asked < len(steps) / 4


def test_a_procedure_that_rests_too_long_gives_another_run(monkeypatch):
    """With a time-out that native code takes for 50 ms later the runs differ (negative control)."""
    wait = handshake._wait

    def later(link, done, timeout_s):
        going = wait(link, done, timeout_s)
        while True:
            try:
                end_s = next(going)
            except StopIteration as over:
                return over.value
            yield end_s + 0.05

    monkeypatch.setattr(handshake, "_wait", later)
    changed = differences(in_native(FETCHED), in_python(FETCHED))
    assert {"link", "samples.t_s", "samples.est_x_m"} & set(changed)


@pytest.mark.parametrize("silent", ["link_cut", "link_up_cut"])
def test_a_board_that_never_answers_ends_both_ways_alike(silent):
    """A link that is cut from the beginning: the same words, after the same time."""
    fault = f'faults=[{{kind = "{silent}", start_s = 0.0}}]'
    spec = replace(spec_of(ONE), scenario=load_scenario("scenario-1", ["duration_s=1", fault]))
    native = execute_in_memory(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hil.runs.session.make_pump", lambda *_: None)
        by_hand = execute_in_memory(spec)
    assert native.manifest.outcome == "fault"
    assert "no heartbeat within 6 s" in native.manifest.outcome_detail
    assert differences(native, by_hand) == []


def test_a_board_that_signs_is_told_of_at_the_same_frame():
    """Its frames are none that a procedure is handed; that they come it sees all the same."""
    spec = spec_of(ONE)

    def run():
        setup = replace(twin_setup(spec.scenario, spec.seed), eeprom=stored_key(b"k" * 32, 0))
        return execute_in_memory(spec, rig=Twin(setup))

    native = run()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hil.runs.session.make_pump", lambda *_: None)
        by_hand = run()
    assert "signs what it says" in native.manifest.outcome_detail
    assert native.events == by_hand.events
    assert differences(native, by_hand) == []


def test_frames_of_the_link_are_kept_where_they_are_asked_for():
    """A record in memory that keeps them has those before the start too; another has none."""
    spec = spec_of(ONE)
    parameters = board_parameters(spec.scenario, spec.inner)
    manifest = make_manifest(spec, parameters, used_things(spec))
    for keep in (True, False):
        rig = Twin(twin_setup(spec.scenario, spec.seed))
        sink = MemoryRecorder(manifest, keep_link=keep)
        parts = make_parts(spec, rig, sink, law=None)
        assert (parts.link._tap is not None) is keep


def test_what_follows_from_a_scenario_is_worked_out_once_for_it():
    """One object again: the same is given. An equal one, and one after a refusal: it is done anew."""
    asked = []

    @of_newest
    def drawn(scenario):
        asked.append(scenario)
        if len(asked) == 2:
            raise BadInput("refused")
        return Random(len(asked)).random()

    one, other = load_scenario("scenario-1"), load_scenario("scenario-1")
    first = drawn(one)
    assert drawn(one) == first
    with pytest.raises(BadInput, match="refused"):
        drawn(other)
    assert drawn(other) != first
    assert [scenario is one for scenario in asked] == [True, False, False]


def test_two_records_of_one_scenario_share_nothing_that_can_be_changed():
    """Who changes the tree of one record changes no other, nor the next."""
    spec = spec_of(ONE)
    first = execute_in_memory(spec)
    first.manifest.scenario["robot"]["mass_kg"] = math.nan
    first.manifest.notes.append("changed")
    second = execute_in_memory(spec)
    assert second.manifest.scenario == spec.scenario.model_dump(mode="json")
    assert second.manifest.notes == []


def test_the_robot_with_its_mismatch_is_that_of_each_scenario():
    """One scenario after the other, each has its own; one that cannot be is refused every time."""
    heavy = load_scenario("scenario-1", ["mismatch.mass_kg=1.5"])
    light = load_scenario("scenario-1", ["mismatch.mass_kg=0.5"])
    own = heavy.robot.mass_kg
    for _ in range(2):
        assert true_robot(heavy).mass_kg == pytest.approx(1.5 * own)
        assert true_robot(light).mass_kg == pytest.approx(0.5 * own)
    for _ in range(2):
        with pytest.raises(BadInput, match="mismatch"):
            check_fit(light.model_copy(update={"mismatch": {"no.such": 1.0}}))
