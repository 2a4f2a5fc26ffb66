"""Chance in native code is Python's: link, camera timing and drawn poses to the bit, over drawn settings.

The models are written a second time here, with random.Random and the words of docs/twin.md.
"""

from __future__ import annotations

import math
from random import Random

from hypothesis import given, settings
from hypothesis import strategies as st

from hil.config.camera import CameraConfig, MarksConfig
from hil.config.link import LinkConfig
from hil.core.types import wrap_pi
from sim_twin.camera_timing import CLOCK_PPM, Shutter, _median_wait_s
from sim_twin.drawn_poses import DrawnPoses, LocaliserError
from sim_twin.link_model import Channel

SEEDS = st.integers(0, 10_000).map(lambda number: f"{number} link down")
RATIO = st.floats(0.0, 0.9)


class Carried:
    """A channel: jitter, order, Gilbert's chain, corrupted bytes."""

    def __init__(self, config, rng, cuts):
        self.config, self.rng, self.cuts = config, rng, cuts
        self.last_s, self.bad = -math.inf, False
        self.to_good = 1.0 / config.loss_burst_chunks
        self.to_bad = config.loss_ratio * self.to_good / (1.0 - config.loss_ratio)
        self.clean = self.clean_bytes() if config.corruption_ratio else 0

    def clean_bytes(self):
        ratio = self.config.corruption_ratio
        return int(math.log(1.0 - self.rng.random()) / math.log(1.0 - ratio))

    def carry(self, t_s, data):
        config, rng = self.config, self.rng
        if self.to_bad:
            self.bad = rng.random() < (1.0 - self.to_good if self.bad else self.to_bad)
            if self.bad:
                return None
        delay_s = config.latency_s + config.latency_jitter_s * (2.0 * rng.random() - 1.0)
        arrival_s = max(t_s + max(delay_s, 0.0), self.last_s)
        if any(t_s < end_s and arrival_s >= start_s for start_s, end_s in self.cuts):
            return None
        self.last_s = arrival_s
        out = bytearray(data)
        if config.corruption_ratio:
            at = self.clean
            while at < len(out):
                out[at] ^= rng.randrange(1, 256)
                at += 1 + self.clean_bytes()
            self.clean = at - len(out)
        return arrival_s, bytes(out)


@settings(deadline=None, max_examples=40)
@given(
    SEEDS,
    st.builds(
        LinkConfig,
        latency_s=st.floats(0.0, 0.1),
        latency_jitter_s=st.floats(0.0, 0.1),
        loss_ratio=RATIO.map(lambda r: r / 2),
        loss_burst_chunks=st.floats(1.0, 5.0),
        corruption_ratio=st.sampled_from([0.0, 1e-3, 0.05]),
    ),
)
def test_a_channel_carries_what_the_model_says(seed, config):
    """400 chunks of drawn sizes: every arrival time and byte; a cut in between."""
    cuts = [(2.0, 2.5)]
    native, model = Channel(config, Random(seed), cuts), Carried(config, Random(seed), cuts)
    sizes = Random(1)
    lost = 0
    for k in range(400):
        data = sizes.randbytes(sizes.randrange(1, 60))
        wanted = model.carry(0.01 * k, data)
        assert native.carry(0.01 * k, data) == wanted
        lost += wanted is None
    assert 0 < lost < 400


