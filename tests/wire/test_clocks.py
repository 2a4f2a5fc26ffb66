"""Board time and camera time tied to host time, against clocks whose truth is known."""

import math
import random

import pytest

from hil.config.link import LinkConfig
from hil.core.clocks import BoardClock, CameraClock
from sim_twin.twin import HOST_START_S
from tests.twin.rigs import Drive

WRAP_US = 2**32


class Board:
    """A clock that starts at `start_us` and runs slow by `slow_ppm`."""

    def __init__(self, start_us: int, slow_ppm: float):
        self.start_us, self.rate = start_us, 1.0 - slow_ppm * 1e-6

    def stamp_us(self, t_host_s: float) -> int:
        return (self.start_us + int(t_host_s * self.rate * 1e6)) % WRAP_US


def exchanges(rng: random.Random, board: Board, jitter, count: int = 80, period_s: float = 0.25):
    """Yield (sent, received, board stamp, true host time of the stamp)."""
    for n in range(count):
        sent_s = n * period_s
        there_s, back_s = jitter(rng)
        at_board_s = sent_s + there_s
        yield sent_s, at_board_s + back_s, board.stamp_us(at_board_s), at_board_s


def even(rng):
    """Return delays of the twin's link: 20 ms and up to 10 ms more, both ways alike."""
    return 0.02 + 0.01 * rng.random(), 0.02 + 0.01 * rng.random()


def one_way(rng):
    """Return delays where only the way back waits, up to 20 ms."""
    return 0.02, 0.02 + 0.02 * rng.random()


def spiky(rng):
    """Return delays of a radio: one frame in ten is sent again, 0.1 to 0.3 s later."""
    return tuple(
        0.01 + rng.expovariate(500.0) + (rng.uniform(0.1, 0.3) if rng.random() < 0.1 else 0.0)
        for _ in range(2)
    )


@pytest.mark.parametrize(
    ("jitter", "limit_s"), [(even, 0.0025), (one_way, 0.0025), (spiky, 0.0025)]
)
def test_error_stays_within_the_reported_sigma(jitter, limit_s):
    """At 100 ppm the error after 20 s is that which `sigma_s` claims: z-scores of 100 trials."""
    scores, errors_s = [], []
    for seed in range(100):
        rng = random.Random(seed)
        board = Board(rng.randrange(WRAP_US), 100.0)
        clock = BoardClock()
        for sent_s, received_s, stamp_us, _ in exchanges(rng, board, jitter):
            clock.exchange(sent_s, received_s, stamp_us)
        now_s = 20.0
        error_s = clock.to_host_s(board.stamp_us(now_s)) - now_s
        assert abs(error_s) < clock.bound_s
        errors_s.append(abs(error_s))
        scores.append(error_s / clock.sigma_s)
    assert math.sqrt(sum(z * z for z in scores) / len(scores)) < 1.6
    assert max(abs(z) for z in scores) < 4.0
    assert sorted(errors_s)[95] < limit_s


def test_without_gate_and_asymmetry_the_error_is_worse():
    """Negative control: a plain fit through the same exchanges is off by several times as much."""
    gated_s, plain_s = [], []
    for seed in range(50):
        rng = random.Random(seed)
        board = Board(0, 100.0)
        clock = BoardClock()
        points = []
        for sent_s, received_s, stamp_us, _ in exchanges(rng, board, spiky):
            clock.exchange(sent_s, received_s, stamp_us)
            points.append((stamp_us * 1e-6, 0.5 * (sent_s + received_s)))
        points = points[-64:]
        mean_x = sum(x for x, _ in points) / 64
        mean_y = sum(y for _, y in points) / 64
        slope = sum((x - mean_x) * (y - mean_y) for x, y in points) / sum(
            (x - mean_x) ** 2 for x, _ in points
        )
        stamp_us = board.stamp_us(20.0)
        gated_s.append((clock.to_host_s(stamp_us) - 20.0) ** 2)
        plain_s.append((mean_y + slope * (stamp_us * 1e-6 - mean_x) - 20.0) ** 2)
    assert math.sqrt(sum(plain_s) / 50) > 5.0 * math.sqrt(sum(gated_s) / 50)


def test_drift_is_found():
    """A board 100 ppm slow shows as drift +1e-4 within 50 ppm after 20 s of a quiet link."""
    board, clock = Board(0, 100.0), BoardClock()
    for sent_s, received_s, stamp_us, _ in exchanges(
        random.Random(1), board, lambda rng: (0.01 + 0.001 * rng.random(), 0.01)
    ):
        clock.exchange(sent_s, received_s, stamp_us)
    assert clock.drift_ratio == pytest.approx(1e-4, abs=5e-5)


