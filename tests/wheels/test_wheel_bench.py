"""The wheel bench: figures by hand, limits, negative controls, and what tuning has bought."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from hil.board.wheel_laws import WHEEL_LAWS
from hil.cli.bench import command
from hil.config.events import Fault
from hil.core.errors import BadInput, RigFault
from hil.study import wheel_bench, wheel_tune
from hil.study.wheel_bench import BELIEVED, CASES, DEFAULT, Case, Trace, figures, run

TICK_S = 0.004
HELD_OUT = wheel_bench.held_out(1)
# Middle of the search, which is what stood there before it.
START = {name: middle for box in wheel_tune.SEARCH.values() for name, (_, middle, _) in box.items()}
OFF = {
    "asg-ism": {"ISM_K0": 0.0, "ISM_G": 0.0},
    "asg-ism-implicit": {"IMP_K": 0.0, "ISM_G": 0.0},
    "pid": {"PID_KP": 0.0, "PID_KI": 0.0, "PID_KD": 0.0},
}


def made_up(omega, setpoint, duty, case_s):
    """Return a trace of both wheels alike."""
    t_s = np.arange(0.0, case_s - 1e-9, TICK_S)
    columns = [np.column_stack([[f(t) for t in t_s]] * 2) for f in (setpoint, omega, duty)]
    return Trace(t_s, columns[0], columns[1], columns[2], energy_j=0.0, stopped=False)


def at_rest(_t_s):
    """Set-points of a case whose trace is made up."""
    return 0.0, 0.0


def test_figures_of_a_step_by_hand():
    """5 rad/s asked at 0.5 s: 6 from 1.0 s, 5.1 from 1.5 s to the end at 3 s."""

    def omega(t):
        return 0.0 if t < 1.0 else 6.0 if t < 1.5 else 5.1

    case = Case(at_rest, 3.0, 0.5)
    trace = made_up(omega, lambda t: 5.0 if t >= 0.5 else 0.0, lambda t: 0.2 * (t >= 1.0), 3.0)
    found = figures(case, trace)
    # 25 over 0.5 s, 1 over 0.5 s, 0.01 over 1.5 s
    assert found.rms_error_rad_s == pytest.approx(math.sqrt((12.5 + 0.5 + 0.015) / 3.0), rel=1e-3)
    assert found.peak_error_rad_s == pytest.approx(1.0)
    assert found.steady_error_rad_s == pytest.approx(0.1)
    assert found.chatter_duty_s == pytest.approx(0.2 / 3.0)
    # out of the band of 0.2 + 0.05 x 5 until the mean over 60 ms has come in after 1.5 s
    assert found.settling_s == pytest.approx(1.0, abs=0.04)


def test_a_wheel_that_never_comes_near_never_settles():
    """Half the set-point is reached: settling is infinite, the error stands."""
    case = Case(at_rest, 2.0, 0.5)
    found = figures(case, made_up(lambda _: 1.0, lambda _: 2.0, lambda _: 0.0, 2.0))
    assert math.isinf(found.settling_s)
    assert found.steady_error_rad_s == pytest.approx(1.0)


@pytest.mark.parametrize("law", WHEEL_LAWS)
@pytest.mark.parametrize("name", CASES)
def test_no_case_trips_the_board(name, law):
    """Every case ends armed, with finite figures, on the robot of the default scenarios."""
    case = CASES[name]
    trace = run(law, case, {})
    found = figures(case, trace)
    assert not trace.stopped
    assert math.isfinite(found.rms_error_rad_s)
    assert found.energy_j > 0.0


@pytest.mark.parametrize("law", WHEEL_LAWS)
def test_both_laws_hold_the_same_limits(law):
    """PWM_MAX and PWM_SLEW bind both laws alike: 0.5 of duty, 10 / 250 = 0.04 a tick."""
    trace = run(law, CASES["step"], {"PWM_MAX": 0.5, "PWM_SLEW": 10.0})
    assert np.max(np.abs(trace.duty)) <= 0.5 + 1e-9
    changes = np.abs(np.diff(trace.duty, axis=0))
    assert np.max(changes) == pytest.approx(0.04, abs=1e-9)


@pytest.mark.parametrize("law", WHEEL_LAWS)
def test_without_gain_the_bench_fails(law):
    """Negative control: feed-forward alone neither turns the robot nor holds a load."""
    for name in ("turn", "load step"):
        case = CASES[name]
        with_law = figures(case, run(law, case, {}))
        without = figures(case, run(law, case, OFF[law]))
        assert without.steady_error_rad_s > 5.0 * max(with_law.steady_error_rad_s, 0.05)
        assert math.isinf(without.settling_s)


@pytest.mark.parametrize("law", WHEEL_LAWS)
def test_a_wrong_sign_is_stopped_by_the_board(law):
    """Negative control: motor leads exchanged; the loop runs away and the board stops it."""
    reversed_leads = replace(CASES["step"], faults=(Fault(kind="motor_reversed"),))
    trace = run(law, reversed_leads, {})
    assert trace.stopped
    assert wheel_tune.case_cost(law, reversed_leads, {}, DEFAULT) == wheel_tune.COST_FAILED


@pytest.mark.parametrize("law", WHEEL_LAWS)
def test_tuned_beats_the_start_of_the_search_on_a_robot_it_has_not_seen(law):
    """Mean cost over all cases on a drawn robot that was no part of the search."""
    tuned = wheel_tune.bench_cost(law, {}, HELD_OUT)
    assert tuned < 0.9 * wheel_tune.bench_cost(law, START, HELD_OUT)


def test_the_printed_fading_weight_leaves_the_load_standing():
    """A load 1.5 s after the last step: where 1/(t + mu0) fades, twice the error stays at least."""
    case = CASES["load step"]
    held, printed = (
        figures(case, run("asg-ism", case, values)) for values in ({}, {"ISM_HOLD": 10_000.0})
    )
    assert printed.steady_error_rad_s > 2.0 * held.steady_error_rad_s


def test_one_robot_one_result():
    """The same seed gives the same trace bit for bit, another robot another one."""
    case = CASES["small step"]
    first, again, other = (run("pid", case, {}, seed).omega_rad_s for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_robots_are_drawn_from_the_mismatch():
    """The believed robot has the file's mass, the default 10 % more, a drawn one lies between."""
    assert wheel_bench.robot(BELIEVED).mass_kg == pytest.approx(2.8)
    assert wheel_bench.robot(DEFAULT).mass_kg == pytest.approx(2.8 * 1.1)
    drawn = [wheel_bench.robot(seed).mass_kg for seed in range(1, 20)]
    assert 2.8 * 0.9 < min(drawn) < 2.8 < max(drawn) < 2.8 * 1.1


