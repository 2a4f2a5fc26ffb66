"""When the simulated camera exposes, and when each frame reaches the host.

Frame k is exposed from k periods after the first on, on the camera's own clock. Its time of
arrival is the middle of the exposure + latency + jitter (Gaussian, within three standard
deviations); frames keep their order and never arrive before the exposure has ended.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from random import Random
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hil.config.camera import CameraConfig

# A camera's quartz, assumed; slow enough for any estimator, real enough to be noticed.
CLOCK_PPM = 20.0

Span = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Exposure:
    """One frame on its way: host times in s, `t_cam_s` the middle on the camera's clock."""

    index: int
    start_s: float
    end_s: float
    t_cam_s: float
    arrival_s: float


class Shutter:
    """Draws the exposures one after the other; the same for the same rng and configuration."""

    def __init__(self, camera: CameraConfig, rng: Random, t_first_s: float) -> None:
        self._rng = rng
        self._period_s = 1.0 / camera.rate_hz
        self._exposure_s = camera.exposure_s
        self._latency_s = camera.latency_s
        self._jitter_s = camera.latency_jitter_s
        self._drop_ratio = camera.drop_ratio
        self._t_first_s = t_first_s + self._period_s * rng.random()
        self._clock_start_s = rng.uniform(10.0, 1000.0)
        self._index = 0
        self._last_arrival_s = -math.inf

    def next(self, stalls: Sequence[Span] = ()) -> Exposure | None:
        """Return the next frame that will arrive; None when the camera has stalled for good."""
        while True:
            self._skip_stalls(stalls)
            if self._index < 0:
                return None
            exposure = self._expose(self._index)
            self._index += 1
            if self._rng.random() >= self._drop_ratio:
                self._last_arrival_s = exposure.arrival_s
                return exposure
            if self._drop_ratio >= 1.0:
                return None

    def _skip_stalls(self, stalls: Sequence[Span]) -> None:
        """Move on to the first frame whose exposure starts outside every stall."""
        for start_s, end_s in sorted(stalls):
            t_s = self._t_first_s + self._index * self._period_s
            if start_s <= t_s < end_s:
                if math.isinf(end_s):
                    self._index = -1
                    return
                self._index = math.ceil((end_s - self._t_first_s) / self._period_s)

    def _expose(self, index: int) -> Exposure:
        start_s = self._t_first_s + index * self._period_s
        end_s = start_s + self._exposure_s
        middle_s = 0.5 * (start_s + end_s)
        spread = min(max(self._rng.gauss(0.0, 1.0), -3.0), 3.0)
        arrival_s = middle_s + self._latency_s + self._jitter_s * spread
        clock_s = self._clock_start_s + (middle_s - self._t_first_s) * (1.0 + 1e-6 * CLOCK_PPM)
        return Exposure(index, start_s, end_s, clock_s, max(arrival_s, end_s, self._last_arrival_s))
