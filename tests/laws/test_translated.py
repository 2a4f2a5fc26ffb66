"""Laws and references in native code are their Python sources, to the bit."""

import math
import struct
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.config.control import (
    CircleReference,
    ControlConfig,
    OuterLimits,
    PointReference,
    StopsReference,
    WaypointReference,
)
from hil.config.load import load_scenario
from hil.control import _outer, translated
from hil.control.laws import axes
from hil.control.laws.asg_ism import AsgIsm
from hil.control.laws.hold import HoldAtGoal
from hil.control.laws.let_go import LetGo
from hil.control.laws.parts import WithoutFeedForward, leave_out
from hil.control.laws.turn_first import TurnFirst
from hil.control.laws.within import WithinWheelSpeed
from hil.control.references import Reference, make_reference
from hil.control.vehicles.vehicle import make_vehicle
from hil.core.registries import OUTER_LAWS
from hil.core.registry import BUILT_IN
from hil.core.types import OuterCommand, ReferenceState
from tests.laws.support import D0_M, estimate, point

VEHICLE = make_vehicle(load_scenario("scenario-1").robot)
SPEEDS = st.floats(-1.0, 1.0)
PLACES = st.floats(-2.0, 2.0)
VECTORS = st.tuples(SPEEDS, SPEEDS)
STEPS = st.lists(
    st.fixed_dictionaries(
        {
            "x": PLACES,
            "y": PLACES,
            "theta": st.floats(-7, 7),
            "eta1": SPEEDS,
            "w": st.floats(-3, 3),
            "z3": st.none() | VECTORS,
            "sides": st.sampled_from([(0, 0), (1, 0), (0, -1), (1, -1)]),
            "hard": st.booleans(),
            "near": st.booleans(),  # at the goal and slow: where laws hold
            "moving": st.booleans(),
            "rates": st.tuples(VECTORS, VECTORS, VECTORS),
        }
    ),
    min_size=1,
    max_size=12,
)
LIMITS = st.builds(
    OuterLimits,
    approach_speed_m_s=st.none() | st.floats(0.05, 1.0),
    approach_accel_m_s2=st.none() | st.floats(0.1, 3.0),
    turn_missing_rad_s=st.none() | st.floats(0.1, 3.0),
    let_go_rad_s=st.none() | st.floats(0.1, 9.0),
    lead_s=st.floats(0.0, 0.2),
    lambda_m_s=st.floats(0.001, 0.5),
)
BUILT_IN_LAWS = [entry.name for entry in OUTER_LAWS.entries() if entry.origin == BUILT_IN]
LAWS = st.sampled_from(BUILT_IN_LAWS)
WHOLE = (0.5,) * 16


def gains_of(law, p=1.0, cost="sum", start=None, shares=WHOLE):
    """Return gains of a law, each in its search box at its share, with the parts on that ship off."""
    entry = OUTER_LAWS.get(law)
    drawn = {
        name: least * (most / least) ** share
        for (name, (least, _, most)), share in zip(entry.search.items(), shares, strict=False)
    }
    more = {"ki_s4": 1.5, "p": p, "cost": cost, "eps0_m_s2": 0.4, "gamma1_s3": 0.3}
    more = {name: value for name, value in more.items() if name in entry.settings.model_fields}
    shipped = ControlConfig().active_gains.of(entry)
    return shipped.model_copy(update=drawn | more | {"zeta_start_m_s2": start})


def stacked(law, gains, limits, within_rad_s=9.0, axes_rad=0.0, without=()):
    """Return a law under all that holds for every law, without some of its parts."""
    inner = OUTER_LAWS.get(law).factory(gains, limits, D0_M)
    for part in set(without) - {"feed-forward"}:
        leave_out(inner, part)
    if "feed-forward" in without:
        inner = WithoutFeedForward(inner)
    held = axes.in_axes(HoldAtGoal(inner, limits), axes_rad)
    bounded = WithinWheelSpeed(held, VEHICLE, within_rad_s)
    turning = TurnFirst(bounded, limits.turn_missing_rad_s)
    return LetGo(turning, VEHICLE, limits.let_go_rad_s)


def situation(drawn):
    """Return reference and estimate of a drawn step."""
    rates = drawn["rates"] if drawn["moving"] else ((0.0, 0.0),) * 3
    goal = (drawn["x"] + 0.001, drawn["y"]) if drawn["near"] else (0.3, -0.2)
    eta1, w = (0.01, 0.1) if drawn["near"] else (drawn["eta1"], drawn["w"])
    here = estimate(drawn["x"], drawn["y"], drawn["theta"], eta1, w=w, z3=drawn["z3"])
    return ReferenceState(goal, *rates), replace(
        here, sides_at_limit=drawn["sides"], driven_hard=drawn["hard"]
    )


