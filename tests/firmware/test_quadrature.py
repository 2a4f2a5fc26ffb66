"""Quadrature decoding against the thesis's transition table and a turning shaft."""

from __future__ import annotations

import pytest

from hil.board import _firmware

# Thesis section 8.10.3: last << 2 | now, with AB = MSB LSB.
UP = (0b1101, 0b0100, 0b0010, 0b1011)
DOWN = (0b1110, 0b0111, 0b0001, 0b1000)
STILL = (0b0000, 0b0101, 0b1010, 0b1111)
FORWARD = (0b00, 0b10, 0b11, 0b01)  # the order the table counts up in


def decoded(first: int, *pins: int) -> tuple[int, int]:
    decoder = _firmware.Quadrature(first)
    for ab in pins:
        decoder.update(ab)
    return decoder.counts, decoder.illegal


@pytest.mark.parametrize("transition", range(16))
def test_every_transition_counts_as_the_thesis_prints_it(transition):
    """Up, down, still, and otherwise (both phases at once) nothing but a fault."""
    counts = 1 if transition in UP else -1 if transition in DOWN else 0
    illegal = transition not in UP + DOWN + STILL
    assert decoded(transition >> 2, transition & 3) == (counts, illegal)


def test_one_turn_of_480_lines_gives_1920_counts():
    """x4: four counts a line, and back again to zero."""
    there = list(FORWARD[1:] + FORWARD[:1]) * 480
    back = [*reversed(there[:-1]), 0b00]
    assert decoded(0b00, *there) == (1920, 0)
    assert decoded(0b00, *there, *back) == (0, 0)


def test_swapped_phases_count_backwards():
    """A and B exchanged: the same turn counts down."""
    swapped = [(ab & 1) << 1 | ab >> 1 for ab in FORWARD[1:] + FORWARD[:1]] * 10
    assert decoded(0b00, *swapped) == (-40, 0)


def test_a_missed_edge_is_a_fault_and_decoding_goes_on():
    """00 -> 11 skips an edge: direction unknown, so two counts are missing and one fault noted."""
    assert decoded(0b00, 0b11, 0b01, 0b00) == (2, 1)


def test_bits_beyond_the_two_phases_are_ignored():
    """A port read without masking decodes the same."""
    assert decoded(0b00, 0b1010_1110 & 0xFE | 0b10) == (1, 0)
