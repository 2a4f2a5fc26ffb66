"""The radio or cable between host and board."""

from __future__ import annotations

from pydantic import Field

from hil.config.base import Section


class LinkConfig(Section):
    """Both directions alike; delay of one chunk is latency + jitter * u, u uniform in 0..1."""

    baud: int = Field(
        57_600, ge=1_200, le=2_000_000, description="bit/s, 10 bits a byte; the HC-05 of the thesis"
    )
    latency_s: float = Field(
        0.020, ge=0, le=2, description="least delay of a chunk, s; serial Bluetooth, assumed"
    )
    latency_jitter_s: float = Field(
        0.010, ge=0, le=2, description="largest extra delay of a chunk, s; assumed"
    )
    loss_ratio: float = Field(0.0, ge=0, le=0.9, description="mean share of chunks lost")
    loss_burst_chunks: float = Field(
        1.5, ge=1, le=1000, description="mean length of a run of lost chunks (two-state Gilbert)"
    )
    corruption_ratio: float = Field(
        0.0, ge=0, le=0.5, description="share of bytes that arrive with other bits"
    )
