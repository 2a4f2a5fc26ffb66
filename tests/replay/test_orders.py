"""An operator's orders in a run: what may be changed, what comes of it, and that a replay does it again."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from hil.config.control import OuterLimits
from hil.config.gains import make_gains, shipped_gains
from hil.core.errors import BadInput
from hil.core.registries import OUTER_LAWS
from hil.record import layout
from hil.record.tape import ORDER, read_tape
from hil.replays.exact import replay
from hil.replays.firmware import replay_wheels
from hil.replays.what_if import what_if
from hil.runs.execute import execute
from hil.runs.orders import ARM, OrderSource, change_of, step_of, tunables
from tests.laws.support import D0_M, estimate, point
from tests.replay.records import spec

ASG_ISM = OUTER_LAWS.get("asg-ism")


def planned(orders):
    """Return a source that gives the orders planned for its n-th call, counted from 1."""
    calls = [0]

    def take():
        calls[0] += 1
        return orders.get(calls[0], [])

    return take


def tuned(out, orders, **changes):
    """Run scenario 1 for 3 s with orders at given ticks."""
    return execute(spec(out, **changes), orders=OrderSource(planned(orders)))


def told(record):
    """Return the events of tuning."""
    return [event.text for event in record.events if event.kind == "tuning"]


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """Run without an order."""
    return execute(spec(tmp_path_factory.mktemp("orders") / "plain"))


@pytest.fixture(scope="module")
def changed(tmp_path_factory):
    """Run with two values of the law and one of the board changed, that one back."""
    out = tmp_path_factory.mktemp("orders") / "changed"
    change = {"set": "law.k1_s", "value": 2.0}, {"set": "board.FF_DEAD", "value": 0.25}
    back = {"set": "board.FF_DEAD", "value": 0.16}, {"set": "law.alpha_m_s3", "value": 1.0}
    return tuned(out, {30: change, 60: back})


def test_changes_are_events_and_change_the_run(plain, changed):
    """Up to the change the run is that without one, from there on another; each change is an event."""
    assert [text.split(" ")[0] for text in told(changed)] == [
        "law.k1_s", "board.FF_DEAD", "law.alpha_m_s3", "board.FF_DEAD"
    ]  # fmt: skip
    assert told(changed)[1].endswith("0.16 -> 0.25")
    before, after = plain.samples["eta1_cmd_m_s"], changed.samples["eta1_cmd_m_s"]
    same = before == after
    assert same[:29].all()
    assert not same[29:].all()


def test_an_exact_replay_takes_the_orders_again(changed, tmp_path):
    """Bit for bit, frames to the board too; a tape without one of its orders does not come out the same."""
    assert replay(changed.path).identical
    short = tmp_path / "short"
    short.mkdir()
    for file in changed.path.iterdir():
        if file.is_file():
            (short / file.name).write_bytes(file.read_bytes())
    tape = short / layout.TAPE
    first = json.dumps({"set": "law.k1_s", "value": 2.0}).encode()
    at = tape.read_bytes().index(first)
    data = tape.read_bytes()
    tape.write_bytes(data[: at - 5] + data[at + len(first) :])
    found = replay(short)
    assert not found.identical
    assert found.first.name.startswith(("eta1", "theta_dot", "s_", "v1", "link"))


def test_a_run_without_orders_has_none_on_its_tape(plain, changed, tmp_path):
    """And with a source that never says anything its samples are the same bytes."""
    assert all(kind != ORDER for kind, _ in read_tape(plain.path / layout.TAPE).entries)
    assert len(read_tape(changed.path / layout.TAPE).orders()) == 4
    quiet = tuned(tmp_path / "quiet", {})
    samples = [(run.path / layout.SAMPLES).read_bytes() for run in (plain, quiet)]
    assert samples[0] == samples[1]


def test_a_board_that_refuses_keeps_its_value(tmp_path):
    """W_MAX is fixed while armed: the event says so, the run goes on, the replay too."""
    run = tuned(tmp_path / "run", {20: [{"set": "board.W_MAX", "value": 10.0}]})
    assert run.manifest.outcome == "complete"
    (text,) = told(run)
    assert "fixed while armed" in text
    assert replay(run.path).identical


def test_the_goal_is_stepped_inside_the_fence(tmp_path):
    """A step moves the reference at once; one that would come to the fence is an event and no step."""
    run = tuned(tmp_path / "run", {40: [step_of(0.1, -0.05)], 50: [step_of(0.9, 0.0)]})
    x, y = run.samples["ref_z1_x_m"], run.samples["ref_z1_y_m"]
    assert np.diff(x)[38] == pytest.approx(0.1)
    assert np.diff(y)[38] == pytest.approx(-0.05)
    assert np.count_nonzero(np.diff(x)) == 1
    assert told(run)[0] == "goal stepped by (+0.100, -0.050) m"
    assert "not within 0.15 m of the fence" in told(run)[1]
    assert replay(run.path).identical


def test_a_robot_that_is_armed_by_hand_rests_until_then(tmp_path):
    """Held for 40 calls, then armed: it stands meanwhile, and the replay waits as long."""
    run = execute(spec(tmp_path / "run"), orders=OrderSource(planned({40: [ARM]}), held=True))
    assert run.manifest.outcome == "complete"
    events = {event.text: event.t_s for event in run.events}
    waited_s = events["armed by hand"] - events["robot found; it is armed by hand"]
    assert waited_s == pytest.approx(39 / 30, abs=0.02)
    assert events["armed by hand"] < 0.0
    assert replay(run.path).identical


@pytest.mark.parametrize(
    ("orders", "said"),
    [
        ([ARM], None),
        ([{"set": "board.ST_L0", "value": math.inf}], "board.ST_L0: refused inf"),
        ([{"set": "board.FF_DEAD", "value": 1e300}], "board.FF_DEAD: refused 1e+300"),
        ([{"set": "board.FF_DEAD", "value": math.nan}], "board.FF_DEAD: refused nan"),
        ([{"set": "board.NOPE", "value": 1.0}], "has no parameter 'NOPE'"),
        ([{"set": "law.k1_s", "value": math.nan}], "law.k1_s: refused nan"),
        ([{"set": "law.model_config", "value": 1.0}], "law.model_config: refused 1"),
        ([{"step": [math.nan, 0.0]}], "not within 0.15 m of the fence"),
    ],
)
def test_odd_orders_end_no_run_and_its_replay_is_exact(tmp_path, orders, said):
    """Whoever gives orders past the checks of the console: an event says what was not done."""
    run = tuned(tmp_path / "run", {20: orders}, overrides=["duration_s=1"])
    assert run.manifest.outcome == "complete"
    assert [said in text for text in told(run)] == ([True] if said else [])
    assert replay(run.path).identical


def test_what_may_be_changed_and_within_which_bounds():
    """The law's numbers and the board's live ones; not how it starts, no switch, nothing fixed."""
    known = tunables(spec(Path()))
    assert {"law.k1_s", "law.sigma_m_s2", "board.PID_KP", "board.ISM_K0"} <= set(known)
    assert not {"law.zeta_start_m_s2", "law.cost", "board.LAW", "board.W_MAX"} & set(known)
    assert change_of(known, ASG_ISM, "board.PID_KP", 0.3) == {"set": "board.PID_KP", "value": 0.3}
    for key, value, said in (
        ("board.PID_KP", 5.1, "allowed are 0 to 5"),
        ("law.k1_s", 0.0, "greater than 0"),
        ("board.W_MAX", 10.0, "fixed while the robot is armed"),
        ("law.k9", 1.0, "no such value"),
    ):
        with pytest.raises(BadInput, match=said):
            change_of(known, ASG_ISM, key, value)
    with pytest.raises(BadInput, match="at most 1 m"):
        step_of(0.9, 0.9)


def test_replays_that_ask_for_one_law_say_what_they_do(changed):
    """A what-if has no one law to set beside; the wheels are replayed with what was set live."""
    with pytest.raises(BadInput, match="4 values were changed while it ran"):
        what_if(changed.path, "pid")
    found = replay_wheels(changed.path)
    assert found.left.correlation > 0.99
    assert replay(changed.path, overrides=["control.limits.lead_s=0.0"]).kind == "shadow"


BUILT_IN = [entry.name for entry in OUTER_LAWS.entries() if entry.origin == "built in"]


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_built_in_law_goes_on_with_other_gains(name):
    """In mid-way to a goal its speed moves on by no more than a tick allows, and the gain counts."""
    entry, limits, dt_s = OUTER_LAWS.get(name), OuterLimits(), 1 / 30
    gains = make_gains(shipped_gains()["tuned"]).of(entry)
    reference = point(1.0, 0.3)

    def driven(law, x, eta1, ticks):
        for _ in range(ticks):
            command = law.step(reference, estimate(x, 0.0, 0.3, eta1), dt_s)
            eta1 = command.eta1_m_s
            x += eta1 * dt_s
        return x, eta1

    law = entry.factory(gains, limits, D0_M)
    law.reset(reference, estimate(0.0, 0.0, 0.3))
    x, eta1 = driven(law, 0.0, 0.0, 30)
    assert eta1 > 0.05
    first = next(f for f in type(gains).model_fields if f not in {"zeta_start_m_s2", "p"})
    law.retune(gains.model_copy(update={first: 1.2 * getattr(gains, first)}))
    _, after = driven(law, x, eta1, 1)
    assert abs(after - eta1) <= limits.zeta_max_m_s2 * dt_s + 1e-9
    same = entry.factory(gains, limits, D0_M)
    same.reset(reference, estimate(0.0, 0.0, 0.3))
    driven(same, 0.0, 0.0, 30)
    assert driven(same, x, eta1, 40) != driven(law, x, eta1, 40)  # and the gain counts


def test_the_integral_of_pid_keeps_what_it_commands():
    """Twice the integral gain halves the integral; a gain of zero forgets it."""
    gains = make_gains(shipped_gains()["tuned"]).pid.model_copy(update={"ki_s4": 1.0})
    law = OUTER_LAWS.get("pid").factory(gains, OuterLimits(), D0_M)
    law.reset(point(0.02, 0.0), estimate())
    for _ in range(10):
        law.step(point(0.02, 0.0), estimate(), 1 / 30)
    before = law._integral
    assert before[0] < 0.0
    law.retune(gains.model_copy(update={"ki_s4": 2.0}))
    assert law._integral[0] == pytest.approx(before[0] / 2.0)
    law.retune(gains.model_copy(update={"ki_s4": 0.0}))
    assert law._integral == (0.0, 0.0)