def bits(values):
    """Return numbers as they lie in memory."""
    return [struct.pack("d", value) for value in values]


def unequal(law, twin, steps):
    """Return the numbers of the steps at which two laws differ."""
    found = []
    for number, drawn in enumerate(steps):
        reference, here = situation(drawn)
        if number == 0:
            law.reset(reference, here)
            twin.reset(reference, here)
        out, (eta1, w, trace) = (
            law.step(reference, here, 1 / 30),
            twin.step(reference, here, 1 / 30),
        )
        mine = bits([out.eta1_m_s, out.theta_dot_rad_s])
        mine += bits(out.trace.get(key, math.nan) for key in _outer.TRACE_KEYS)
        if mine != bits([eta1, w, *(trace[key] for key in _outer.TRACE_KEYS)]):
            found.append(number)
    return found


def test_all_built_in_laws_are_native():
    """Each with its shipped gains; its class is one of those that were translated."""
    assert len(BUILT_IN_LAWS) == len(_outer.LAWS) == 8
    for name in BUILT_IN_LAWS:
        assert translated.is_translated(
            OUTER_LAWS.get(name).factory(gains_of(name), OuterLimits(), D0_M)
        )


@settings(max_examples=250, deadline=None)
@given(
    law=LAWS,
    limits=LIMITS,
    steps=STEPS,
    p=st.sampled_from([1.0, 1.5, 2.0]),
    cost=st.sampled_from(["sum", "norm"]),
    start=st.none() | st.floats(0.0, 1.0),
    within_rad_s=st.floats(1.0, 12.0),
    axes_rad=st.just(0.0) | st.floats(-3.2, 3.2),
    shares=st.tuples(*[st.floats(0.0, 1.0)] * 8),
    without=st.sets(st.sampled_from(["kappa", "gamma", "feed-forward"])),
)
def test_a_native_law_is_its_python_source(
    law, limits, steps, *, p, cost, start, within_rad_s, axes_rad, shares, without
):
    """Commands and traces are equal to the bit, whatever limits, gains, axes, parts and steps are drawn."""
    without = without if law == "asg-ism" else without & {"feed-forward"}
    gains = gains_of(law, p, cost, start, shares)
    made = stacked(law, gains, limits, within_rad_s, axes_rad, without)
    twin = translated.native_law(made)
    assert unequal(made, twin, steps) == []


def far(number):
    """Return a step that is far from every limit, another for each number."""
    return {
        "x": 0.0, "y": 0.1, "theta": 0.4, "eta1": 0.2, "w": 0.1, "z3": None, "sides": (0, 0),
        "hard": False, "near": False, "moving": False, "rates": ((0.0, 0.0),) * 3,
    } | {"x": 0.05 * number}  # fmt: skip


@pytest.mark.parametrize("law", BUILT_IN_LAWS)
def test_the_comparison_sees_one_unit_in_the_last_place(law):
    """Gains that differ by their last bits give other commands (negative control)."""
    gains, limits = gains_of(law), OuterLimits()
    names = [name for name in OUTER_LAWS.get(law).search if name != "zeta_start_m_s2"]
    steps = [far(number) for number in range(8)]
    seen = []
    for name in names:
        other = gains.model_copy(update={name: math.nextafter(getattr(gains, name), math.inf)})
        seen.append(
            unequal(
                stacked(law, gains, limits),
                translated.native_law(stacked(law, other, limits)),
                steps,
            )
        )
    assert any(seen)
    assert sum(map(bool, seen)) >= len(names) - 1, dict(zip(names, seen, strict=True))


def test_a_part_that_is_off_in_python_alone_is_seen():
    """Kappa, gamma and feed-forward each change what the law says (negative control)."""
    gains, limits = gains_of("asg-ism"), OuterLimits()
    moving = {"moving": True, "rates": ((0.1, 0.2), (0.3, 0.1), (0.2, 0.4))}
    steps = [far(number) | moving for number in range(8)]
    twin = translated.native_law(stacked("asg-ism", gains, limits))
    for part in ("kappa", "gamma", "feed-forward"):
        off = stacked("asg-ism", gains, limits, without={part})
        assert unequal(off, twin, steps), part


