"""Whether a pair of marks has a third beside it, so that nobody can say which two are the robot's.

A robot carries one front and one rear mark. Where a mark of a pair has a second partner, of
whichever colour, about the robot's distance away and as alike it in size as the two are each other, the
pair may be the robot, or half of something with a decoy beside it: a reflection, a plate with two marks
of one colour. Such a pair is not believed, unless it is known where the robot stands.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from vision.disc_fit import Disc, Marks, RimFitter
from vision.mark_limits import refusal
from vision.mark_search import Centres, Places, Point

if TYPE_CHECKING:
    from hil.config.camera import MarksConfig
    from hil.core.rig import Picture
    from vision.camera import CameraModel

THIRD_MARK = (
    "a third mark the robot's distance from one of two: cannot tell which two are the robot's"
)
# A rival is this close to the robot's distance from a mark, of that distance: a reflection seen on the
# marks' plane is 9 % smaller. Where it was found coarsely: of a mark's radius.
TOLERANCE, COARSE = 0.11, 0.9
# Its size is no further off its partner's than this beyond what the two marks are off each other, to the
# known one; and it may be off the known size by so much more than a mark.
UNLIKE, SIZES = 0.02, 1.5
# What claims its place no better than so many radii is noise, and has no distance that could be the robot's.
CLAIM_MAX = 0.2


class Rivals:
    """Looks for a third mark beside two; holds no past."""

    def __init__(
        self, model: CameraModel, rims: RimFitter, marks: MarksConfig, distance_m: float
    ) -> None:
        self._model, self._rims = model, rims
        self._height_m, self._radius_m = marks.height_m, 0.5 * marks.diameter_m
        self._ground_ratio_max = marks.ground_ratio_max
        self._distance_m = distance_m

    def beside(self, image: Picture, discs: Marks, centres_m: Centres, places: Places) -> bool:
        """Return whether one of the `places` found coarsely is a third mark beside two discs."""
        coarse_m = TOLERANCE * self._distance_m + COARSE * self._radius_m
        unlike = abs(discs[0].growth - discs[1].growth) + UNLIKE
        for slot, of_colour in enumerate(places):
            for place in of_colour:
                if self._own(place, centres_m) or not self._partners(place, centres_m, coarse_m):
                    continue
                tried = (place, centres_m[1]) if slot == 0 else (centres_m[0], place)
                found = self._rims.fit(image, tried)
                if found is not None and self._is_rival(found[slot], discs, centres_m, unlike):
                    return True
        return False

    def _is_rival(self, disc: Disc, discs: Marks, centres_m: Centres, unlike: float) -> bool:
        if refusal(disc, self._ground_ratio_max, SIZES) or not _placed(disc):
            return False
        place = self._model.floor_point(disc.u_px, disc.v_px, self._height_m)
        if self._own(place, centres_m):
            return False
        partners = self._partners(place, centres_m, TOLERANCE * self._distance_m)
        return any(abs(disc.growth - discs[k].growth) < unlike for k in partners)

    def _own(self, place_m: Point, centres_m: Centres) -> bool:
        """Return whether a place is that of one of the two marks."""
        return any(math.dist(place_m, own) < self._radius_m for own in centres_m)

    def _partners(self, place_m: Point, centres_m: Centres, within_m: float) -> list[int]:
        """Return which of the two marks lie the robot's distance from a place."""
        away = (abs(math.dist(place_m, own) - self._distance_m) for own in centres_m)
        return [k for k, off_m in enumerate(away) if off_m < within_m]


def _placed(disc: Disc) -> bool:
    """Return whether it is known where a disc lies."""
    uu, _, vv = disc.covariance_px2
    return math.sqrt(uu + vv) <= CLAIM_MAX * disc.radius_px
