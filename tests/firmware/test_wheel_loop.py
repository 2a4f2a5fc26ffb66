"""Wheel laws: the properties control.md asks to test, limits, anti-windup, bumpless changes."""

from __future__ import annotations

import itertools
import math

import pytest

from hil.board import _firmware
from tests.firmware.bench import TICK_S, Motor, rms

ISM, PID, IMPLICIT = {"LAW": 0.0}, {"LAW": 1.0}, {"LAW": 2.0}
LAWS = [ISM, PID, IMPLICIT]
TOP = _firmware.PWM_TOP


def drive(loop, motor, setpoint, span_s):
    """Run the loop on the motor; return (time, loop's PWM, wheel speed, s, eps) per tick."""
    trace = []
    for k in range(round(span_s / TICK_S)):
        wanted = setpoint(k * TICK_S) if callable(setpoint) else setpoint
        pwm = loop.step(motor.counts, wanted)
        state = loop.state
        trace.append((k * TICK_S, pwm, motor.omega_rad_s, state.s, state.eps))
        motor.turn(pwm)
    return trace


def tail_error(trace, wanted, from_s):
    return rms(speed - wanted for t, _, speed, _, _ in trace if t >= from_s)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("wanted", [-11.0, -2.0, 0.5, 2.0, 8.0, 11.0])
def test_every_law_reaches_the_set_point(law, wanted):
    """From 24 mm/s to 0.53 m/s at the rim, either way, on a motor 10 % off the feed-forward."""
    trace = drive(_firmware.WheelLoop(law), Motor(gain=15.3), wanted, 3.0)
    assert tail_error(trace, wanted, 2.0) < 0.06 * abs(wanted) + 0.05


@pytest.mark.parametrize("law", LAWS)
def test_every_law_crawls(law):
    """0.1 rad/s (5 mm/s at the rim, 30 counts a second) within a tenth of that on average."""
    trace = drive(_firmware.WheelLoop(law), Motor(), 0.1, 6.0)
    travelled = sum(speed for t, _, speed, _, _ in trace if t >= 2.0) * TICK_S
    assert travelled == pytest.approx(0.4, abs=0.08)


def test_sliding_from_the_first_instant():
    """s(0) = 0 by eta = -mu0 e(0), whatever the error at arming."""
    for speed, wanted in ((0.0, 8.0), (5.0, -3.0), (-2.0, 0.5)):
        loop = _firmware.WheelLoop(ISM | {"ISM_MU0": 0.08})
        loop.step_at_speed(speed, wanted)
        assert loop.state.error_rad_s == pytest.approx(speed - wanted)
        assert loop.state.eta == pytest.approx(-0.08 * (speed - wanted), rel=1e-5)
        assert loop.state.s == pytest.approx(0.0, abs=1e-6)  # mu0 / mu0 rounds


# A plant that is exactly what the law assumes: omega' = (duty - d) / g, no friction, no delay.
G = 0.0047
EXACT = {
    "LAW": 0.0, "FF_GAIN": 0.0, "FF_DEAD": 0.0, "PWM_SLEW": 1000.0, "W_TAU": 0.0, "ISM_G": G,
    "ISM_GAM0": 30.0, "ISM_GAM1": 0.0, "ISM_GAM2": 0.0, "ISM_K0": 0.02, "ISM_MU0": 0.5,
    "ISM_EPS0": 0.0, "ISM_EPSMIN": 2.0, "ISM_SIGMA": 0.2, "ISM_HOLD": 10_000.0,
}  # fmt: skip


def exact_run(changes, disturbance_rad_s2, span_s=3.0):
    """Run the law on the exact plant from e(0) = -2; return the trace of (|s|, eps, k, e)."""
    loop = _firmware.WheelLoop(EXACT | changes)
    omega, found = 0.0, []
    for k in range(round(span_s / TICK_S)):
        pwm = loop.step_at_speed(omega, 2.0)
        state = loop.state
        found.append((abs(state.s), state.eps, state.gain, state.error_rad_s))
        push = disturbance_rad_s2 * math.copysign(1.0, math.sin(2.0 * k * TICK_S))
        omega += TICK_S * (pwm / TOP / G + push)
    return found


def test_s_stays_in_the_boundary_layer_when_the_gain_condition_holds():
    """Disturbance 25 rad/s^2 below gamma0 = 30: |s| <= eps along the whole run (4.17)."""
    assert all(s <= eps for s, eps, _, _ in exact_run({}, 25.0))


def test_s_leaves_the_layer_when_the_gain_condition_is_broken():
    """Negative control: the gain of a disturbance of 5 against one of 60 rad/s^2 does not hold s."""
    changes = {"ISM_GAM0": 5.0, "ISM_K0": 0.0}
    assert any(s > eps for s, eps, _, _ in exact_run(changes, 60.0))


