"""Differentiators and filters by what they promise."""

from __future__ import annotations

import math

import pytest

from hil.control import LowPass, SmoothCommand, SuperTwisting, VariableGain


@pytest.mark.parametrize("implicit", [False, True])
def test_super_twisting_finds_the_rate_in_finite_time(implicit):
    """|x''| <= 1 under a bound of 1: after 5 s the rate of sin t is right to a few steps' worth."""
    differ = SuperTwisting(bound=1.0, l1=3.0, l0=1.1, implicit=implicit)
    differ.reset(0.5, 0.0)
    h, worst = 1e-3, 0.0
    for k in range(15_000):
        rate = differ.step(math.sin(k * h), h)
        worst = max(worst, abs(rate - math.cos(k * h))) if k * h > 5.0 else worst
    assert worst < 0.01


def test_bound_below_the_signal_s_acceleration_loses_it():
    """The condition |x''| <= L of (6.15) is needed: with a tenth of it the rate is off."""
    differ = SuperTwisting(bound=0.1)
    h, worst = 1e-3, 0.0
    for k in range(15_000):
        rate = differ.step(math.sin(k * h), h)
        worst = max(worst, abs(rate - math.cos(k * h))) if k * h > 5.0 else worst
    assert worst > 0.2


def test_implicit_euler_rests_where_explicit_chatters():
    """On a signal that stands still the explicit form switches for ever, the implicit one is silent."""

    def chatter(implicit):
        differ = SuperTwisting(bound=50.0, implicit=implicit)
        differ.reset(0.003, 0.0)
        rates = [differ.step(0.0, 0.01) for _ in range(1000)]
        return max(map(abs, rates[500:]))

    assert chatter(True) < 1e-9
    assert chatter(False) > 0.1


def test_variable_gain_grows_while_the_error_keeps_its_sign():
    """(3.15): an error of one sign raises the gain to its bound, one that switches lowers it."""
    gain = VariableGain(low=0.5, high=8.0, rate=2.0, threshold=0.7, average_s=0.05)
    grown = [gain.step(1.0, 1e-3) for _ in range(3000)]
    fallen = [gain.step((-1.0) ** k, 1e-3) for k in range(3000)]
    assert grown[0] == pytest.approx(0.5, rel=0.01)
    assert grown[-1] == 8.0
    assert fallen[-1] == 0.5


def test_variable_gain_makes_a_differentiator_fit_its_signal():
    """Begun with a bound far too small, the gain of (3.15) finds one that follows."""
    differ = SuperTwisting(bound=0.05)
    gain = VariableGain(low=0.05, high=20.0, rate=3.0, threshold=0.6, average_s=0.1)
    h, worst = 1e-3, 0.0
    for k in range(20_000):
        rate = differ.step(math.sin(k * h), h)
        differ.set_bound(gain.step(differ.error, h))
        worst = max(worst, abs(rate - math.cos(k * h))) if k * h > 10.0 else worst
    assert worst < 0.15


def test_low_pass_follows_a_step_with_its_time_constant():
    """1 - 1/e after one time constant; its rate is its derivative."""
    low = LowPass(0.2)
    low.reset(0.0)
    h = 1e-4
    for _ in range(2000):
        before = low.value
        rate = low.step(1.0, h)
        assert low.value - before == pytest.approx(h * rate)
    assert low.value == pytest.approx(1.0 - math.exp(-1.0), abs=1e-3)


def test_smooth_command_is_critically_damped():
    """A step arrives without overshoot: 1 - (1 + w t) exp(-w t)."""
    smooth = SmoothCommand(10.0)
    smooth.reset(0.0)
    h, top = 1e-4, 0.0
    for k in range(10_000):
        t = k * h
        assert smooth.value == pytest.approx(1.0 - (1.0 + 10.0 * t) * math.exp(-10.0 * t), abs=2e-3)
        smooth.step(1.0, h)
        top = max(top, smooth.value)
    assert top <= 1.0 + 1e-9
