"""Differentiator: convergence, quantisation chatter by discretisation, variable gain."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import pytest

from hil.board import _firmware
from tests.firmware.bench import COUNT_RAD, TICK_S, rms

Scheme = _firmware.Scheme
Signal = Callable[[float], tuple[float, float]]


def sine(t_s: float) -> tuple[float, float]:
    """1 rad at 0.5 Hz: |x_ddot| <= pi^2."""
    w = math.pi
    return math.sin(w * t_s), w * math.cos(w * t_s)


def errors_of_rate(
    differentiator: _firmware.SuperTwisting,
    signal: Signal,
    span_s: float,
    *,
    quantum: float = 0.0,
    dt_s: float = TICK_S,
) -> list[tuple[float, float]]:
    """Return (t, x2 - dx/dt) for a signal, measured in steps of `quantum` as an encoder does."""
    found = []
    for k in range(round(span_s / dt_s)):
        x, rate = signal(k * dt_s)
        seen = math.floor(x / quantum) * quantum if quantum else x
        found.append((k * dt_s, differentiator.step(seen, dt_s)[1] - rate))
    return found


@pytest.mark.parametrize("scheme", list(Scheme))
def test_converges_in_finite_time_on_a_known_derivative(scheme):
    """On sin(pi t) with L = 12 > pi^2 the rate error falls from pi to a few L dt for good."""
    differentiator = _firmware.SuperTwisting(12.0, scheme=scheme)
    errors = errors_of_rate(differentiator, sine, 6.0)
    settled = [abs(e) for t, e in errors if t > 2.0]
    assert abs(errors[0][1]) == pytest.approx(math.pi)
    assert max(settled) < 5 * 12.0 * TICK_S


@pytest.mark.parametrize("scheme", [Scheme.SEMI_IMPLICIT, Scheme.IMPLICIT])
def test_a_gain_below_the_acceleration_does_not_converge(scheme):
    """Negative control: L = 1 against |x_ddot| of pi^2 cannot follow."""
    errors = errors_of_rate(_firmware.SuperTwisting(1.0, scheme=scheme), sine, 6.0)
    assert max(abs(e) for t, e in errors if t > 2.0) > 0.5


def noise_at(speed_rad_s: float, scheme: Scheme, cell_counts: float) -> float:
    """Return the rms rate error at constant speed on a 1,920-count encoder."""
    differentiator = _firmware.SuperTwisting(200.0, scheme=scheme, cell=cell_counts * COUNT_RAD)
    errors = errors_of_rate(
        differentiator, lambda t: (speed_rad_s * t + 1e-4, speed_rad_s), 4.0, quantum=COUNT_RAD
    )
    return rms(e for t, e in errors if t > 1.0)


SPEEDS_RAD_S = (0.1, 0.5, 2.0, 5.0, 11.0)


@pytest.mark.parametrize("speed", SPEEDS_RAD_S)
def test_implicit_schemes_cut_the_chatter_of_encoder_steps(speed):
    """Measured: explicit Euler chatters 0.5 to 1 rad/s, backward Euler less, semi-implicit least."""
    explicit = noise_at(speed, Scheme.EXPLICIT, 0.0)
    implicit = noise_at(speed, Scheme.IMPLICIT, 0.0)
    semi = noise_at(speed, Scheme.SEMI_IMPLICIT, 0.0)
    assert implicit < 0.7 * explicit
    assert semi < 0.4 * explicit


def test_the_quantisation_cell_quietens_the_default_further():
    """Ignoring errors inside the encoder's cell takes off at least half of what noise was left."""
    plain = rms(noise_at(speed, Scheme.SEMI_IMPLICIT, 0.0) for speed in SPEEDS_RAD_S)
    with_cell = rms(noise_at(speed, Scheme.SEMI_IMPLICIT, 0.7) for speed in SPEEDS_RAD_S)
    assert with_cell < 0.5 * plain