@settings(deadline=None, max_examples=30)
@given(
    SEEDS,
    st.builds(
        CameraConfig,
        rate_hz=st.floats(5.0, 120.0),
        exposure_s=st.just(0.003),
        latency_s=st.floats(0.01, 0.2),
        latency_jitter_s=st.floats(0.0, 0.05),
        drop_ratio=RATIO,
    ),
)
def test_a_shutter_draws_what_the_model_says(seed, camera):
    """200 exposures, a stall of half a second among them: every stamp to the bit."""
    stalls = [(1000.4, 1000.9)]
    shutter, rng = Shutter(camera, Random(seed), 1000.0), Random(seed)
    period_s = 1.0 / camera.rate_hz
    first_s = 1000.0 + period_s * rng.random()
    clock_s, latency_s = rng.uniform(10.0, 1000.0), camera.latency_s - _median_wait_s(camera)
    index, last_s = 0, -math.inf
    for _ in range(200):
        while True:
            if stalls[0][0] <= first_s + index * period_s < stalls[0][1]:
                index = math.ceil((stalls[0][1] - first_s) / period_s)
            start_s = first_s + index * period_s
            end_s = start_s + camera.exposure_s
            middle_s = 0.5 * (start_s + end_s)
            spread = min(max(rng.gauss(0.0, 1.0), -3.0), 3.0)
            arrival_s = max(middle_s + latency_s + camera.latency_jitter_s * spread, end_s, last_s)
            index += 1
            if rng.random() >= camera.drop_ratio:
                break
        last_s = arrival_s
        got = shutter.expose(stalls)
        stamp_s = clock_s + (middle_s - first_s) * (1.0 + 1e-6 * CLOCK_PPM)
        assert (got.index, got.start_s, got.end_s) == (index - 1, start_s, end_s)
        assert (got.t_cam_s, got.arrival_s) == (stamp_s, arrival_s)


def wave_of(rng):
    """Draw one wave over floor and heading, 10 to 50 mm long."""
    number, way = 2.0 * math.pi / rng.uniform(0.01, 0.05), rng.uniform(-math.pi, math.pi)
    turns, phase = rng.randint(-12, 12), rng.uniform(-math.pi, math.pi)
    return number * math.cos(way), number * math.sin(way), turns, phase


@settings(deadline=None, max_examples=30)
@given(
    SEEDS,
    st.builds(
        LocaliserError, sigma_xy_m=st.floats(0.0, 0.01), sigma_theta_rad=st.floats(0.0, 0.1),
        not_seen_ratio=st.floats(0.0, 0.3), place_ratio=st.floats(0.0, 1.0),
        outlier_ratio=st.floats(0.0, 0.3), outlier_xy_m=st.just(0.1), outlier_theta_rad=st.just(3.0),
        quality_ratio=st.just(0.9),
    ),
    st.booleans(),
)  # fmt: skip
def test_poses_are_drawn_as_the_model_says(seed, error, swapped):
    """100 poses all over the floor and the turns: which are seen, and where, to the bit."""
    camera = CameraConfig(marks=MarksConfig(swapped_marks=swapped))
    drawn, rng, places = DrawnPoses(error, camera, Random(seed)), Random(seed), Random(2)
    waves = [[wave_of(rng) for _ in range(12)] for _ in range(3)]
    shift_m = camera.marks.front.x_m + camera.marks.rear.x_m
    for _ in range(100):
        x_m, y_m, theta = places.uniform(-1, 1), places.uniform(-1, 1), places.uniform(-20, 20)
        got, draw = drawn.measure((x_m, y_m, theta)), rng.random()
        if draw < error.not_seen_ratio:
            assert got.pose is None
            continue
        outlier = draw > 1.0 - error.outlier_ratio
        off = []
        for three in waves:
            total = 0.0
            for a, b, n, c in three:
                total += math.sin(a * x_m + b * y_m + n * theta + c)
            stands = math.sqrt(error.place_ratio) * (total * math.sqrt(2.0 / 12))
            off.append(stands + math.sqrt(1.0 - error.place_ratio) * rng.gauss(0.0, 1.0))
        seen = (x_m, y_m, theta)
        if swapped:
            seen = (
                x_m + shift_m * math.cos(theta),
                y_m + shift_m * math.sin(theta),
                theta + math.pi,
            )
        xy_m = error.outlier_xy_m if outlier else error.sigma_xy_m
        turn = error.outlier_theta_rad if outlier else error.sigma_theta_rad
        wanted = (
            seen[0] + xy_m * off[0],
            seen[1] + xy_m * off[1],
            wrap_pi(seen[2] + turn * off[2]),
        )
        assert (got.pose.x_m, got.pose.y_m, got.pose.theta_rad) == wanted
