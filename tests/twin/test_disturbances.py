"""Shapes of disturbances over time and place."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hil.config.events import Disturbance, Zone
from sim_twin import _native
from sim_twin.setup import shape_arguments


def value(t_s, x_m=0.0, y_m=0.0, noise_seed=0, **fields):
    item = Disturbance(target="eta1_dot_m_s2", **fields)
    return _native.disturbance_value(*shape_arguments(item, noise_seed), t_s, x_m, y_m)


def test_step_lasts_from_start_to_end():
    """A step is its amplitude from start_s on and nothing from end_s on."""
    fields = {"shape": "step", "amplitude": 2.0, "start_s": 1.0, "end_s": 3.0}
    times = (0.999, 1.0, 2.0, 2.999, 3.0)
    assert [value(t, **fields) for t in times] == [0.0, 2.0, 2.0, 2.0, 0.0]


def test_sine_starts_at_its_phase():
    """It is amplitude sin(2 pi f (t - start) + phase): 0.1 sin 3t of section 8.9 at t = 0.5 s."""
    got = value(0.5, shape="sine", amplitude=0.1, frequency_hz=3 / (2 * math.pi))
    assert got == pytest.approx(0.1 * math.sin(1.5))
    late = value(2.0, shape="sine", amplitude=1.0, start_s=2.0, phase_rad=math.pi / 2)
    assert late == pytest.approx(1.0)


def test_pulse_is_half_a_sine():
    """A pulse of 2 N over 1 s has its 2 N in the middle and 2 N / sqrt(2) a quarter in."""
    fields = {"shape": "pulse", "amplitude": 2.0, "start_s": 4.0, "end_s": 5.0}
    assert value(4.5, **fields) == pytest.approx(2.0)
    assert value(4.25, **fields) == pytest.approx(math.sqrt(2.0))
    assert value(4.0, **fields) == 0.0


def series(seed=1, noise_seed=0, frequency_hz=5.0):
    t = np.arange(0.0, 200.0, 0.005)
    fields = {"shape": "noise", "amplitude": 0.5, "frequency_hz": frequency_hz, "seed": seed}
    return np.array([value(x, noise_seed=noise_seed, **fields) for x in t])


def test_noise_has_its_deviation_and_its_band():
    """Standard deviation 0.5 within 5 %, mean 0, and 98 % of the power below twice the band."""
    noise = series()
    assert noise.std() == pytest.approx(0.5, rel=0.05)
    assert abs(noise.mean()) < 0.05
    power = np.abs(np.fft.rfft(noise)) ** 2
    frequency_hz = np.fft.rfftfreq(noise.size, 0.005)
    assert power[frequency_hz < 10.0].sum() / power.sum() > 0.98
    assert power[frequency_hz < 5.0].sum() / power.sum() > 0.8


def test_noise_depends_on_both_seeds_and_on_nothing_else():
    """Equal seeds repeat bit for bit; another seed of disturbance or run is uncorrelated."""
    base = series()
    assert np.array_equal(base, series())
    for other in (series(seed=2), series(noise_seed=1 << 32)):
        assert abs(np.corrcoef(base, other)[0, 1]) < 0.1


def test_noises_without_a_seed_are_independent():
    """Two of one list differ, from each other and from every seeded one; one given seed is one signal."""
    t = np.arange(0.0, 100.0, 0.01)

    def drawn(place, seed=None, target="force_forward_n"):
        item = Disturbance(target=target, shape="noise", amplitude=1.0, frequency_hz=5.0, seed=seed)
        arguments = shape_arguments(item, 7 << 32, place)
        return np.array([_native.disturbance_value(*arguments, x, 0.0, 0.0) for x in t])

    first, second = drawn(0), drawn(1, target="torque_yaw_n_m")
    for other in (second, drawn(0, seed=0), drawn(0, seed=1)):
        assert abs(np.corrcoef(first, other)[0, 1]) < 0.15
    assert np.array_equal(drawn(0, seed=1), drawn(1, seed=1))
    assert np.array_equal(first, drawn(0))


def test_zone_limits_a_disturbance_to_a_place():
    """Full inside, half on the edge, nothing (0.3 %) 5 cm outside."""
    fields = {
        "shape": "step", "amplitude": 1.0, "zone": Zone(x_m=1.0, y_m=0.0, radius_m=0.3)
    }  # fmt: skip
    assert value(0.0, 1.0, 0.0, **fields) > 0.999
    assert value(0.0, 1.3, 0.0, **fields) == pytest.approx(0.5)
    assert value(0.0, 1.6, 0.0, **fields) < 0.003
