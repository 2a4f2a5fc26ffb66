"""The three ways in which a run in memory may advance give the same run to the bit.

All its ticks in native code; from arrival to arrival in native code and tick by tick in Python, which a law
or a reference of somebody's own needs; or step by step in Python, as other rigs, estimators and records do.
"""

import gc
import math
import weakref
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.board.wheel_laws import WHEEL_LAWS
from hil.config.fit import board_parameters
from hil.config.load import load_scenario
from hil.control import _outer, translated
from hil.control.laws import chain
from hil.control.laws.making import make_law, make_outer_law
from hil.core import _native as core_native
from hil.core.clocks import CameraClock
from hil.core.registries import OUTER_LAWS
from hil.core.registry import BUILT_IN
from hil.record.memory import MemoryRecorder
from hil.rigs.opening import open_rig
from hil.runs import session
from hil.runs.assembly import make_parts
from hil.runs.execute import execute_in_memory
from hil.runs.provenance import make_manifest, used_things
from hil.runs.session import Session
from hil.runs.spec import RunSpec
from hil.study.parts_off import opened_without, parts_of
from hil.wire.identity import board_hashes

# Each with what it needs besides its kind; they begin after half a second.
FAULTS = {
    "none": "",
    "camera_occluded": "end_s = 1.2",
    "camera_stall": "end_s = 0.9",
    "camera_repeated": "end_s = 1.0",
    "camera_clock_step": "end_s = 1.5, step_s = 0.5",
    "link_cut": "end_s = 0.7",
    "link_up_cut": "end_s = 1.4",
    "link_down_cut": "end_s = 1.4",
    "link_duplicated": "end_s = 1.5",
    "link_reordered": "end_s = 1.5",
    "motor_stuck": 'side = "left"',
    "dead_encoder": 'side = "right"',
    "board_reset": "",
}
BUILT_IN_LAWS = [entry.name for entry in OUTER_LAWS.entries() if entry.origin == BUILT_IN]
CASES = st.fixed_dictionaries(
    {
        "scenario": st.sampled_from(
            ["scenario-1", "scenario-2", "scenario-3", "circle", "figure-eight", "stop-and-go"]
        ),
        "outer": st.sampled_from(BUILT_IN_LAWS),
        "inner": st.sampled_from(sorted(WHEEL_LAWS)),
        "fault": st.sampled_from(sorted(FAULTS)),
        "loss": st.sampled_from([0.0, 0.05]),
        "corruption": st.sampled_from([0.0, 0.002]),
        "drop": st.sampled_from([0.0, 0.2]),
        "axes": st.sampled_from([0.0, 0.7]),
        "seed": st.integers(0, 10_000),
    }
)
ONE = {
    "scenario": "scenario-1",
    "outer": "asg-ism",
    "inner": "asg-ism",
    "fault": "none",
    "loss": 0.0,
    "corruption": 0.0,
    "drop": 0.0,
    "axes": 0.0,
    "seed": 3,
}


def spec_of(case):
    """Return two seconds of a case."""
    settings_ = [
        "duration_s=2",
        f"link.loss_ratio={case['loss']}",
        f"link.corruption_ratio={case['corruption']}",
        f"camera.drop_ratio={case['drop']}",
        f"control.axes_rad={case['axes']}",
    ]
    if case["fault"] != "none":
        more = FAULTS[case["fault"]]
        fault = f'kind = "{case["fault"]}", start_s = 0.5{", " + more if more else ""}'
        settings_.append(f"faults=[{{{fault}}}]")
    scenario = load_scenario(case["scenario"], settings_)
    camera = case.get("camera", "pose")
    return RunSpec(scenario, "twin", camera, case["outer"], case["inner"], case["seed"], Path())


def session_parts(spec):
    """Return the parts of a session over the twin, recorded in memory."""
    rig = open_rig("twin", spec.scenario, "pose", spec.seed)
    parameters = board_parameters(spec.scenario, spec.inner)
    sink = MemoryRecorder(make_manifest(spec, parameters, used_things(spec)))
    return make_parts(spec, rig, sink, make_law(spec.outer, spec.scenario))


