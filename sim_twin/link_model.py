"""Serial line and radio between host and board: pace, delay, loss, corruption, cuts.

Two parts, so that a simulated UART, whose pace is real already, can do without the first:
`Serialiser` gives bytes their time on a line, `Channel` is what lies behind the line.
Times are s of one clock, passed in; chance is a `random.Random`, passed in.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from random import Random
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hil.config.link import LinkConfig

BITS_PER_BYTE = 10  # start, eight data, stop

Cut = tuple[float, float]


class Serialiser:
    """A UART or serial port that sends one byte after the other at its baud rate."""

    def __init__(self, baud: int) -> None:
        self._byte_s = BITS_PER_BYTE / baud
        self._free_s = -math.inf

    def send(self, t_s: float, size: int) -> float:
        """Return the time at which the last of `size` bytes given at `t_s` has left."""
        self._free_s = max(t_s, self._free_s) + size * self._byte_s
        return self._free_s


class Channel:
    """One direction of the link behind the serial port; chunks arrive in the order they left.

    Loss is a two-state chain (Gilbert): in its bad state every chunk is lost. `cuts` are the times
    (start, end) between which nothing passes, chunks on their way included. Within `doubles` every
    chunk arrives twice; within `swaps` one waits for the next one, and arrives behind it.
    """

    def __init__(self, config: LinkConfig, rng: Random, cuts: Sequence[Cut] = ()) -> None:
        self.cuts = cuts
        self.doubles: Sequence[Cut] = ()
        self.swaps: Sequence[Cut] = ()
        self._waiting = b""
        self._rng = rng
        self._latency_s = config.latency_s
        self._jitter_s = config.latency_jitter_s
        self._last_s = -math.inf
        self._bad = False
        self._to_good = 1.0 / config.loss_burst_chunks
        self._to_bad = config.loss_ratio * self._to_good / (1.0 - config.loss_ratio)
        self._corruption = config.corruption_ratio
        self._clean_bytes = self._draw_clean_bytes() if self._corruption else 0

    def carry(self, t_s: float, data: bytes) -> tuple[float, bytes] | None:
        """Return arrival time and bytes of a chunk that left at `t_s`; None when it is lost."""
        if self._to_bad and self._is_lost():
            return None
        delay_s = self._latency_s + self._jitter_s * (2.0 * self._rng.random() - 1.0)
        arrival_s = max(t_s + max(delay_s, 0.0), self._last_s)
        for start_s, end_s in self.cuts:
            if t_s < end_s and arrival_s >= start_s:
                return None
        self._last_s = arrival_s
        data = self._corrupted(data) if self._corruption else data
        if _within(self.doubles, t_s):
            data += data
        if _within(self.swaps, t_s) and not self._waiting:
            self._waiting = data
            return None
        data, self._waiting = data + self._waiting, b""
        return arrival_s, data

    def _is_lost(self) -> bool:
        """Step the chain by one chunk; its share of bad states is the loss ratio."""
        self._bad = self._rng.random() < (1.0 - self._to_good if self._bad else self._to_bad)
        return self._bad

    def _draw_clean_bytes(self) -> int:
        """Return how many bytes pass before the next corrupted one (geometric)."""
        return int(math.log(1.0 - self._rng.random()) / math.log(1.0 - self._corruption))

    def _corrupted(self, data: bytes) -> bytes:
        if self._clean_bytes >= len(data):
            self._clean_bytes -= len(data)
            return data
        out = bytearray(data)
        at = self._clean_bytes
        while at < len(out):
            out[at] ^= self._rng.randrange(1, 256)  # at least one bit differs
            at += 1 + self._draw_clean_bytes()
        self._clean_bytes = at - len(out)
        return bytes(out)


def _within(spans: Sequence[Cut], t_s: float) -> bool:
    return any(start_s <= t_s < end_s for start_s, end_s in spans)