def test_without_gain_a_disturbance_runs_free():
    """Negative control: g = 0 and k0 = 0 leave the wheel to the disturbance, with gain they do not."""
    free = exact_run({"ISM_G": 0.0, "ISM_K0": 0.0}, 25.0)
    held = exact_run({}, 25.0)
    assert all(gain == 0.0 for _, _, gain, _ in free)
    assert rms(e for _, _, _, e in free) > 5.0 * rms(e for _, _, _, e in held)


def test_a_wrong_sign_of_the_plant_diverges():
    """Negative control: motor leads swapped, the loop runs away to the PWM limit."""
    loop, motor = _firmware.WheelLoop(ISM), Motor()
    for _ in range(250):
        motor.turn(-loop.step(motor.counts, 2.0))
    assert motor.omega_rad_s < -6.0


def test_gain_follows_its_formula():
    """Gain k = 2 (g (F + |kappa| + |eps_dot|) + k0), every term by hand at the second tick."""
    mu0, sigma, eps0, h = 0.5, 0.2, 3.0, TICK_S
    loop = _firmware.WheelLoop(
        EXACT | {"ISM_EPS0": eps0, "ISM_EPSMIN": 0.01, "ISM_GAM1": 0.3, "ISM_GAM2": 0.7}
    )
    loop.step_at_speed(0.0, 2.0)  # e(0) = -2, eta = 1
    loop.step_at_speed(0.4, 2.0)  # t = h, E = -2 h: e = -1.6, sgn E = -1
    mu, e, integral = 1.0 / (mu0 + h), -1.6, -2.0 * h
    s = e + mu * (integral + 1.0)
    # docs/wheel-loop.md with Psi = 0 so far: kappa = mu e - mu^2 (E + eta) + mu (sigma sgn E - Psi)
    kappa = mu * e - mu**2 * (integral + 1.0) - mu * sigma
    eps = eps0 * mu**1.5
    bound = 30.0 + 0.3 * 2.0 + 0.7 * 0.4
    gain = 2.0 * (G * (bound + abs(kappa) + 1.5 * eps * mu) + 0.02)
    state = loop.state
    assert state.s == pytest.approx(s, rel=1e-4)
    assert state.eps == pytest.approx(eps, rel=1e-4)
    assert state.gain == pytest.approx(gain, rel=1e-4)
    assert state.duty == pytest.approx(-gain * s / (abs(s) + eps), rel=1e-4)


def test_the_boundary_layer_shrinks_to_its_floor():
    """eps(t) = eps0 / (t + mu0)^1.5 until eps_min, never below."""
    found = [eps for _, eps, _, _ in exact_run({"ISM_EPS0": 2.0, "ISM_EPSMIN": 0.4}, 0.0, 6.0)]
    assert found[0] == pytest.approx(2.0 / 0.5**1.5, rel=1e-4)
    assert all(later <= earlier for earlier, later in itertools.pairwise(found))
    assert found[-1] == pytest.approx(0.4)


def test_mu_stands_from_its_limit_on():
    """At ISM_HOLD = 0.5 s t + mu0 stops: s = e + 2 (E + eta) + Psi with |Psi| <= sigma."""
    changes = {"ISM_HOLD": 0.5, "ISM_MU0": 0.1, "ISM_SIGMA": 0.3, "ISM_STEP": 60.0}
    loop = _firmware.WheelLoop(ISM | changes)
    for _ in range(1000):  # 4 s below the set-point: E and the average only fall
        loop.step_at_speed(1.99, 2.0)
    state = loop.state
    before = (state.error_rad_s, state.integral, state.average)
    loop.step_at_speed(1.99, 2.0)
    assert state.t_mu0_s == pytest.approx(0.5, abs=1e-3 + TICK_S)
    assert state.average == pytest.approx(-0.3 * 0.5)
    mu = 1.0 / state.t_mu0_s
    expected = before[0] + mu * (before[1] + state.eta + before[2])
    assert state.s == pytest.approx(expected, rel=1e-4)


def test_only_steps_of_the_set_point_restart_t():
    """30 small changes within ISM_STEP let t run; one change beyond it restarts t with s = 0."""
    loop = _firmware.WheelLoop(ISM | {"ISM_STEP": 1.0, "ISM_MU0": 0.08, "ISM_HOLD": 10.0})
    for k in range(30):
        loop.step_at_speed(3.0, 3.0 + 0.03 * k)
    assert loop.state.t_mu0_s == pytest.approx(0.08 + 30 * TICK_S, rel=1e-5)
    loop.step_at_speed(3.0, 4.2)
    assert loop.state.s == pytest.approx(0.0, abs=1e-6)
    assert loop.state.t_mu0_s == pytest.approx(0.08 + TICK_S, rel=1e-5)