def test_the_default_lags_no_more_than_the_alternatives():
    """The scheme chosen for quietness pays nothing in lag on a motor's run-up to 8 rad/s."""

    def run_up(t_s: float) -> tuple[float, float]:
        fall = math.exp(-t_s / 0.08)
        return 8.0 * (t_s - 0.08 * (1.0 - fall)), 8.0 * (1.0 - fall)

    def lag(scheme: Scheme, cell: float) -> float:
        st = _firmware.SuperTwisting(200.0, scheme=scheme, cell=cell * COUNT_RAD)
        return rms(e for _, e in errors_of_rate(st, run_up, 0.3, quantum=COUNT_RAD))

    chosen = lag(Scheme.SEMI_IMPLICIT, 0.7)
    assert chosen < lag(Scheme.EXPLICIT, 0.0)
    assert chosen < lag(Scheme.IMPLICIT, 0.0)


def test_the_board_defaults_are_the_scheme_that_measured_best():
    """params.def: semi-implicit with a cell a little wider than an ideal encoder's half count."""
    defaults = {entry.name: entry.default for entry in _firmware.parameter_table()}
    assert defaults["ST_SCHEME"] == Scheme.SEMI_IMPLICIT.value
    assert 0.5 <= defaults["ST_CELL"] <= 1.0


def test_a_long_drive_does_not_coarsen_the_speed():
    """After 10,000 turns forward (3 km) the speed is as quiet as at the start."""
    loop = _firmware.WheelLoop()
    start = 10_000 * 1920
    for counts in range(0, start, 400):
        loop.estimate(counts)
    for _ in range(4000):
        loop.estimate(start)
    per_tick = 5  # 4.09 rad/s
    speeds = [loop.estimate(start + per_tick * k) for k in range(400)]
    assert speeds[-1] == pytest.approx(per_tick * COUNT_RAD / TICK_S, rel=1e-3)


def test_the_encoder_counter_may_wrap():
    """int32 counts wrap from 2^31 - 1 to -2^31 without a jump in speed."""
    board = _firmware.Board()
    top = 2**31 - 1
    wrapped = [top - 600 + 6 * k for k in range(200)]
    board.tick(0, wrapped[0], 0)
    for k, counts in enumerate(wrapped[1:], 1):
        board.tick(4000 * k, (counts + 2**31) % 2**32 - 2**31, 0)
    assert board.wheel(0).omega_rad_s == pytest.approx(6 * COUNT_RAD / TICK_S, rel=1e-2)


def test_variable_gain_rises_under_acceleration_and_falls_in_quiet():
    """(3.15): L between l_min and l: low at constant speed, high while the speed changes fast."""
    st = _firmware.SuperTwisting(200.0, l_min=5.0, rho_1_s=30.0, alpha=0.6)
    position = itertools.accumulate([0.02] * 250)
    for x in position:
        st.step(x, TICK_S)
    quiet = st.l
    x = 5.0
    for k in range(50):
        x += 0.02 + 0.002 * k  # 125 rad/s^2
        st.step(x, TICK_S)
    assert quiet == pytest.approx(5.0)
    assert st.l > 50.0


def test_steps_of_any_length_and_a_first_call_without_length():
    """A camera drops frames: dt varies; the first call takes the value, dt 0 changes nothing."""
    st = _firmware.SuperTwisting(20.0)
    assert st.step(3.0, 0.0) == (3.0, 0.0)
    t_s = 0.0
    for dt_s in (0.033, 0.033, 0.066, 0.033, 0.1) * 12:
        t_s += dt_s
        st.step(3.0 + 0.5 * t_s, dt_s)
    assert st.step(99.0, 0.0)[1] == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("bad", [{"l": 0.0}, {"l": 1.0, "l1": -1.0}, {"l": 1.0, "cell": -1.0}])
def test_gains_that_make_no_sense_are_refused(bad):
    """A gain of 0 or below is an error, not a silent dead differentiator."""
    with pytest.raises(ValueError, match="must be above 0"):
        _firmware.SuperTwisting(**bad)
