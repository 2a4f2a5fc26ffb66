"""Serial line and radio between host and board: pace, delay, loss, corruption, cuts.

Two parts, so that a simulated UART, whose pace is real already, can do without the first:
`Serialiser` gives bytes their time on a line, `Channel` is what lies behind the line.
Times are s of one clock, passed in; chance is a `random.Random`, passed in: the native part
(native/link.hpp) goes on from its state.
"""

from __future__ import annotations

from collections.abc import Sequence
from random import Random
from typing import TYPE_CHECKING

from sim_twin import _native

if TYPE_CHECKING:
    from hil.config.link import LinkConfig

BITS_PER_BYTE = 10  # start, eight data, stop

Cut = tuple[float, float]


class Serialiser(_native.Serialiser):
    """A UART or serial port that sends one byte after the other at its baud rate."""

    def __init__(self, baud: int) -> None:
        super().__init__(BITS_PER_BYTE / baud)


class Channel(_native.Channel):
    """One direction of the link behind the serial port; chunks arrive in the order they left.

    Loss is a two-state chain (Gilbert): in its bad state every chunk is lost. `cuts` are the times
    (start, end) between which nothing passes, chunks on their way included. Within `doubles` every
    chunk arrives twice; within `swaps` one waits for the next one, and arrives behind it.
    """

    def __init__(self, config: LinkConfig, rng: Random, cuts: Sequence[Cut] = ()) -> None:
        to_good = 1.0 / config.loss_burst_chunks
        super().__init__(
            config.latency_s,
            config.latency_jitter_s,
            to_good,
            config.loss_ratio * to_good / (1.0 - config.loss_ratio),
            config.corruption_ratio,
            state_of(rng),
        )
        self.cuts = list(cuts)


def state_of(rng: Random) -> Sequence[int]:
    """Return where a generator is, as the native parts take it; it is not to be drawn from again."""
    _, words, normal = rng.getstate()
    assert normal is None, "the second of two normal numbers waits"
    return list(words)