def run(case, make_pump, make_drive):
    """Return the record of a case with the intake and the ticks that these give."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session, "make_pump", make_pump)
        patch.setattr(session, "make_drive", make_drive)
        return execute_in_memory(spec_of(case))


def noted(make, made):
    """Return a maker that notes what it gives."""

    def noting(*parts):
        made.append(make(*parts))
        return made[-1]

    return noting


def in_native(case):
    """Return the record of a case that advances in native code, as it must."""
    pumps, drives = [], []
    record = run(case, noted(REAL, pumps), noted(REAL_DRIVE, drives))
    assert pumps[0] is not None
    if any(event.kind == "armed" for event in record.events):
        assert drives[0] is not None
    return record


def by_ticks(case):
    """Return the record of a case taken in by native code, whose ticks are Python's."""
    return run(case, REAL, lambda *_: None)


def in_python(case):
    """Return the record of a case taken in by Python."""
    return run(case, lambda *_: None, REAL_DRIVE)


REAL_PYTHON_LAW = _outer.python_law
REAL, REAL_DRIVE = session.make_pump, session.make_drive


def differences(one, other):
    """Return the names of what two records have not equal to the bit."""
    found = [
        f"{table}.{name}"
        for table in ("samples", "frames")
        for name, values in getattr(one, table).items()
        if np.asarray(values).tobytes() != np.asarray(getattr(other, table)[name]).tobytes()
    ]
    for name in ("outcome", "outcome_detail", "link", "tick_count"):
        if getattr(one.manifest, name) != getattr(other.manifest, name):
            found.append(name)
    if one.events != other.events:
        found.append("events")
    if one.manifest.outcome == "complete" and repr(one.figures().values) != repr(
        other.figures().values
    ):
        found.append("figures")
    return found


@settings(max_examples=25, deadline=None)
@given(CASES)
def test_all_ways_give_the_same_run(case):
    """Samples, frames, events, counters, outcome and figures are equal to the bit, whatever is drawn."""
    native = in_native(case)
    assert differences(native, in_python(case)) == []
    assert differences(native, by_ticks(case)) == []


def retuned(law, shares):
    """Return settings by which a law runs with gains of its search box, at these shares of it."""
    box = OUTER_LAWS.get(law).search
    gains = {
        name: least * (most / least) ** share
        for (name, (least, _, most)), share in zip(box.items(), shares, strict=False)
    }
    table = f"control.gains.tuned.{law.replace('-', '_')}"
    return ["control.gain_set=tuned", *(f"{table}.{name}={gain!r}" for name, gain in gains.items())]


@settings(max_examples=14, deadline=None)
@given(
    law=st.sampled_from(BUILT_IN_LAWS),
    shares=st.tuples(*[st.floats(0.3, 0.7)] * 8),
    axes=st.sampled_from([0.0, -0.4]),
    seed=st.integers(0, 10_000),
    data=st.data(),
)
def test_a_retuned_law_without_a_part_is_native_too(law, shares, axes, seed, data):
    """With other gains and a part off, as tuning and ablation make it, a run is the same to the bit."""
    without = data.draw(st.sampled_from(["", *(p for p in parts_of(law) if p != "observed-z3")]))
    more = ["duration_s=1.5", f"control.axes_rad={axes}", *retuned(law, shares)]
    scenario = load_scenario("circle", more)
    translated_laws = []

    def kept(law_, *rest):
        translated_laws.append(law_)
        return REAL_PYTHON_LAW(law_, *rest)

    def record(make_drive):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(_outer, "python_law", kept)
            patch.setattr(session, "make_drive", make_drive)
            run_ = opened_without(scenario, law, seed, without)
            run_.session.run()
            found = run_.record()
            run_.close()
            return found

    drives = []
    native, by_hand = record(noted(REAL_DRIVE, drives)), record(lambda *_: None)
    assert drives[0] is not None
    assert translated_laws == []  # native code asks nobody in Python
    assert native.manifest.tick_count > 30
    assert differences(native, by_hand) == []


