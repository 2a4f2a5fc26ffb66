"""Runs that advance side by side are to the bit what each is alone, in whatever company."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.config.load import load_scenario
from hil.core.errors import BadInput, RigFault
from hil.core.registries import OUTER_LAWS
from hil.core.types import OuterCommand
from hil.runs import together
from hil.runs.execute import InMemory, execute_in_memory
from hil.runs.intake import Intake
from hil.runs.together import execute_together, run_together
from tests.own.starts import written
from tests.system.test_native_intake import CASES, ONE, differences, spec_of

# What one of a company may be besides a case of its own: a run whose ticks or arrivals are Python's.
APART = {
    "": [],
    "another estimator": ["control.estimator=observed-acceleration"],
    "a host that stops": ['faults=[{kind = "host_stopped", start_s = 1.0, end_s = 1.1}]'],
    "axes of its own": ["control.axes_rad=0.3"],
}
MEMBERS = st.tuples(CASES, st.sampled_from([0.5, 1.0, 2.0]), st.sampled_from(sorted(APART)))


def spec_in(member):
    """Return the spec of a member: of a case, so long, apart in one way or none."""
    case, duration_s, apart = member
    spec = spec_of(case)
    if apart:
        more = ["duration_s=1.5", *APART[apart]]
        return replace(spec, scenario=load_scenario(case["scenario"], more))
    return replace(spec, scenario=spec.scenario.model_copy(update={"duration_s": duration_s}))


def require_same(specs, found):
    """Require of each run found that it is the one made alone."""
    for spec, record in zip(specs, found, strict=True):
        assert differences(record, execute_in_memory(spec)) == [], spec.scenario.name


@settings(max_examples=12, deadline=None)
@given(st.lists(MEMBERS, min_size=2, max_size=6))
def test_runs_side_by_side_are_those_made_alone(members):
    """Samples, frames, events, counters, outcome and figures, whatever is drawn, in mixed company."""
    specs = [spec_in(member) for member in members]
    require_same(specs, execute_together(specs))


def test_a_company_of_one_and_of_none():
    """One run alone in its company is the same run; of none there is none."""
    require_same([spec_of(ONE)], execute_together([spec_of(ONE)]))
    assert execute_together([]) == []


@pytest.mark.parametrize("fault", ["link_cut", "camera_stall", "motor_stuck", "board_reset"])
def test_a_run_that_ends_early_ends_alone(fault):
    """With the same words and rows as alone, and nobody beside it notices."""
    cases = [ONE, ONE | {"fault": fault, "scenario": "circle"}, ONE | {"seed": 8, "outer": "pid"}]
    specs = [spec_of(case) for case in cases]
    found = execute_together(specs)
    require_same(specs, found)
    assert found[0].manifest.outcome == found[2].manifest.outcome == "complete"


def test_what_cannot_be_opened_leaves_the_others_alone():
    """A spec whose values do not go together gives the error it raises alone, in its place."""
    bad = replace(spec_of(ONE), outer="no-such-law")
    with pytest.raises(BadInput) as alone:
        execute_in_memory(bad)
    specs = [spec_of(ONE), bad, spec_of(ONE | {"seed": 4})]
    found = execute_together(specs)
    assert type(found[1]) is BadInput
    assert str(found[1]) == str(alone.value)
    require_same([specs[0], specs[2]], [found[0], found[2]])


class Breaking:
    """A law that raises on its tenth step."""

    def __init__(self, error):
        self._error, self._left = error, 10

    def reset(self, *_asked):
        """Start anew."""

    def step(self, *_asked):
        """Return rest, at last raise."""
        self._left -= 1
        if not self._left:
            raise self._error
        return OuterCommand(0.0, 0.0, {})


@pytest.mark.parametrize("error", [RigFault("it is broken"), ValueError("no such thing")])
def test_what_a_law_raises_ends_its_own_run(error):
    """A fault ends the run as a fault, an error is the result; as alone."""
    spec = spec_of(ONE)
    opened = [
        partial(InMemory, spec),
        partial(InMemory, spec, law=Breaking(error)),
        partial(InMemory, replace(spec, seed=9)),
    ]
    found = run_together(opened)
    if isinstance(error, RigFault):
        assert differences(found[1], execute_in_memory(spec, law=Breaking(error))) == []
        assert found[1].manifest.outcome_detail == "it is broken"
    else:
        assert found[1] is error
    require_same([spec, replace(spec, seed=9)], [found[0], found[2]])


class Creeping:
    """A law that goes faster and faster from its reset on."""

    def reset(self, *_asked):
        """Start anew."""
        self._m_s = 0.0

    def step(self, *_asked):
        """Return a bit more each time."""
        self._m_s = min(self._m_s + 1e-3, 0.05)
        return OuterCommand(self._m_s, 0.0, {})


def test_runs_that_were_given_one_law_follow_each_other(monkeypatch):
    """A law object that several runs share starts anew for each of them, as where they are made alone."""
    one = Creeping()
    specs = [spec_of(ONE | {"seed": seed}) for seed in (3, 4, 5)]
    makers = [partial(InMemory, spec, law=one) for spec in specs]
    makers.insert(1, partial(InMemory, spec_of(ONE)))
    found = run_together(makers)
    alone = [execute_in_memory(spec, law=Creeping()) for spec in specs]
    for record, expected in zip([found[0], *found[2:]], alone, strict=True):
        assert differences(record, expected) == []
    assert differences(found[1], execute_in_memory(spec_of(ONE))) == []
    monkeypatch.setattr(together, "_companies", lambda runs: [runs])  # negative control
    shared = run_together([partial(InMemory, spec, law=one) for spec in specs])
    assert "samples.eta1_cmd_m_s" in differences(shared[0], alone[0])


def test_a_factory_that_gives_one_law_again_and_again(tmp_path):
    """What is put around a law, for holds and for axes of its own, hides it from nobody."""
    lines = Path(__file__).read_text("utf-8").partition("class Creeping:")[2].partition("\n\n\n")[0]
    text = "from hil.core.types import OuterCommand\nimport hil\n\n\nclass Creeping:" + lines
    text += (
        '\n\n\nONE = Creeping()\n\n\n@hil.outer_law("again")\ndef again(*_given):\n    return ONE\n'
    )
    outer = OUTER_LAWS.get(str(written(tmp_path / "again.py", text))).name
    specs = [replace(spec_of(ONE | {"axes": axes}), outer=outer) for axes in (0.0, 0.7)]
    require_same(specs, execute_together(specs))


def test_an_interruption_stops_all():
    """Ctrl-C in one run stops every robot, and is told once all have stopped."""
    opened = []

    def open_one(law=None):
        opened.append(InMemory(spec_of(ONE), law=law))
        return opened[-1]

    with pytest.raises(KeyboardInterrupt):
        run_together([open_one, partial(open_one, Breaking(KeyboardInterrupt())), open_one])
    for run in opened:
        assert run.session.ending.outcome == "interrupted"
        assert "stopped" in [event.kind for event in run.record().events]


def test_an_interruption_that_a_session_meets_itself_stops_all(monkeypatch):
    """Ctrl-C that comes while one run looks at a message of its board is for the others too."""
    opened = []

    def open_one(spec):
        opened.append(InMemory(spec))
        return opened[-1]

    hear = Intake.hear

    def pressed(self, pump):
        session = opened[1].session if len(opened) == 3 else None
        if session is not None and self is session._intake and session._t0_s:  # all have begun
            raise KeyboardInterrupt("SIGINT")
        return hear(self, pump)

    monkeypatch.setattr(Intake, "hear", pressed)
    told = spec_of(ONE | {"fault": "board_reset"})  # the board says so in the midst of its run
    with pytest.raises(KeyboardInterrupt, match="SIGINT"):
        run_together([partial(open_one, spec) for spec in (spec_of(ONE), told, spec_of(ONE))])
    endings = [run.session.ending for run in opened]
    assert [(ending.outcome, ending.detail) for ending in endings] == [
        ("interrupted", "SIGINT")
    ] * 3
    assert opened[0].record().samples["t_s"].size > 1


def test_the_comparison_sees_a_rig_moved_too_far(monkeypatch):
    """A run whose company moves its rig on by a step more is another run (negative control)."""
    spec = spec_of(ONE | {"scenario": "circle"})
    alone = execute_in_memory(spec)
    begin = together._Company.begin

    def too_far(self):
        begin(self)
        self._sessions[0]._parts.rig.wait(self._sessions[0]._parts.rig.now_s() + 1e-4)

    monkeypatch.setattr(together._Company, "begin", too_far)
    moved, other = execute_together([spec, replace(spec, seed=5)])
    assert "samples.est_x_m" in differences(alone, moved)
    monkeypatch.undo()
    assert differences(other, execute_in_memory(replace(spec, seed=5))) == []