def test_the_counter_wraps_unseen():
    """Ten seconds before and ten after the wrap at 2^32 us the tie is the same line."""
    board, clock = Board(WRAP_US - 10_000_000, 0.0), BoardClock()
    for sent_s, received_s, stamp_us, _ in exchanges(
        random.Random(1), board, lambda _: (0.02, 0.02)
    ):
        clock.exchange(sent_s, received_s, stamp_us)
        before = clock.to_host_s(board.stamp_us(received_s - 0.5))
        after = clock.to_host_s(board.stamp_us(received_s))
        assert after == pytest.approx(received_s, abs=1e-4)
        assert after - before == pytest.approx(0.5, abs=1e-3)
    assert clock.restarts == 0


def test_a_reset_of_the_board_starts_a_new_tie():
    """A stamp outside its own exchange can only mean another clock: the old points are dropped."""
    rng, clock = random.Random(3), BoardClock()
    for sent_s, received_s, stamp_us, _ in exchanges(rng, Board(50_000_000, 0.0), even):
        clock.exchange(sent_s, received_s, stamp_us)
    assert clock.restarts == 0
    reset = Board(-30_000_000, 0.0)  # 0 at 30 s
    clock.exchange(31.0, 31.05, reset.stamp_us(31.025))
    assert clock.restarts == 1
    assert clock.to_host_s(reset.stamp_us(31.5)) == pytest.approx(31.5, abs=0.05)


def test_late_and_impossible_replies_are_refused():
    """A reply after more than the limit, or before its request, does not touch the tie."""
    clock = BoardClock(rtt_limit_s=0.5)
    assert clock.exchange(0.0, 0.04, 1_000_000)
    before_s = clock.to_host_s(2_000_000)
    assert not clock.exchange(1.0, 1.6, 9_000_000)
    assert not clock.exchange(1.0, 0.9, 9_000_000)
    assert clock.to_host_s(2_000_000) == before_s
    assert clock.refused == 2


def test_ties_repeat_bit_for_bit():
    """The same exchanges give the same host times: what a replay needs."""

    def run() -> list[float]:
        rng, clock, board = random.Random(5), BoardClock(), Board(0, 40.0)
        times = []
        for sent_s, received_s, stamp_us, _ in exchanges(rng, board, spiky):
            clock.exchange(sent_s, received_s, stamp_us)
            times.append(clock.to_host_s(stamp_us))
        return times

    assert run() == run()


def camera_errors_s(clock: CameraClock, rng: random.Random, frames: int) -> list[float]:
    """Run a camera 1,000 s ahead of the host, 60 ms + 10 ms jitter, some frames held up."""
    errors = []
    for n in range(frames):
        exposure_s = n / 30.0
        held_s = rng.uniform(0.1, 0.4) if rng.random() < 0.05 else 0.0
        clock.arrival(exposure_s + 1000.0, exposure_s + 0.06 + 0.01 * rng.random() + held_s)
        errors.append(clock.to_host_s(exposure_s + 1000.0) - exposure_s)
    return errors


def test_camera_stamps_become_exposure_times():
    """With the calibrated median of 65 ms, exposures are placed within 2 ms after one second."""
    for seed in range(20):
        clock = CameraClock(latency_s=0.065)
        errors_s = camera_errors_s(clock, random.Random(seed), 300)
        assert max(abs(e) for e in errors_s[30:]) < 2.5e-3
        assert abs(errors_s[-1]) < 4.0 * clock.sigma_s + 5e-4


def test_a_wrong_camera_latency_shows():
    """Negative control: 30 ms of uncalibrated latency shift every exposure by 30 ms."""
    errors_s = camera_errors_s(CameraClock(latency_s=0.035), random.Random(1), 300)
    assert errors_s[-1] == pytest.approx(0.030, abs=2.5e-3)


def test_the_camera_window_follows_a_drift():
    """At 200 ppm of relative drift a window of 301 frames lags by 5 s x 200 ppm = 1 ms, no more."""
    clock = CameraClock(latency_s=0.06)
    for n in range(3000):
        exposure_s = n / 30.0
        clock.arrival(exposure_s * (1 + 2e-4), exposure_s + 0.06)
    assert clock.to_host_s(exposure_s * (1 + 2e-4)) - exposure_s == pytest.approx(1e-3, abs=2e-4)


def stepped(clock: CameraClock, step_s: float, frames: int = 90) -> list[float]:
    """Run a camera whose clock steps after three seconds; return the errors of dated frames since."""
    rng, errors_s = random.Random(4), []
    for n in range(90 + frames):
        exposure_s = n / 30.0
        stamp_s = exposure_s + 1000.0 + (step_s if n >= 90 else 0.0)
        if clock.arrival(stamp_s, exposure_s + 0.06 + rng.gauss(0.0, 0.01)) and n >= 90:
            errors_s.append(clock.to_host_s(stamp_s) - exposure_s)
    return errors_s


