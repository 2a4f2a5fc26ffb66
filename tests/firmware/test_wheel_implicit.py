"""The sliding sign solved at the end of a step, on the board: its fixed point, and what breaks it."""

from __future__ import annotations

import itertools
import math

import pytest

from hil.board import _firmware
from tests.firmware.bench import TICK_S, Motor
from tests.firmware.test_wheel_loop import drive, tail_error

# A plant that is exactly what the law assumes: omega' = duty / g + d, no friction, no delay.
G, K, MU = 0.0047, 0.3, 5.0
WHOLE = {
    "FF_GAIN": 0.0, "FF_DEAD": 0.0, "PWM_SLEW": 1000.0, "W_TAU": 0.0, "ISM_G": G,
    "HOLD_SP": 0.0,
}  # fmt: skip
IMPLICIT = WHOLE | {"LAW": 2.0, "IMP_STEP": TICK_S, "IMP_MU": MU, "IMP_SIGMA": 0.0, "IMP_K": K}
# The explicit sign of the same size, with the least layer that the board allows.
EXPLICIT = WHOLE | {
    "LAW": 0.0, "ISM_MU0": 1.0 / MU, "ISM_HOLD": 1.0 / MU, "ISM_SIGMA": 0.0, "ISM_EPS0": 0.0,
    "ISM_EPSMIN": 0.01, "ISM_GAM0": 0.0, "ISM_GAM1": 0.0, "ISM_GAM2": 0.0, "ISM_K0": 0.5 * K,
    "ISM_STEP": 60.0,
}  # fmt: skip
REACH = K * TICK_S / G  # rad/s of s that the bound takes away in a tick
KICKED = 50


def exact_run(changes, d_rad_s2=lambda _t_s: 0.0, kick_rad_s=0.0, ticks=200):
    """Run the law on the exact plant from e = -2, kicked once; return (s, term, duty) of each tick.

    s is worked out here from the speeds alone: e + mu (E + eta); the term is what the duty has beyond
    -g mu e, which is what keeps s where it is.
    """
    loop = _firmware.WheelLoop(changes)
    omega, integral, found = 0.0, 0.0, []
    for k in range(ticks):
        omega += kick_rad_s if k == KICKED else 0.0
        loop.step_at_speed(omega, 2.0)
        e = omega - 2.0
        s = e + MU * (integral + 2.0 / MU)  # eta = -e(0)/mu
        duty = loop.state.duty
        found.append((s, -duty - G * MU * e, duty))
        integral += TICK_S * e
        omega += TICK_S * (duty / G + d_rad_s2(k * TICK_S))
    return found


def test_the_surface_is_reached_in_as_many_ticks_as_the_bound_needs_and_kept():
    """From s = 1.5 rad/s in ceil(s g/(k h)) = 6 ticks, exactly; s = 0 is the fixed point from there on."""
    run = exact_run(IMPLICIT, kick_rad_s=1.5)
    ticks = math.ceil(1.5 / REACH)
    assert ticks == 6
    s = [found[0] for found in run]
    assert all(abs(value) < 1e-5 for value in s[:KICKED])
    for k in range(ticks):
        assert s[KICKED + k] == pytest.approx(1.5 - k * REACH, abs=1e-4)
    assert all(abs(value) < 1e-4 for value in s[KICKED + ticks :])


def test_the_term_solves_the_inclusion():
    """Each tick has u in -k Sgn(s + u h/g): of size k where that sum is not 0, and 0 of it else."""
    inside = outside = 0
    for s, term, _ in exact_run(IMPLICIT, lambda t: 30.0 * math.sin(20.0 * t), kick_rad_s=-2.0):
        end = s - term * TICK_S / G
        if abs(end) < 1e-4:
            assert abs(term) <= K + 1e-5
            inside += 1
        else:
            assert term == pytest.approx(math.copysign(K, end), abs=1e-4)
            outside += 1
    assert inside > 100
    assert outside >= 4