def test_the_parts_of_a_law_are_its_own():
    """One observer derived from the built-in one, or a value that hides a method, and Python is asked."""
    made = OUTER_LAWS.get("dob-pid").factory(gains_of("dob-pid"), OuterLimits(), D0_M)
    assert translated.is_translated(made)
    first, second = made._axes
    made._axes = (first, type("Other", (type(second),), {})(1.0))
    assert not translated.is_translated(made)
    made._axes = (first, second)
    second.see = lambda *_: None
    assert not translated.is_translated(made)


REFERENCES = {
    "point": PointReference(x_m=0.3, y_m=-0.2),
    "circle": CircleReference(radius_m=0.7, rate_rad_s=0.41, center_x_m=0.1),
    "line": WaypointReference(points_m=((0.0, 0.0), (0.7, 0.3))),
    "waypoints": WaypointReference(points_m=((0.0, 0.0), (0.5, 0.2), (0.6, 0.7), (0.0, 0.9))),
    "stops": StopsReference(points_m=((0.0, 0.0), (0.5, 0.2), (0.1, 0.6)), pause_s=0.7),
}


@settings(max_examples=60, deadline=None)
@given(kind=st.sampled_from(sorted(REFERENCES)), times=st.lists(st.floats(-1.0, 40.0), max_size=20))
def test_a_native_reference_is_its_python_source(kind, times):
    """Place and derivatives are equal to the bit at every time, before the start and after the end too."""
    reference: Reference = make_reference(REFERENCES[kind])
    twin = translated.native_reference(reference)
    for t_s in (0.0, *times):
        state = reference.at(t_s)
        of = (state.z1_m, state.z1_dot_m_s, state.z1_ddot_m_s2, state.z1_dddot_m_s3)
        assert [bits(v) for v in twin.at(t_s)] == [bits(v) for v in of]


def test_the_comparison_sees_axes_turned_by_one_bit_more():
    """The same for the angle of a law's axes (negative control)."""
    gains, limits = gains_of("asg-ism"), OuterLimits()
    twin = translated.native_law(stacked("asg-ism", gains, limits, axes_rad=0.7))
    other = stacked("asg-ism", gains, limits, axes_rad=math.nextafter(0.7, 1.0))
    step = {
        "x": 0.0, "y": 0.1, "theta": 0.4, "eta1": 0.2, "w": 0.1, "z3": (0.1, 0.2), "sides": (0, 0),
        "hard": False, "near": False, "moving": True, "rates": ((0.1, 0.2), (0.3, 0.1), (0.2, 0.4)),
    }  # fmt: skip
    steps = [step | {"x": 0.05 * k} for k in range(8)]
    assert unequal(stacked("asg-ism", gains, limits, axes_rad=0.7), twin, steps) == []
    assert unequal(other, twin, steps) != []


class Vectors:
    """A law of somebody's own that puts what it sees into its trace, in a number of a kind."""

    def __init__(self, kind=float):
        self.kind = kind

    def reset(self, _reference, estimate):
        self.start = estimate.z1_m

    def step(self, reference, estimate, _dt_s):
        (x, y), (vx, vy) = estimate.z1_m, reference.z1_dot_m_s
        named = {
            "way_x_m": x - self.start[0], "way_y_m": y - self.start[1], "pull_x": vx, "pull_y": vy,
            "s_x": vx, "s_y": vy, "far_m": x * y,
        }  # fmt: skip
        trace = {name: self.kind(value) for name, value in named.items()}
        return OuterCommand(0.1 * x, 0.2 * y * estimate.pose.theta_rad, trace)


OWN = ("way_x_m", "way_y_m", "pull_x", "pull_y", "far_m")


def own_unequal(law, native, steps):
    """Return the numbers of the steps at which a law and its native form differ, its own terms too."""
    found, names = [], (*OWN, "s_x", "s_y")
    for number, drawn in enumerate(steps):
        reference, here = situation(drawn)
        for one in (law, native) if number == 0 else ():
            one.reset(reference, here)
        out = law.step(reference, here, 1 / 30)
        eta1, w, trace = native.step(reference, here, 1 / 30, OWN)
        mine = [out.eta1_m_s, out.theta_dot_rad_s, *(out.trace[key] for key in names)]
        if bits(mine) != bits([eta1, w, *(trace[key] for key in names)]):
            found.append(number)
    return found