@pytest.mark.parametrize("step_s", [0.1, 0.3, 1.0, 100.0, -0.1, -0.3, -1.0, -500.0])
def test_a_step_of_the_cameras_clock_starts_a_new_tie(step_s):
    """A handful of frames is refused, then they are dated right again; and the step is told."""
    clock = CameraClock(latency_s=0.06)
    errors_s = stepped(clock, step_s)
    assert len(errors_s) >= 90 - 5
    assert max(abs(e) for e in errors_s) < 0.03
    assert clock.restarts == 1
    assert clock.step_s == pytest.approx(step_s, abs=0.03)


def test_two_steps_are_two():
    """There and back again."""
    clock = CameraClock(latency_s=0.06)
    stepped(clock, 0.4)
    errors_s = stepped(clock, 0.4)  # back by 0.4 s (and 6 s) first
    assert clock.restarts == 3
    assert max(abs(e) for e in errors_s) < 0.03


@pytest.mark.parametrize("ahead_s", [0.2, 1.0, 10.0, 100.0, math.inf, math.nan])
def test_one_stamp_that_no_delay_explains_is_refused(ahead_s):
    """It is not dated, and it moves nothing."""
    clock = CameraClock(latency_s=0.06)
    camera_errors_s(clock, random.Random(2), 200)
    now_s = 200 / 30.0
    before_s = clock.to_host_s(1000.0)
    assert not clock.arrival(now_s + 1000.0 + ahead_s, now_s + 0.06)
    assert clock.to_host_s(1000.0) == before_s
    assert clock.arrival(now_s + 1000.0 + 1 / 30, now_s + 1 / 30 + 0.06)
    assert (clock.refused, clock.restarts) == (1, 0)


def test_old_stamps_among_new_ones_are_no_step():
    """Every third frame comes with a stamp of half a second ago: refused, each time."""
    clock = CameraClock(latency_s=0.06)
    taken = [
        clock.arrival(1000.0 + n / 30 - (0.5 if n % 3 == 2 else 0.0), n / 30 + 0.06)
        for n in range(300)
    ]
    assert clock.restarts == 0
    assert taken.count(False) == 100


def test_a_late_host_is_no_step():
    """Frames held up together for 0.4 s, in order, date as before: the camera's clock is right."""
    clock = CameraClock(latency_s=0.06)
    for n in range(300):
        exposure_s = n / 30.0
        held_until_s = 5.4 if 5.0 <= exposure_s < 5.4 else 0.0
        assert clock.arrival(1000.0 + exposure_s, max(exposure_s + 0.06, held_until_s))
        assert clock.to_host_s(1000.0 + exposure_s) == pytest.approx(exposure_s, abs=1e-9)
    assert clock.restarts == 0


def ties(link: LinkConfig, seeds: int) -> tuple[float, float, float]:
    """Return mean and rms error in s, and rms over `sigma_s`, of ties over the simulated link.

    The board sends its reports over it too: answers wait behind them.
    """
    errors_s, scores = [], []
    for seed in range(1, seeds + 1):
        drive = Drive(link=link, seed=seed)
        drive.arm()
        drive.twin.begin(drive.twin.now_s())
        drive.run(12.0, 6.0, 6.0)
        now_s = drive.twin.now_s()
        started_us = random.Random(f"{seed} kernel").randrange(2_000_000, 600_000_000)
        shown_us = started_us + int((now_s - HOST_START_S) * 1e6 * 1.0002)
        error_s = drive.link.clock.to_host_s(shown_us) - now_s
        errors_s.append(error_s)
        scores.append(error_s / drive.link.clock.sigma_s)

    def rms(values: list[float]) -> float:
        return math.sqrt(sum(v * v for v in values) / len(values))

    return sum(errors_s) / len(errors_s), rms(errors_s), rms(scores)


@pytest.mark.parametrize(
    ("link", "mean_s", "rms_s"),
    [
        (LinkConfig(), 1.5e-3, 2.0e-3),
        (LinkConfig(latency_jitter_s=0.0), 0.8e-3, 0.8e-3),
        (LinkConfig(latency_s=0.05, latency_jitter_s=0.03), 6e-3, 7e-3),
    ],
)
def test_the_tie_holds_beside_the_boards_own_traffic(link, mean_s, rms_s):
    """The error is that which `sigma_s` claims, also where the radio jitters."""
    mean, rms, score = ties(link, 8)
    assert abs(mean) < mean_s
    assert rms < rms_s
    assert score < 1.6
