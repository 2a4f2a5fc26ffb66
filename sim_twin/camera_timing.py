"""When the simulated camera exposes, and when each frame reaches the host.

Frame k is exposed from k periods after the first on, on the camera's own clock. Its time of
arrival is the middle of the exposure + latency + jitter (Gaussian, within three standard
deviations); frames keep their order and never arrive before the exposure has ended. Where a frame
may have to wait for the one before it, all are drawn earlier by so much that the median of what
arrives is the latency configured; the spread is a little below the jitter then.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from random import Random
from typing import TYPE_CHECKING

from sim_twin import _native
from sim_twin.link_model import state_of

if TYPE_CHECKING:
    from hil.config.camera import CameraConfig

# A camera's quartz, assumed; slow enough for any estimator, real enough to be noticed.
CLOCK_PPM = 20.0

_MOST_SIGMAS = 3.0

Span = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Exposure:
    """One frame on its way: host times in s, `t_cam_s` the middle on the camera's clock."""

    index: int
    start_s: float
    end_s: float
    t_cam_s: float
    arrival_s: float


class Shutter(_native.Shutter):
    """Draws the exposures one after the other; the same for the same rng and configuration."""

    def __init__(self, camera: CameraConfig, rng: Random, t_first_s: float) -> None:
        period_s = 1.0 / camera.rate_hz
        t_first_s += period_s * rng.random()
        super().__init__(
            period_s=period_s,
            exposure_s=camera.exposure_s,
            latency_s=camera.latency_s - _median_wait_s(camera),
            jitter_s=camera.latency_jitter_s,
            drop_ratio=camera.drop_ratio,
            t_first_s=t_first_s,
            clock_start_s=rng.uniform(10.0, 1000.0),
            clock_rate=1.0 + 1e-6 * CLOCK_PPM,
            most_sigmas=_MOST_SIGMAS,
            chance=state_of(rng),
        )

    def expose(self, stalls: Sequence[Span] = ()) -> Exposure | None:
        """Return the next frame that will arrive; None when the camera has stalled for good."""
        found = self.next(sorted(stalls))
        return None if found is None else Exposure(*found)


def _median_wait_s(camera: CameraConfig) -> float:
    """Return by how much keeping the order would raise the median delay.

    A frame arrives no later than x after its exposure when its own delay is below x and that of the
    frame k before it, unless dropped, below x + k periods: the product of these chances is 0.5 at
    the median.
    """
    period_s, jitter_s = 1.0 / camera.rate_hz, camera.latency_jitter_s
    reach_s = _MOST_SIGMAS * jitter_s
    if reach_s <= period_s or camera.drop_ratio >= 1.0:
        return 0.0
    before = range(1, math.ceil(2.0 * reach_s / period_s) + 1)

    def share_below(x_s: float) -> float:
        share = _below(x_s / jitter_s)
        for k in before:
            share *= camera.drop_ratio + (1.0 - camera.drop_ratio) * _below(
                (x_s + k * period_s) / jitter_s
            )
        return share

    low_s, high_s = 0.0, reach_s
    for _ in range(50):
        middle_s = 0.5 * (low_s + high_s)
        low_s, high_s = (middle_s, high_s) if share_below(middle_s) < 0.5 else (low_s, middle_s)
    return high_s


def _below(sigmas: float) -> float:
    """Return the share of the clipped Gaussian at or below `sigmas`."""
    if abs(sigmas) >= _MOST_SIGMAS:
        return 1.0 if sigmas > 0.0 else 0.0
    return 0.5 + 0.5 * math.erf(sigmas / math.sqrt(2.0))
