"""The observed acceleration: a loop's disturbance found, section 8.9 with it, and what it is worth there."""

from __future__ import annotations

import math

import pytest

from hil.config.control import CircleReference
from hil.control.estimators.observed import LagObserver
from hil.control.laws.making import make_outer_law
from hil.study.ideal_circle import CIRCLE_GAINS, CIRCLE_LIMITS, CIRCLE_START, run_ideal
from tests.laws.support import D0_M

H_S, TAU_S = 0.02, 0.05


def drifted(rate_s, tau_s=TAU_S, push=0.8):
    """Return the observer's disturbance after 2 s."""
    loop, speed = LagObserver(tau_s, rate_s), 0.0
    loop.see(speed, 0.0, H_S)
    for k in range(100):
        command = 0.3 * math.sin(6.0 * k * H_S)
        target = command + TAU_S * push
        speed = target + math.exp(-H_S / TAU_S) * (speed - target)
        loop.see(speed, command, H_S)
    return loop.disturbance


def test_a_constant_disturbance_is_found_exactly():
    """With the loop's own lag d is found to 1e-6 whatever the command does, and to 1 % within 8/w."""
    assert drifted(15.0) == pytest.approx(0.8, abs=1e-6)


def test_a_wrong_lag_is_taken_for_a_disturbance():
    """Negative control: a lag believed twice as long leaves the command's swing in d."""
    assert abs(drifted(15.0, tau_s=0.1) - 0.8) > 0.1


def test_acceleration_follows_a_command_at_once():
    """A step of the command by 0.1 m/s is an acceleration of 2 m/s^2 in the same instant: no low-pass."""
    loop = LagObserver(TAU_S, 15.0)
    loop.see(0.0, 0.0, H_S)
    assert loop.rate(0.0, 0.1) == pytest.approx(0.1 / TAU_S)


def worst_mm(outer, observed_z3):
    """Return the worst of the last 10 s of section 8.9, mm."""
    law = make_outer_law(outer, CIRCLE_GAINS, CIRCLE_LIMITS, D0_M)
    run = run_ideal(law, CircleReference(), CIRCLE_START, step_s=4e-3, observed=observed_z3)
    return 1e3 * run.worst_m(10.0)


def test_an_observed_z3_brings_back_the_invariance_in_section_8_9():
    """ASG-ISM from 6.4 to 1.2 mm, state feedback from 26 to 24: what enters stage 3 is met by the first."""
    assert worst_mm("asg-ism", False) == pytest.approx(6.4, abs=0.1)
    assert worst_mm("asg-ism", True) == pytest.approx(1.2, abs=0.1)
    assert worst_mm("pid", False) == pytest.approx(26.4, abs=0.2)
    assert worst_mm("pid", True) == pytest.approx(24.0, abs=0.2)