@pytest.mark.parametrize("fault", sorted(FAULTS))
def test_all_ways_give_the_same_run_under_each_fault(fault):
    """The same for each fault by itself; one that ends the run ends it with the same words."""
    case = ONE | {"fault": fault}
    native = in_native(case)
    assert differences(native, in_python(case)) == []
    assert differences(native, by_ticks(case)) == []


@pytest.mark.parametrize("fault", ["none", *sorted(f for f in FAULTS if f.startswith("camera_"))])
def test_pictures_give_the_same_run_in_all_ways(fault):
    """Rendered frames, looked at by the marks' localiser: the same to the bit, covariances and marks too."""
    case = ONE | {"fault": fault, "camera": "rendered"}
    native = in_native(case)
    assert differences(native, in_python(case)) == []
    assert np.isfinite(native.frames["cov_xt_m_rad"][native.frames["seen"] > 0]).all()
    assert np.isfinite(native.frames["front_u_px"]).sum() > 20


def test_faulty_pictures_are_taken_in_by_python():
    """What tells a picture apart that is drawn at once are its pixels: native code does not look at those."""
    pumps = []
    fault = 'faults=[{kind = "camera_exposure", start_s = 0.5, light_ratio = 0.5}]'
    scenario = load_scenario("scenario-1", ["duration_s=1", fault])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session, "make_pump", noted(REAL, pumps))
        execute_in_memory(RunSpec(scenario, "twin", "rendered", "pid", "pid", 1, Path()))
    assert pumps == [None]


def test_an_eye_that_is_off_by_a_bit_is_seen():
    """With the last bit of one pose changed on one way alone the runs differ (negative control)."""

    class Off:
        def __init__(self, localiser):
            self._localiser = localiser

        def locate(self, *asked):
            seen = self._localiser.locate(*asked)
            if seen.pose is None:
                return seen
            return replace(seen, pose=replace(seen.pose, x_m=math.nextafter(seen.pose.x_m, 9.0)))

    case = ONE | {"camera": "rendered"}

    def make_pump(parts, *rest):
        return REAL(replace(parts, localiser=Off(parts.localiser)), *rest)

    changed = differences(run(case, make_pump, REAL_DRIVE), in_python(case))
    assert {"frames.x_m", "samples.est_x_m"} <= set(changed)


def test_the_comparison_sees_a_changed_constant():
    """With a microsecond more of camera latency on one way alone the runs differ (negative control)."""

    def make_pump(parts, watch, note, camera):
        latency_s = spec_of(ONE).scenario.camera.latency_s + 1e-6
        return REAL(replace(parts, camera_clock=CameraClock(latency_s)), watch, note, camera)

    changed = differences(run(ONE, make_pump, REAL_DRIVE), in_python(ONE))
    assert {"samples.est_x_m", "frames.t_exposure_s", "figures"} <= set(changed)


def test_the_comparison_sees_a_changed_law():
    """With a gain off by its last bit in the native ticks alone the runs differ (negative control)."""

    def make_drive(parts, *rest):
        scenario = spec_of(ONE).scenario
        gains = scenario.control.active_gains
        own = gains.asg_ism
        other = own.model_copy(update={"k1_s": math.nextafter(own.k1_s, math.inf)})
        d0_m, limits = scenario.robot.d0_m, scenario.control.limits
        law = make_outer_law("asg-ism", gains.model_copy(update={"asg_ism": other}), limits, d0_m)
        beneath = make_parts(spec_of(ONE), parts.rig, parts.recorder, law)
        changed = replace(parts, law=beneath.law)
        return REAL_DRIVE(changed, *rest)

    changed = differences(run(ONE, REAL, make_drive), in_python(ONE))
    # Set-points go out in 32 bits: the robot itself need not notice.
    assert {"samples.eta1_cmd_m_s", "samples.v1_m_s3"} <= set(changed)


