"""What a live camera's frames say about the camera: rate, age, repeated pictures; each said once."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]

FRAMES = 101
# Off the rate asked for by more than this is another rate.
RATE_TOLERANCE = 0.05
# Frames older than this many periods when they arrive have waited in a queue.
AGE_PERIODS = 2.5
REPEATED_MIN = 3
# A sensor's noise changes every picture; one pixel in so many each way is looked at.
SPARSE = 8


class FrameWatch:
    """Takes every frame of a camera; `wanted_hz` is the rate asked for, None for any."""

    def __init__(self, wanted_hz: float | None = None) -> None:
        self._wanted_hz = wanted_hz
        self._periods_s: deque[float] = deque(maxlen=FRAMES)
        self._ages_s: deque[float] = deque(maxlen=FRAMES)
        self._repeats: deque[bool] = deque(maxlen=FRAMES)
        self._last_s = math.nan
        self._last_picture = b""
        self._said: set[str] = set()
        self.repeated = 0

    @property
    def rate_hz(self) -> float:
        """The true frame rate: one over the median distance of the last stamps; NaN before."""
        return 1.0 / float(np.median(self._periods_s)) if self._periods_s else math.nan

    @property
    def age_s(self) -> float:
        """How old frames are when they arrive, by the driver's stamps: the median; NaN before."""
        return float(np.median(self._ages_s)) if self._ages_s else math.nan

    def restart(self) -> None:
        """Begin a new row of stamps: the camera was away."""
        self._last_s = math.nan

    def take(self, stamp_s: float, arrival_s: float, image: Image) -> bool:
        """Take a frame; return whether it is new, and not the one before once more."""
        picture = image[::SPARSE, ::SPARSE].tobytes()
        new = stamp_s != self._last_s and picture != self._last_picture
        self._repeats.append(not new)
        if not new:
            self.repeated += 1
            return False
        if math.isfinite(self._last_s):
            self._periods_s.append(stamp_s - self._last_s)
        if stamp_s != arrival_s:  # a stamp of the driver's own
            self._ages_s.append(arrival_s - stamp_s)
        self._last_s, self._last_picture = stamp_s, picture
        return True

    def said(self) -> str:
        """Return what is to be said now that was not said before, "" for nothing."""
        found = {"repeated": self._repeated(), "rate": self._rate(), "age": self._age()}
        new = {what: text for what, text in found.items() if text and what not in self._said}
        self._said |= set(new)
        return "; ".join(new.values())

    def _repeated(self) -> str:
        count = sum(self._repeats)
        if count < REPEATED_MIN:
            return ""
        return f"{count} of its last {len(self._repeats)} frames are the one before once more"

    def _rate(self) -> str:
        wanted = self._wanted_hz
        if wanted is None or len(self._periods_s) < FRAMES - 1:
            return ""
        if abs(self.rate_hz / wanted - 1.0) <= RATE_TOLERANCE:
            return ""
        return (
            f"gives {self.rate_hz:.1f} Hz, {wanted:g} Hz were asked for; a shorter exposure or a"
            " smaller frame may help"
        )

    def _age(self) -> str:
        if len(self._ages_s) < FRAMES // 2 or self.age_s * self.rate_hz <= AGE_PERIODS:
            return ""
        return (
            f"frames are {1e3 * self.age_s:.0f} ms old when they arrive,"
            f" {self.age_s * self.rate_hz:.1f} periods: its driver keeps a queue"
        )
