"""The radio or cable between host and board."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from hil.config.base import Section, rounded_up


class LinkConfig(Section):
    """Both directions alike; delay of one chunk is latency + jitter * u, u uniform in -1..1.

    Chunks never overtake each other and never arrive before they were sent: where the jitter is
    larger than the latency or than their distance, the mean delay is above `latency_s`.
    """

    baud: int = Field(
        57_600, ge=1_200, le=2_000_000, description="bit/s, 10 bits a byte; the HC-05 of the thesis"
    )
    latency_s: float = Field(
        0.020, ge=0, le=2, description="mean delay of a chunk, s; serial Bluetooth, assumed"
    )
    latency_jitter_s: float = Field(
        0.010, ge=0, le=2, description="half width of the delay's spread, s; assumed"
    )
    loss_ratio: float = Field(0.0, ge=0, le=0.9, description="mean share of chunks lost")
    loss_burst_chunks: float = Field(
        1.5, ge=1, le=1000, description="mean length of a run of lost chunks (two-state Gilbert)"
    )
    corruption_ratio: float = Field(
        0.0, ge=0, le=0.5, description="share of bytes that arrive with other bits"
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
