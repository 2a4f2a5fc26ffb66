"""The radio or cable between host and board."""

from __future__ import annotations

from typing import Self

from pydantic import model_validator

from hil.config.base import Section, quantity, rounded_up


class LinkConfig(Section):
    """Both directions alike; delay of one chunk is latency + jitter * u, u uniform in -1..1.

    Chunks never overtake each other and never arrive before they were sent: where the jitter is
    larger than the latency or than their distance, the mean delay is above `latency_s`.
    """

    baud: int = quantity(
        "bit/s", "10 bits a byte", 57_600, ge=1_200, le=2_000_000, source="the HC-05 of the thesis"
    )
    latency_s: float = quantity(
        "s", "mean delay of a chunk", 0.020, ge=0, le=2, source="assumed: serial Bluetooth"
    )
    latency_jitter_s: float = quantity(
        "s", "half width of the delay's spread", 0.010, ge=0, le=2, source="assumed"
    )
    loss_ratio: float = quantity("(ratio)", "mean share of chunks lost", 0.0, ge=0, le=0.9)
    loss_burst_chunks: float = quantity(
        "chunks", "mean length of a run of lost chunks (two-state Gilbert)", 1.5, ge=1, le=1000
    )
    corruption_ratio: float = quantity(
        "(ratio)", "share of bytes that arrive with other bits", 0.0, ge=0, le=0.5
    )

    @model_validator(mode="after")
    def _bursts_long_enough(self) -> Self:
        """Between two bursts one chunk passes at least, which bounds the loss from above."""
        least = self.loss_ratio / (1.0 - self.loss_ratio)
        if self.loss_burst_chunks < least * (1.0 - 1e-9):  # 0.9 / (1 - 0.9) is a little above 9
            raise ValueError(
                f"loss_burst_chunks must be at least {rounded_up(least)} at this loss_ratio"
            )
        return self