def test_a_step_keeps_what_the_feedback_had_learnt():
    """Under a load the feedback holds 0.1 of duty; over a step only the feed-forward jumps."""
    loop, motor = _firmware.WheelLoop(ISM | {"ISM_STEP": 1.0}), Motor()
    motor.load = 0.1
    drive(loop, motor, 4.0, 2.0)
    before = loop.state.feedback_duty
    loop.step(motor.counts, 6.0)
    assert before > 0.05
    assert loop.state.feedback_duty == pytest.approx(before, abs=1e-5)


@pytest.mark.parametrize(
    ("before", "after"),
    [(ISM, PID), (PID, ISM), (ISM, ISM | {"FF_GAIN": 0.03, "ISM_K0": 0.3}), (PID, PID | {"PID_KP": 1.0}),
     (ISM, ISM | {"ISM_FORM": 1.0}), (PID, IMPLICIT), (IMPLICIT, ISM),
     (IMPLICIT, IMPLICIT | {"IMP_MU": 20.0})],
)  # fmt: skip
def test_a_change_of_law_or_gains_is_bumpless(before, after):
    """The wanted duty at the tick of the change is that of the tick before, under load, in motion."""
    loop, motor = _firmware.WheelLoop(before), Motor()
    motor.load = 0.1
    drive(loop, motor, 5.0, 1.5)
    duty = loop.state.duty
    loop.retune(after)
    loop.step(motor.counts, 5.0)
    assert loop.state.duty == pytest.approx(duty, abs=1e-5)
    trace = drive(loop, motor, 5.0, 3.0)
    assert tail_error(trace, 5.0, 0.0) < 1.5


def test_without_the_transfer_offset_there_would_be_a_bump():
    """Negative control of the test above: a loop that starts anew at the same speed jumps."""
    loop, motor = _firmware.WheelLoop(ISM), Motor()
    motor.load = 0.1
    drive(loop, motor, 5.0, 1.5)
    fresh = _firmware.WheelLoop(PID)
    fresh.step_at_speed(motor.omega_rad_s, 5.0)
    assert abs(fresh.state.duty - loop.state.duty) > 0.04


@pytest.mark.parametrize("limit", [0.3, 1.0])
def test_all_laws_obey_the_same_limits(limit):
    """A step of 20 rad/s forward and back: PWM within PWM_MAX, its change within PWM_SLEW."""
    extremes = []
    for law in LAWS:
        loop = _firmware.WheelLoop(law | {"PWM_MAX": limit, "PWM_SLEW": 10.0})
        trace = drive(loop, Motor(), lambda t: 20.0 if t < 1.0 else -20.0, 2.0)
        pwm = [0, *(p for _, p, _, _, _ in trace)]
        assert max(abs(b - a) for a, b in itertools.pairwise(pwm)) == 16  # 10 / 250 * 400
        extremes.append((min(pwm), max(pwm)))
    assert extremes == [(-round(limit * TOP), round(limit * TOP))] * len(LAWS)


@pytest.mark.parametrize("law", LAWS)
def test_integrals_stop_while_the_output_is_saturated(law):
    """Asked for twice the top speed for 5 s, the integrals stay where saturation met them."""
    loop, motor = _firmware.WheelLoop(law), Motor()
    drive(loop, motor, 20.0, 0.5)
    state = loop.state
    held = (state.integral, state.average, state.pid_integral_rad)
    drive(loop, motor, 20.0, 4.5)
    assert (state.integral, state.average, state.pid_integral_rad) == held
    assert state.saturation == 1
    # what would have wound up: 4.5 s of an error of several rad/s
    assert 4.5 * abs(motor.omega_rad_s - 20.0) > 10.0 * max(abs(value) for value in held)


@pytest.mark.parametrize("law", LAWS)
def test_no_overshoot_after_saturation(law):
    """Back from an unreachable 20 to 5 rad/s the wheel settles within a second."""
    loop, motor = _firmware.WheelLoop(law), Motor()
    drive(loop, motor, 20.0, 4.0)
    trace = drive(loop, motor, 5.0, 2.0)
    assert tail_error(trace, 5.0, 1.0) < 0.35
    assert min(speed for _, _, speed, _, _ in trace) > 3.5


def test_zero_set_point_releases_the_bridge_and_a_pushed_wheel_is_braked():
    """At rest on zero: PWM 0 and holding; turned from outside the loop works against it."""
    loop = _firmware.WheelLoop(ISM)
    assert (loop.step_at_speed(0.0, 0.0), loop.state.holding) == (0, True)
    pushed = [loop.step_at_speed(2.0, 0.0) for _ in range(50)]
    assert not loop.state.holding
    assert pushed[-1] < 0