@pytest.mark.parametrize(
    ("what", "more"),
    [
        ("axes of its own", ["control.axes_rad=0.3"]),
        ("a longer lead", ["control.limits.lead_s=0.1"]),
    ],
)
def test_a_law_asked_in_python_gives_the_same_run(what, more):
    """A law that is not translated, with names of its own in the record, is asked from native code."""
    scenario = load_scenario("scenario-1", ["duration_s=1.5", *more])
    spec = replace(spec_of(ONE), outer="asg-ism-implicit", scenario=scenario)
    drives = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(translated, "is_translated", lambda _: False)
        patch.setattr(session, "make_drive", noted(REAL_DRIVE, drives))
        native = execute_in_memory(spec)
        patch.setattr(session, "make_drive", lambda *_: None)
        by_hand = execute_in_memory(spec)
    assert drives[0] is not None, what
    assert not np.isnan(native.samples["slide_x_m_s3"]).all()
    assert differences(native, by_hand) == []


def test_a_replaced_function_is_called():
    """Whoever replaces a function of the laws gets all ticks in Python, where it is called."""
    drives, seen = [], []
    right = chain.clip
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session, "make_drive", noted(REAL_DRIVE, drives))
        patch.setattr(chain, "clip", lambda *values: seen.append(values) or right(*values))
        record = execute_in_memory(spec_of(ONE))
    assert drives == [None]
    assert len(seen) > record.manifest.tick_count > 30


def test_who_steps_a_session_sees_each_tick_of_the_same_run():
    """A caller that steps gets every situation; the run is that which nobody looks at."""
    spec = spec_of(ONE)
    parts = session_parts(spec)
    stepped = Session(
        spec.scenario, parts, board_parameters(spec.scenario, spec.inner), board_hashes
    )
    situations = list(stepped.steps())
    record = parts.recorder.close(stepped.ending.outcome, stepped.ending.detail)
    whole = in_native(ONE)
    assert len(situations) == whole.manifest.tick_count == 61
    for name, values in whole.samples.items():
        assert np.asarray(values).tobytes() == np.asarray(record.samples[name]).tobytes(), name


@pytest.mark.parametrize(
    ("what", "more"),
    [
        ("another estimator", ["control.estimator=observed-acceleration"]),
        ("a host that stops", ['faults=[{kind = "host_stopped", start_s = 1.0, end_s = 1.1}]']),
    ],
)
def test_what_native_code_cannot_do_is_left_to_python(what, more):
    """Where somebody asks for Python objects there is no native intake; the run goes on as ever."""
    spec = replace(spec_of(ONE), scenario=load_scenario("scenario-1", ["duration_s=1.5", *more]))
    made = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session, "make_pump", lambda *parts: made.append(REAL(*parts)) or made[-1])
        record = execute_in_memory(spec)
    assert made == [None], what
    assert record.manifest.tick_count > 30


def test_a_session_with_native_parts_is_forgotten_after_its_run():
    """Native parts keep no way back to their session: a campaign would keep every run."""
    spec = spec_of(ONE)
    parts = session_parts(spec)
    ran = Session(spec.scenario, parts, board_parameters(spec.scenario, spec.inner), board_hashes)
    assert ran.run().outcome == "complete"
    kept = [weakref.ref(ran), weakref.ref(parts.rig)]
    del ran, parts
    gc.collect()
    assert [ref() for ref in kept] == [None, None]


@given(
    st.floats(allow_nan=False, min_value=-1e6, max_value=1e6),
    st.floats(allow_nan=False, min_value=-1e6, max_value=1e6),
)
def test_native_hypot_is_that_of_the_interpreter(a, b):
    """To a unit in the last place, which is what interpreters differ by."""
    assert abs(core_native.hypot(a, b) - math.hypot(a, b)) <= math.ulp(math.hypot(a, b))