@settings(max_examples=40, deadline=None)
@given(steps=STEPS, kind=st.sampled_from([float, np.float32, np.float64]))
def test_axes_of_a_law_in_python_are_turned_natively(steps, kind):
    """Its commands and the vectors of its trace, of its own too, are equal to the bit."""
    native = translated.native_law(axes.in_axes(Vectors(kind), 0.7), OWN)
    assert own_unequal(axes.in_axes(Vectors(kind), 0.7), native, steps) == []


def test_the_comparison_sees_a_vector_of_its_own_that_is_not_turned(monkeypatch):
    """Where native code is told of no vectors the same trace is another (negative control)."""
    monkeypatch.setattr(translated, "_own_vectors", lambda _: [])
    native = translated.native_law(axes.in_axes(Vectors(), 0.7), OWN)
    steps = [far(1), far(2) | {"moving": True}]
    assert own_unequal(axes.in_axes(Vectors(), 0.7), native, steps) != []


@pytest.mark.parametrize(
    "own", [("way_x_m",), ("way_y_m",), ("pull_x", "far_m"), ("a_x_y_m", "a_y_y_m", "a_x_x_m")]
)
def test_axes_are_turned_in_python_where_half_of_a_vector_is_not_kept(own):
    """The other half may be in its trace: native code, which does not take it, would not know."""
    assert translated._own_vectors(own) is None
    assert translated._own_vectors(OWN) == [
        tuple(translated.trace_places(OWN)[name] for name in pair)
        for pair in (("way_x_m", "way_y_m"), ("pull_x", "pull_y"))
    ]


class Derived(AsgIsm):
    """A law of somebody's own that changes a part of a built-in one."""

    def _bound(self, reference, estimate):
        return 2.0 * super()._bound(reference, estimate)


def shipped(kind=AsgIsm):
    """Return a law of this class with its shipped gains."""
    return kind(ControlConfig().active_gains.asg_ism, OuterLimits(), D0_M)


def test_what_is_not_the_class_itself_is_not_taken_for_it():
    """Derived classes, blocks of another class, replaced methods of one object: all are asked in Python."""
    assert translated.is_translated(shipped())
    assert not translated.is_translated(shipped(Derived))
    other = shipped()
    other._block = object()
    assert not translated.is_translated(other)
    patched = shipped()
    patched.step = lambda *_: None
    assert not translated.is_translated(patched)


@settings(max_examples=30, deadline=None)
@given(steps=STEPS, limits=LIMITS)
def test_native_code_asks_a_law_in_python_the_same(steps, limits):
    """Under what holds for every law, a derived law gives the same commands and traces to the bit."""
    gains = gains_of("asg-ism", cost="norm")

    def made():
        bounded = WithinWheelSpeed(HoldAtGoal(Derived(gains, limits, D0_M), limits), VEHICLE, 6.0)
        return LetGo(TurnFirst(bounded, limits.turn_missing_rad_s), VEHICLE, limits.let_go_rad_s)

    assert unequal(made(), translated.native_law(made()), steps) == []


class Traced:
    """A law whose trace is its own; `trace` is what it gives."""

    def __init__(self, trace):
        self.trace = trace
        self.asked = []

    def reset(self, reference, estimate):
        self.asked.append((reference, estimate))

    def step(self, reference, estimate, dt_s):
        assert dt_s > 0.0
        self.asked.append((reference, estimate))
        return OuterCommand(0.1, 0.2, self.trace)


def test_a_law_in_python_is_given_values_as_python_makes_them():
    """Reference and estimate are equal to those that a session makes, and of the same classes."""
    law = Traced({})
    native = translated.native_law(law)
    reference, here = (
        ReferenceState((1.0, 2.0), (0.1, 0.2), (0.3, 0.4), (0.5, 0.6)),
        estimate(0.1, w=0.3),
    )
    here = replace(here, sides_at_limit=(1, -1), driven_hard=True)
    native.reset(reference, here)
    assert law.asked == [(reference, here)]
    assert [type(value) for value in law.asked[0]] == [type(reference), type(here)]


def test_an_error_of_a_law_in_python_comes_through_native_code():
    """What a law raises, or gives that is no number, is raised as it is."""
    law = Traced({"eps": "much"})
    native = translated.native_law(law)
    with pytest.raises(TypeError, match="must be real number"):
        native.step(point(0, 0), estimate(), 0.1)
    law.step = lambda *_: OuterCommand("fast", 0.0, {})
    with pytest.raises(TypeError, match="must be real number, not str"):
        native.step(point(0, 0), estimate(), 0.1)
    law.reset = lambda *_: 1 / 0
    with pytest.raises(ZeroDivisionError):
        translated.native_law(law).reset(point(0, 0), estimate())