def test_the_filtered_error_rate_follows_a_ramp():
    """The error falls by 3 rad/s^2: after five filter times the telemetry says -3."""
    loop = _firmware.WheelLoop(ISM | {"ED_TAU": 0.03})
    for k in range(200):
        loop.step_at_speed(5.0 - 3.0 * k * TICK_S, 2.0)
    assert loop.state.error_rate_rad_s2 == pytest.approx(-3.0, rel=0.02)


def test_the_derivative_form_tracks_and_starts_on_its_surface():
    """(4.12): s(0) = 0 with s = e_dot + mu (e + eta) + Psi; the averaged gradient then takes e to 0."""
    gains = {"ISM_FORM": 1.0, "ISM_K0": 1.0, "ISM_EPSMIN": 10.0, "ISM_MU0": 0.3, "ISM_SIGMA": 12.0}
    loop, motor = _firmware.WheelLoop(ISM | gains), Motor()
    loop.step(motor.counts, 2.0)
    assert loop.state.s == pytest.approx(0.0, abs=1e-6)
    trace = drive(loop, motor, 2.0, 4.0)
    assert tail_error(trace, 2.0, 2.0) < 0.2


def test_unknown_or_impossible_parameters_are_refused():
    """The binding passes on the board's own checks."""
    with pytest.raises(KeyError, match="NO_SUCH"):
        _firmware.WheelLoop({"NO_SUCH": 1.0})
    with pytest.raises(ValueError, match="PWM_MAX"):
        _firmware.WheelLoop({"PWM_MAX": 1.5})


def test_kappa_has_no_falling_part_once_mu_stands():
    """With d mu/dt = 0 it is mu (e + sigma sgn E): k by hand; the falling form would give another."""
    changes = {"ISM_HOLD": 0.1, "ISM_MU0": 0.1, "ISM_STEP": 60.0, "ISM_EPS0": 0.0}
    loop = _firmware.WheelLoop(EXACT | changes)
    for _ in range(60):
        loop.step_at_speed(1.2, 2.0)  # e = -0.8 for 0.24 s: E and the average fall
    state = loop.state
    mu, e, sigma = 1.0 / state.t_mu0_s, -0.8, 0.2
    kappa = mu * (e - sigma)
    assert state.gain == pytest.approx(2.0 * (G * (30.0 + abs(kappa)) + 0.02), rel=1e-4)
    falling = mu * (2.0 * e - sigma - state.s)
    assert abs(abs(falling) - abs(kappa)) > 5.0  # rad/s^2: what it had been taken for


@pytest.mark.parametrize("eps_min", [0.05, 0.3, 0.681, 4.0])
def test_the_least_layer_is_what_it_is_set_to_where_mu_stands(eps_min):
    """Defaults of EPS0 and HOLD: mu stands at 1/0.044 s, the layer falls on to ISM_EPSMIN and no further."""
    loop = _firmware.WheelLoop(ISM | {"ISM_EPSMIN": eps_min, "ISM_STEP": 60.0})
    layers = []
    for _ in range(200):
        loop.step_at_speed(1.9, 2.0)
        layers.append(loop.state.eps)
    assert layers[-1] == pytest.approx(eps_min, rel=1e-5)
    assert all(layer >= eps_min * (1 - 1e-5) for layer in layers)


def test_the_turn_s_feed_forward_is_the_compensation_of_its_resistance():
    """(2.33): FF_TURN on the faster side, minus it on the other, in proportion below FF_TURN_W."""
    for faster, share in ((0.0, 0.0), (0.5, 0.25), (3.0, 1.0), (-0.5, -0.25), (-9.0, -1.0)):
        duties = []
        for turn in (0.0, 0.2):
            loop = _firmware.WheelLoop(PID | {"FF_TURN": turn, "FF_TURN_W": 2.0})
            loop.step_at_speed(2.0, 2.0, faster)  # no error: the duty is the feed-forward
            duties.append(loop.state.duty)
        assert duties[1] - duties[0] == pytest.approx(0.2 * share, abs=1e-6)


def test_without_it_what_the_other_side_is_asked_for_changes_nothing():
    """By default FF_TURN is 0: the same PWM to the count, whatever the other side's set-point."""
    runs = []
    for faster in (0.0, 4.0):
        loop, motor, pwm = _firmware.WheelLoop(ISM), Motor(), []
        for k in range(300):
            pwm.append(loop.step(motor.counts, 3.0 if k < 150 else 1.0, faster))
            motor.turn(pwm[-1])
        runs.append(pwm)
    assert runs[0] == runs[1]
