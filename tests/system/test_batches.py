"""A law of somebody's own that steps several runs at once: the runs are those its step makes one by one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hil.config.load import load_scenario, with_overrides
from hil.core.registries import OUTER_LAWS
from hil.runs import session
from hil.runs.execute import execute_in_memory
from hil.runs.together import execute_together
from tests.own.starts import law_text, written
from tests.system.test_native_intake import ONE, differences, spec_of

# Sines, cosines and hypotenuses of arrays may round otherwise than those of numbers; roots do not.
EXACT = {
    "math.cos(estimate.pose.theta_rad), math.sin(estimate.pose.theta_rad)": "HEADING",
    "np.cos(estimate.pose.theta_rad), np.sin(estimate.pose.theta_rad)": "HEADING",
    "math.hypot(wish_x, wish_y)": "math.sqrt(wish_x * wish_x + wish_y * wish_y)",
    "np.hypot(wish_x, wish_y)": "np.sqrt(wish_x * wish_x + wish_y * wish_y)",
    "HEADING": "turned(estimate.pose.theta_rad)",
}
TURNED = '''

def turned(theta):
    """Return cosine and sine of a heading, or of each of several."""
    if isinstance(theta, np.ndarray):
        return np.array([turned(one) for one in theta.tolist()]).T
    return math.cos(theta), math.sin(theta)
'''
NOTED = "        (x_m, y_m), (x_ref_m, y_ref_m) = estimate.z1_m, reference.z1_m\n        speed_s,"


def law_in(folder, name, *changes):
    """Return the name of the template's law, exact, with some changes."""
    text = law_text(name)
    for good, bad in (*EXACT.items(), *changes):
        assert good in text
        text = text.replace(good, bad)
    return OUTER_LAWS.get(str(written(folder / f"{name}.py", text + TURNED))).name


def specs_of(outer):
    """Return runs of several kinds under a law: to points and on circles, with a hold, one that faults."""
    cases = [
        ONE,
        ONE | {"seed": 4, "scenario": "circle"},
        ONE | {"seed": 5, "scenario": "stop-and-go", "loss": 0.05},
        ONE | {"seed": 6, "scenario": "circle", "fault": "link_cut"},
    ]
    specs = [replace(spec_of(case), outer=outer) for case in cases]
    held = load_scenario(
        "scenario-1", ["duration_s=3", "start={x_m=0.04, y_m=0.34, theta_rad=1.2}"]
    )
    gains = load_scenario("scenario-2", ["duration_s=1", *_gain(outer)])
    return [*specs, replace(specs[0], scenario=held), replace(specs[0], scenario=gains)]


def _gain(outer):
    return [f"control.gains.tuned.{outer.replace('-', '_')}.speed_s=0.7"]


def _counting(tmp_path, name, *more):
    """Return a law of the template that keeps in SIZES for how many runs it was asked at once."""
    note = "        SIZES.append(len(where))\n"
    begun = ("\nclass Gains", "\nSIZES = []\n\n\nclass Gains")
    return law_in(tmp_path, name, (NOTED, note + NOTED), begun, *more)


def test_runs_stepped_at_once_are_those_stepped_one_by_one(tmp_path: Path):
    """Ends, holds and gains of their own included; among others that know nothing of it."""
    outer = _counting(tmp_path, "exact-many")
    specs = [*specs_of(outer), spec_of(ONE | {"outer": "pid"}), spec_of(ONE | {"outer": "dob-pid"})]
    found = execute_together(specs)
    for spec, record in zip(specs, found, strict=True):
        assert differences(record, execute_in_memory(spec)) == []
    assert not np.isnan(found[0].samples["abeam_m_s"]).any()
    outcomes = [record.manifest.outcome for record in found]
    assert outcomes.count("complete") >= 6
    sizes = OUTER_LAWS.get(outer).factory.step.__globals__["SIZES"]
    assert max(sizes) == 6
    assert min(sizes) < 6


