"""Serial pace, delay, loss, corruption and cuts of the link."""

from __future__ import annotations

import statistics
from itertools import groupby
from random import Random

import pytest
from pydantic import ValidationError

from hil.config.link import LinkConfig
from sim_twin.link_model import Channel, Serialiser

CHUNKS = 20_000


def channel(cuts=(), seed=1, **fields):
    return Channel(LinkConfig(**fields), Random(seed), cuts)


def test_a_byte_takes_ten_bits():
    """57,600 bit/s pass 5,760 bytes a second, one chunk after the other."""
    line = Serialiser(57_600)
    assert line.send(1.0, 5760) == pytest.approx(2.0)
    assert line.send(1.5, 576) == pytest.approx(2.1)  # waits for the first
    assert line.send(5.0, 576) == pytest.approx(5.1)  # line was free


def test_delay_is_latency_give_or_take_the_jitter():
    """Far apart chunks: mean 20 ms, all within 10 ms of it, deviation 10 ms / sqrt(3)."""
    way = channel(latency_s=0.020, latency_jitter_s=0.010)
    delays = [way.carry(float(k), b"x")[0] - k for k in range(CHUNKS)]
    assert statistics.mean(delays) == pytest.approx(0.020, abs=2e-4)
    assert statistics.stdev(delays) == pytest.approx(0.010 / 3**0.5, rel=0.03)
    assert min(delays) >= 0.010 - 1e-9
    assert max(delays) <= 0.030 + 1e-9


def test_chunks_never_overtake_nor_arrive_before_they_left():
    """With more jitter than latency and chunks 1 ms apart, order and causality hold."""
    way = channel(latency_s=0.005, latency_jitter_s=0.050)
    arrivals = [way.carry(0.001 * k, b"x")[0] for k in range(2000)]
    assert arrivals == sorted(arrivals)
    assert all(arrival >= 0.001 * k for k, arrival in enumerate(arrivals))


@pytest.mark.parametrize(("loss", "burst"), [(0.1, 1.5), (0.1, 4.0), (0.4, 3.0)])
def test_loss_ratio_and_burst_length(loss, burst):
    """Share lost and mean run of lost chunks are those asked for (Gilbert), within 10 %."""
    way = channel(loss_ratio=loss, loss_burst_chunks=burst)
    lost = [way.carry(float(k), b"x") is None for k in range(5 * CHUNKS)]
    runs = [len(list(run)) for is_lost, run in groupby(lost) if is_lost]
    assert statistics.mean(lost) == pytest.approx(loss, rel=0.1)
    assert statistics.mean(runs) == pytest.approx(burst, rel=0.1)


def test_corruption_changes_the_asked_share_of_bytes():
    """1 % of the bytes differ, and every chunk keeps its length."""
    way = channel(corruption_ratio=0.01)
    sent = bytes(range(50))
    wrong = 0
    for k in range(2000):
        got = way.carry(float(k), sent)[1]
        assert len(got) == len(sent)
        wrong += sum(a != b for a, b in zip(got, sent, strict=True))
    assert wrong / (2000 * 50) == pytest.approx(0.01, rel=0.1)


def test_a_clean_link_delivers_every_byte_as_it_was():
    """The default link loses and changes nothing."""
    way = channel()
    assert all(way.carry(float(k), b"abc")[1] == b"abc" for k in range(1000))


def test_nothing_passes_while_the_link_is_cut():
    """Lost: what is sent during the cut, and what is on its way when it begins; then all is well."""
    way = channel(cuts=[(1.0, 2.0)], latency_s=0.020, latency_jitter_s=0.0)
    assert way.carry(0.97, b"x") is not None
    assert way.carry(0.99, b"x") is None
    assert way.carry(1.5, b"x") is None
    assert way.carry(2.0, b"x") == (2.02, b"x")


def test_equal_seeds_repeat_and_other_seeds_differ():
    """The same seed gives the same arrivals bit for bit."""

    def arrivals(seed):
        way = channel(seed=seed, loss_ratio=0.2, corruption_ratio=0.01)
        return [way.carry(0.02 * k, bytes(40)) for k in range(500)]

    assert arrivals(1) == arrivals(1)
    assert arrivals(1) != arrivals(2)


def test_bursts_too_short_for_the_loss_are_refused():
    """Between bursts one chunk passes at least: 90 % loss needs bursts of 9."""
    with pytest.raises(ValidationError, match="at least 9"):
        LinkConfig(loss_ratio=0.9, loss_burst_chunks=1.5)
    LinkConfig(loss_ratio=0.9, loss_burst_chunks=10)
