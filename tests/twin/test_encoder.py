"""Encoder pins: order, count and time of the edges, and what broken wires do to them."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from sim_twin import _native

TURN = 2 * math.pi
# Forward steps of the thesis's transition table (8.10.3), as (last << 2) | now.
FORWARD = {0b1101, 0b0100, 0b0010, 0b1011}
BACKWARD = {0b1110, 0b0111, 0b0001, 0b1000}


def decode(edges, ab=0b00):
    """Return counts and illegal steps by the thesis's table; the pins are both low at angle 0."""
    counts = illegal = 0
    for _, now in edges:
        step = (ab << 2) | now
        counts += (step in FORWARD) - (step in BACKWARD)
        illegal += step not in FORWARD | BACKWARD
        ab = now
    return counts, illegal


def turn(turns, steps=1000, **wires):
    """Turn an encoder of 1,920 counts evenly over one second in `steps` pieces."""
    encoder = _native.Encoder(1920)
    edges = []
    for step in range(steps):
        edges += encoder.move(
            TURN * turns * (step + 1) / steps, step * 1e6 / steps, 1e6 / steps, **wires
        )
    return edges


@pytest.mark.parametrize(("turns", "counts"), [(1, 1920), (-1, -1920), (0.5, 960)])
def test_a_turn_gives_its_counts_and_no_illegal_step(turns, counts):
    """Forward turns raise the count of the thesis's table, backward turns lower it."""
    assert decode(turn(turns)) == (counts, 0)


def test_edges_fall_at_the_instant_of_the_crossing():
    """At 1,920 counts/s the edges are 520.83 us apart, the first after half a count."""
    edges = turn(1)
    for k, (t_us, _) in enumerate(edges):
        assert t_us == pytest.approx((k + 0.5) * 1e6 / 1920, abs=1e-6)


def test_several_edges_in_one_step_come_in_order():
    """Three turns in one go: 5,760 edges, each later than the one before, one pin at a time."""
    edges = turn(3, steps=1)
    assert decode(edges) == (5760, 0)
    assert all(a[0] < b[0] for a, b in pairwise(edges))


def test_rocking_about_an_edge_counts_up_and_down():
    """Back and forth over one edge ends where it began."""
    encoder = _native.Encoder(1920)
    edges = []
    for k in range(20):
        edges += encoder.move(TURN / 1920 * (0.6 if k % 2 == 0 else 0.4), k * 100.0, 100.0)
    assert len(edges) == 20
    assert decode(edges) == (0, 0)


def test_swapped_phases_count_backward():
    """With A and B exchanged a forward turn lowers the count by as much."""
    assert decode(turn(1, swapped=True)) == (-1920, 0)


@pytest.mark.parametrize("channel", ["dead_a", "dead_b"])
def test_a_dead_channel_goes_nowhere(channel):
    """One channel alone steps up and down: half the edges, no counts beyond one."""
    edges = turn(1, **{channel: True})
    counts, illegal = decode(edges)
    assert len(edges) == 960
    assert abs(counts) <= 1
    assert illegal == 0


def test_a_dead_encoder_is_silent():
    """Both channels dead: no edge."""
    assert turn(1, dead_a=True, dead_b=True) == []