def test_runs_in_axes_of_their_own_are_stepped_at_once(tmp_path: Path):
    """As tuning and verdicts draw them: each as by itself in Python, the vectors of its trace too."""
    outer = _counting(
        tmp_path,
        "turned-many",
        ('"abeam_m_s": abeam}', '"abeam_m_s": abeam, "wish_x": wish_x, "wish_y": wish_y}'),
        ("trace={", 'trace={"wish_x": ("m/s", "wanted, X"), "wish_y": ("m/s", "wanted, Y"), '),
    )
    more = [[f"control.axes_rad={axes}"] for axes in (0.7, -2.0, 0.0, 1.3)]
    specs = [
        replace(spec, scenario=with_overrides(spec.scenario, one))
        for spec, one in zip(specs_of(outer), more, strict=False)
    ]
    found = execute_together(specs)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session, "make_drive", lambda *_: None)
        alone = [execute_in_memory(spec) for spec in specs]
    for record, by_hand in zip(found, alone, strict=True):
        assert differences(record, by_hand) == []
        assert not np.isnan(record.samples["wish_x"]).any()
    sizes = OUTER_LAWS.get(outer).factory.step.__globals__["SIZES"]
    assert max(sizes) == len(specs)
    straight = execute_in_memory(replace(specs[0], scenario=specs_of(outer)[0].scenario))
    near = np.max(np.abs(straight.samples["wish_x"] - found[0].samples["wish_x"]))
    assert near < 1e-3  # the same vector in the axes of the world, whatever the law's own are


def test_another_law_at_once_is_seen(tmp_path: Path):
    """A last bit that only `step_batch` has off makes other runs (negative control)."""
    off = "        turn = np.nextafter(turn, 9.0)\n        return hil.CommandBatch("
    outer = law_in(tmp_path, "off-by-a-bit", ("        return hil.CommandBatch(", off))
    spec = specs_of(outer)[1]
    (record,) = execute_together([spec])
    assert "samples.theta_dot_cmd_rad_s" in differences(record, execute_in_memory(spec))


def test_one_run_whose_command_may_not_be_sent_ends_alone(tmp_path: Path):
    """The run with the fastest gain gets NaN: it ends with a line that says so, the others go on."""
    bad = "        turn[speed_s == 0.7] = np.nan\n        return hil.CommandBatch("
    outer = law_in(tmp_path, "one-nan", ("        return hil.CommandBatch(", bad))
    found = execute_together(specs_of(outer))
    ended = found[-1].manifest
    assert ended.outcome == "fault"
    assert ended.outcome_detail.startswith("law one-nan (one-nan.py")
    assert ended.outcome_detail.endswith("step_batch returned theta_dot_rad_s = nan")
    assert [record.manifest.outcome for record in found[:3]] == ["complete"] * 3


@pytest.mark.parametrize(
    ("what", "bad", "said"),
    [
        ("raises", "        raise ValueError('no')\n", "step_batch raised ValueError: no"),
        ("short", "        return hil.CommandBatch(forward_m_s[:1][[0] * 9], turn)\n",
         "step_batch returned eta1_m_s = an array of shape (9,), 6 numbers are needed"),
        ("nothing", "        return None\n", "step_batch returned NoneType, a CommandBatch is needed"),
        ("complex", "        return hil.CommandBatch(forward_m_s + 1j, turn)\n",
         "step_batch returned eta1_m_s = an array of shape (6,), 6 numbers are needed"),
        ("text", "        return hil.CommandBatch(forward_m_s.astype(str), turn)\n",
         "step_batch returned eta1_m_s = an array of shape (6,), 6 numbers are needed"),
        ("places", "        where[:] = 0\n        return hil.CommandBatch(forward_m_s, turn)\n",
         "step_batch raised ValueError: assignment destination is read-only"),
    ],
)  # fmt: skip
def test_what_breaks_for_all_ends_all(what, bad, said, tmp_path: Path):
    """Each run ends as a fault that names law, file and what happened; runs of other laws do not notice."""
    good = '        return hil.CommandBatch(forward_m_s, turn, {"abeam_m_s": abeam})\n'
    outer = law_in(tmp_path, f"breaks-{what}", (good, bad))
    specs = specs_of(outer)
    found = execute_together([*specs, spec_of(ONE)])
    for record in found[:-1]:
        assert record.manifest.outcome == "fault"
        assert record.manifest.outcome_detail.endswith(said)
        assert "stopped" in [event.kind for event in record.events]
    assert found[-1].manifest.outcome == "complete"


@pytest.mark.parametrize("error", ["SystemExit(5)", "hil.BadInput('no')"])
def test_what_ends_more_than_a_run_ends_those_of_its_law(error, tmp_path: Path):
    """What the law raises is what each run of it gives, as alone; the run beside them is whole."""
    good = '        return hil.CommandBatch(forward_m_s, turn, {"abeam_m_s": abeam})\n'
    outer = law_in(tmp_path, f"ends-{error[:3].lower()}", (good, f"        raise {error}\n"))
    found = execute_together([*specs_of(outer)[:2], spec_of(ONE)])
    assert [type(record).__name__ for record in found[:2]] == ["RigFault"] * 2
    assert error.rpartition(".")[2].partition("(")[0] in str(found[0])
    assert differences(found[2], execute_in_memory(spec_of(ONE))) == []