def test_a_disturbance_below_the_bound_is_met_a_tick_late_without_a_layer():
    """|s| = h |d| of the tick before, and the term is -g d of it: nothing is left that switches."""

    def push(t_s):
        return 40.0 * math.sin(6.0 * t_s)  # of k/g = 64 rad/s^2

    run = exact_run(IMPLICIT, push)
    for k in range(2, len(run)):
        s, term, _ = run[k]
        before = push((k - 1) * TICK_S)
        assert s == pytest.approx(TICK_S * before, abs=1e-4)
        assert term == pytest.approx(G * before, abs=1e-4)


def variation(run):
    return sum(abs(b[2] - a[2]) for a, b in itertools.pairwise(run[100:]))


def test_the_explicit_sign_switches_for_ever():
    """Negative control: at the same k and gain condition its duty swings by hundreds of times as much."""
    implicit, explicit = (exact_run(law, lambda _t: 20.0) for law in (IMPLICIT, EXPLICIT))
    assert variation(explicit) > max(5.0, 500.0 * variation(implicit))
    assert max(abs(s) for s, _, _ in explicit[100:]) > 0.1


def test_a_disturbance_above_the_bound_takes_s_away():
    """Negative control: 80 rad/s^2 against k/g = 64: s grows."""
    assert exact_run(IMPLICIT, lambda _t: 80.0)[-1][0] > 10.0 * TICK_S * 80.0


def test_a_longer_step_is_a_softer_law_with_the_same_bound():
    """The term is s g/step inside, k outside; a step below a tick is a tick."""
    for step_s, expected in ((0.004, 4), (0.02, 20)):
        run = exact_run(IMPLICIT | {"IMP_STEP": step_s}, kick_rad_s=0.2, ticks=KICKED + 1)
        assert run[-1][1] == pytest.approx(0.2 * G / (1e-3 * expected), rel=1e-3)
    assert abs(
        exact_run(IMPLICIT | {"IMP_STEP": 0.02}, kick_rad_s=9.0)[KICKED][1]
    ) == pytest.approx(K)


def test_psi_is_bounded_by_sigma():
    """0.01 rad/s too slow for 8 s: the average stops where mu average is sigma."""
    law = {"LAW": 2.0, "IMP_SIGMA": 0.3, "IMP_MU": 5.0, "IMP_STEP": 1.0, "IMP_K": 2.0, "ISM_G": 0.1}
    duties = []
    for sigma in (0.3, 0.0):
        loop = _firmware.WheelLoop(law | {"IMP_SIGMA": sigma})
        for _ in range(2000):
            loop.step_at_speed(1.99, 2.0)
        duties.append(loop.state.duty)
    # g kappa has mu sigma, the term g s/step has Psi = sigma
    assert duties[0] - duties[1] == pytest.approx(0.1 * (5.0 * 0.3 + 0.3), rel=1e-3)


def test_without_its_bound_and_gain_nothing_holds_the_wheel():
    """Negative control: k = 0 and g = 0 leave a loaded wheel to its load; with them it comes back."""
    errors = []
    for changes in ({}, {"IMP_K": 0.0, "ISM_G": 0.0}):
        loop, motor = _firmware.WheelLoop({"LAW": 2.0} | changes), Motor()
        motor.load = 0.1
        errors.append(tail_error(drive(loop, motor, 4.0, 3.0), 4.0, 2.0))
    assert errors[0] < 0.2
    assert errors[1] > 1.0


def test_a_step_starts_the_law_on_its_surface():
    """A set-point beyond ISM_STEP: the term is 0 in that tick; within it, it is bounded by k."""
    for setpoint, within in ((9.0, 0.0), (3.0, K)):
        loop = _firmware.WheelLoop(IMPLICIT | {"ISM_STEP": 5.0, "BUMP_TAU": 10.0})
        for _ in range(20):
            loop.step_at_speed(2.0, 2.0)
        loop.step_at_speed(2.0, setpoint)
        kappa = MU * (2.0 - setpoint)
        law = loop.state.feedback_duty - loop.state.bump_duty * (10.0 + TICK_S) / 10.0
        assert abs(-law - G * kappa) == pytest.approx(within, abs=2e-3)
