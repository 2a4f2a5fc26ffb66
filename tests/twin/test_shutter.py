"""Camera timing: period, exposure, delay, order, drops, stalls, the camera's own clock."""

from __future__ import annotations

import math
import statistics
from random import Random

import pytest

from hil.config.camera import CameraConfig
from sim_twin.camera_timing import CLOCK_PPM, Shutter


def frames(count, stalls=(), seed=1, **fields):
    shutter = Shutter(CameraConfig(**fields), Random(seed), 1000.0)
    return [shutter.expose(stalls) for _ in range(count)]


def test_exposures_are_a_period_apart():
    """30 Hz, 6 ms: starts 33.33 ms apart, the first within a period of the begin."""
    got = frames(300, drop_ratio=0.0)
    assert 1000.0 <= got[0].start_s < 1000.0 + 1 / 30
    for k, frame in enumerate(got):
        assert frame.index == k
        assert frame.start_s == pytest.approx(got[0].start_s + k / 30, abs=1e-9)
        assert frame.end_s - frame.start_s == pytest.approx(0.006, abs=1e-9)


def test_delay_from_mid_exposure_has_its_mean_and_deviation():
    """60 ms with a deviation of 10 ms, clipped at three deviations; frames far apart."""
    got = frames(5000, drop_ratio=0.0, rate_hz=1.0)
    delays = [frame.arrival_s - 0.5 * (frame.start_s + frame.end_s) for frame in got]
    assert statistics.mean(delays) == pytest.approx(0.060, abs=5e-4)
    assert statistics.stdev(delays) == pytest.approx(0.010, rel=0.05)
    assert min(delays) >= 0.030 - 1e-9
    assert max(delays) <= 0.090 + 1e-9


@pytest.mark.parametrize(
    ("latency_s", "jitter_s", "drop_ratio", "rate_hz"),
    [
        (0.1, 0.03, 0.1, 30.0),
        (0.1, 0.05, 0.01, 30.0),
        (0.2, 0.05, 0.3, 60.0),
        (0.06, 0.01, 0.0, 60.0),
    ],
)
def test_the_median_delay_is_the_one_configured(latency_s, jitter_s, drop_ratio, rate_hz):
    """Also where jitter makes frames wait for each other: 104.4 ms came of 100 +- 30 before."""
    fields = {"latency_s": latency_s, "latency_jitter_s": jitter_s, "drop_ratio": drop_ratio}
    got = frames(20_000, rate_hz=rate_hz, exposure_s=0.003, **fields)
    delays = [frame.arrival_s - 0.5 * (frame.start_s + frame.end_s) for frame in got]
    assert statistics.median(delays) == pytest.approx(latency_s, abs=0.03 * jitter_s)


def test_frames_keep_their_order_and_follow_their_exposure():
    """Jitter far above the period neither swaps frames nor delivers one before its end."""
    got = frames(2000, rate_hz=200.0, exposure_s=0.004, latency_s=0.01, latency_jitter_s=0.05)
    arrivals = [frame.arrival_s for frame in got]
    assert arrivals == sorted(arrivals)
    assert all(frame.arrival_s >= frame.end_s for frame in got)


def test_dropped_frames_leave_gaps_in_the_index():
    """A tenth of the frames lost: 9 of 10 indices come."""
    got = frames(5000, drop_ratio=0.1)
    assert 5000 / (got[-1].index + 1) == pytest.approx(0.9, abs=0.01)


def test_a_stall_leaves_no_frame_exposed_in_it():
    """Nothing between the stall's begin and end; frames keep their grid after it."""
    stall = (1001.0, 1003.0)
    got = frames(100, stalls=[stall], drop_ratio=0.0)
    assert not any(stall[0] <= frame.start_s < stall[1] for frame in got)
    grid = [(frame.start_s - got[0].start_s) * 30 for frame in got]
    assert all(abs(place - round(place)) < 1e-6 for place in grid)
    assert any(frame.start_s >= stall[1] for frame in got)


def test_a_camera_stalled_for_good_gives_no_frame():
    """An endless stall ends the frames instead of the search for one."""
    assert frames(2, stalls=[(0.0, math.inf)]) == [None, None]
    assert frames(1, drop_ratio=1.0) == [None]


def test_stamps_are_mid_exposure_on_the_cameras_own_clock():
    """The stamp runs CLOCK_PPM fast against host time and starts somewhere else."""
    got = frames(3000, drop_ratio=0.0)
    host = 0.5 * (got[-1].start_s + got[-1].end_s) - 0.5 * (got[0].start_s + got[0].end_s)
    assert (got[-1].t_cam_s - got[0].t_cam_s) / host - 1 == pytest.approx(
        CLOCK_PPM * 1e-6, rel=1e-3
    )
    assert abs(got[0].t_cam_s - got[0].start_s) > 1.0
