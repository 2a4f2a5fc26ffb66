"""Exposure-to-host latency from a light the host switches."""

import numpy as np
import pytest

from hil.core.errors import BadInput
from vision.calibration.latency import measure_latency, switching_times

RATE_HZ = 30.0


def watch(latency_s, exposure_s=0.01, jitter_s=0.0, noise_dn=1.0, seed=3):
    """Return switchings and what a camera at 30 Hz sees of them, by brute-force integration."""
    rng = np.random.default_rng(seed)
    edges = switching_times(1.0, 30, rng)
    middles = np.arange(0.5, edges[-1] + 1.0, 1.0 / RATE_HZ)
    inside = np.linspace(-0.5, 0.5, 101) * exposure_s
    on = np.searchsorted(edges, middles[:, None] + inside, side="right") % 2
    levels = 30.0 + 150.0 * on.mean(axis=1) + rng.normal(0.0, noise_dn, len(middles))
    arrivals = middles + latency_s + rng.normal(0.0, jitter_s, len(middles))
    return edges, arrivals, levels


@pytest.mark.parametrize("latency_s", [0.012, 0.060, 0.150])
def test_latency_is_found_to_a_few_milliseconds(latency_s):
    """With and without 5 ms of jitter, within 4 ms and the deviation claimed; the rate is 30 Hz."""
    for jitter_s in (0.0, 0.005):
        found = measure_latency(*watch(latency_s, jitter_s=jitter_s), exposure_s=0.01)
        assert found.latency_s == pytest.approx(latency_s, abs=max(0.004, 3 * found.sigma_s))
        assert found.sigma_s < 0.005
        assert found.rate_hz == pytest.approx(RATE_HZ, rel=0.03)
        assert found.correlation > 0.97


def test_a_light_that_is_not_seen_is_refused():
    """No contrast, a light that does not follow the switching, or too few switchings."""
    edges, arrivals, levels = watch(0.06)
    with pytest.raises(BadInput, match="changes by 0 DN"):
        measure_latency(edges, arrivals, np.full(len(levels), 80.0))
    with pytest.raises(BadInput, match="correlation"):
        measure_latency(edges, arrivals, np.random.default_rng(0).permutation(levels))
    with pytest.raises(BadInput, match="at least 6"):
        measure_latency(edges[:3], arrivals, levels)
