"""The search of a whole frame spread over several frames, so that none of them takes long.

A frame is cut into upright strips that overlap by the robot's length; while it is lost, each frame
has one of them searched. Only when all have been is a place believed, since a second one like it
may lie in another strip; it is then measured anew, for the robot may have moved.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from hil.core.types import Pose, PoseMeasurement
from vision.localisers.marks import SAME_PLACE_M, TWO_PLACES
from vision.localisers.tags import IN_VIEW
from vision.mark_search import Window
from vision.rivals import THIRD_MARK

if TYPE_CHECKING:
    from hil.core.rig import Picture
    from vision.tracker import Localiser

# How far the robot may have gone between two strips that both show it.
MOVED_M = 0.1


@runtime_checkable
class Parted(Protocol):
    """A localiser that can look at a part of a frame; all that ship with the harness can.

    `size_px` is the frames' width and height, `span_px` how long the robot is in them at most,
    `strip_px` how many pixels it searches in a few milliseconds.
    """

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the frames."""

    @property
    def span_px(self) -> int:
        """How long what is looked for is in the image, at most."""

    @property
    def strip_px(self) -> int:
        """How many pixels are searched in one frame."""

    def near(
        self, image_bgr: Picture, predicted: Pose, search_radius_m: float
    ) -> PoseMeasurement | None:
        """Return the pose at a prediction or within `search_radius_m` of it, None if not there."""

    def inside(
        self, image_bgr: Picture, window: Window, predicted: Pose | None = None
    ) -> PoseMeasurement:
        """Return the pose seen in a part of the image."""

    def ours(self, finds: list[PoseMeasurement], predicted: Pose | None) -> PoseMeasurement | None:
        """Return which of several finds is our robot; None for none, "not seen" for too many."""


def spread(localiser: Localiser) -> Localiser:
    """Return a localiser whose frames all take about as long; itself where they do already."""
    if not isinstance(localiser, Parted):
        return localiser
    strips = strips_of(localiser)
    return localiser if len(strips) == 1 else SpreadSearch(localiser, strips)


def strips_of(localiser: Parted) -> list[Window]:
    """Return the parts of a frame that are searched one after the other."""
    width, height = localiser.size_px
    count = math.ceil(width * height / localiser.strip_px)
    overlap = min(localiser.span_px, width)
    step = (width - overlap) / count
    return [
        (max(0, int(k * step)), 0, min(width, math.ceil((k + 1) * step + overlap)), height)
        for k in range(count)
    ]


class SpreadSearch:
    """A localiser that remembers which strips it has searched since it lost the robot."""

    def __init__(self, localiser: Parted, strips: list[Window]) -> None:
        self._localiser = localiser
        self._strips = strips
        self._next = 0
        self._found: list[PoseMeasurement] = []

    def locate(
        self, image_bgr: Picture, predicted: Pose | None, search_radius_m: float
    ) -> PoseMeasurement:
        """Return the pose near a prediction, else what is known from the strips searched so far."""
        if predicted is not None:
            seen = self._localiser.near(image_bgr, predicted, search_radius_m)
            if seen is not None:
                self._restart()
                return seen
        seen = self._localiser.inside(image_bgr, self._strips[self._next], predicted)
        self._take(seen)
        self._next += 1
        if self._next < len(self._strips):
            told = f"{self._next} of {len(self._strips)} parts of the frame searched"
            return replace(_not_seen(seen), reason=told)
        found = self._localiser.ours(self._found, predicted)
        self._restart()
        if found is None or found.pose is None or found is seen:
            return found or seen
        again = self._localiser.near(image_bgr, found.pose, search_radius_m)
        return again or replace(_not_seen(found), reason="gone from where it was found")

    def _take(self, seen: PoseMeasurement) -> None:
        """Keep a find; one where another was, in the strip beside it, takes its place."""
        if seen.pose is None:
            if seen.reason in {TWO_PLACES, THIRD_MARK} or seen.reason.endswith(IN_VIEW):
                self._found.append(seen)
            return
        others = [one for one in self._found if not _same(one, seen)]
        self._found = [*others, seen]

    def _restart(self) -> None:
        self._next, self._found = 0, []


def _same(one: PoseMeasurement, other: PoseMeasurement) -> bool:
    if one.pose is None or other.pose is None:
        return False
    apart_m = math.hypot(one.pose.x_m - other.pose.x_m, one.pose.y_m - other.pose.y_m)
    return apart_m < MOVED_M + SAME_PLACE_M


def _not_seen(seen: PoseMeasurement) -> PoseMeasurement:
    return PoseMeasurement(None, 0.0, seen.reason, details={"window": 0.0})