def test_unknown_law_and_refused_parameters():
    """A law the board has not, and a parameter out of its range, are errors."""
    with pytest.raises(BadInput, match="lqr"):
        run("lqr", CASES["step"], {})
    with pytest.raises(RigFault, match="refuses to arm"):
        run("pid", CASES["step"], {"PID_KP": 50.0})


def test_the_search_gives_both_laws_the_same_budget(monkeypatch):
    """11 candidates each, rounded values inside their box, none worse than the start."""
    monkeypatch.setattr(wheel_tune, "CASES", {"crawl": replace(CASES["crawl"], duration_s=0.1)})
    plan = wheel_tune.Plan(robots=(DEFAULT,), candidates=11)
    found = wheel_tune.tune(plan, lambda *_: None)
    assert {stage.candidates for stage in found.values()} == {11}
    boxes = wheel_tune.SEARCH
    for name, stage in found.items():
        assert stage.cost <= stage.start_cost
        assert all(boxes[name][k][0] <= v <= boxes[name][k][2] for k, v in stage.values.items())
    judged = wheel_tune.judge({law: stage.values for law, stage in found.items()}, HELD_OUT * 2)
    told = wheel_tune.as_document(plan, found, judged, HELD_OUT * 2)
    json.dumps(told, allow_nan=False)
    assert "minus_pid" in told["judged"]["asg-ism"]
    assert "minus_pid" not in told["judged"]["pid"]


def test_what_was_found_is_judged_robot_by_robot():
    """By hand: 0.5, 0.6, 0.7 against 0.6, 0.6, 0.8, and against PID's 0.4, 0.5, 0.6 as found."""
    pid = wheel_tune.Judged((0.4, 0.5, 0.6), (0.5, 0.5, 0.5))
    own = wheel_tune.Judged((0.5, 0.6, 0.7), (0.6, 0.6, 0.8))
    assert own.gained.mean == pytest.approx(-0.2 / 3)
    against = own.minus(pid)
    assert against["found"].mean == pytest.approx(0.1)
    assert against["found"].certain
    assert against["defaults"].mean == pytest.approx(0.5 / 3)
    lines = wheel_tune.as_lines({"asg-ism": own, "pid": pid})
    assert lines[0].startswith(
        "asg-ism: 0.6000 as found, 0.6667 with the board's defaults, -0.0667"
    )
    assert "minus pid as found +0.1000 (+0.1000 to +0.1000)" in lines[0]
    assert "minus" not in lines[1]


def test_the_defaults_judged_against_themselves_gain_nothing(monkeypatch):
    """Negative control: the board's own values as found make a difference of exactly 0 on every robot."""
    monkeypatch.setattr(wheel_tune, "CASES", {"crawl": replace(CASES["crawl"], duration_s=0.3)})
    judged = wheel_tune.judge({"pid": {}}, wheel_bench.held_out(2))["pid"]
    assert judged.found == judged.defaults
    assert judged.found[0] != judged.found[1]
    assert judged.gained.mean == 0.0


def test_command_prints_the_table_as_json():
    """`hil bench wheels --json` is one document with every case and both laws."""
    result = CliRunner().invoke(command, ["wheels", "--runs", "1", "--json"])
    assert result.exit_code == 0, result.output
    cases = json.loads(result.output)["cases"]
    assert set(cases) == set(CASES)
    assert all(set(laws) == set(WHEEL_LAWS) for laws in cases.values())


def test_tune_is_refused_for_speed_figures():
    """`hil bench --tune` without wheels is bad usage."""
    assert CliRunner().invoke(command, ["--tune", "11"]).exit_code == 2
