"""The robot found by its two colour marks (front and rear), as in the thesis.

The sensor is linear. Each mark has a *response*: a weighted sum of blue, green and red that is zero
for grey and largest for the mark's own colour, so that floor, shadows and reflected lamps vanish
from it. Near a prediction the marks are measured at once (`vision.disc_fit`); without one, blobs of the
right size are looked for in a coarse image, and every two of them that may be the robot are measured
in the same way. What is accepted must have the marks' size, their distance and dark ground about
them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hil.config.camera import MarkConfig, MarksConfig
from hil.core.types import Pose, PoseMeasurement
from vision._marks import Spot, gap_variance, spot
from vision.camera import CameraModel, longest_px
from vision.disc_fit import Disc, Marks, RimFitter, check_colour, compiled
from vision.mark_limits import doubts, four_cornered, refusal, rough_px, scale_refusal
from vision.mark_search import CHROMA_BASIS, Centres, MarkSearch, Point, Window
from vision.pose_fit import weighted_pose
from vision.rivals import THIRD_MARK, Rivals

if TYPE_CHECKING:
    from hil.core.rig import Picture

Array = NDArray[np.float64]

# What is accepted.
DISTANCE_TOLERANCE = 0.04


# How many degrees of freedom the discs' own claims are worth against that of their distance.
MISFIT_FREEDOM = 4.0
QUALITY_RESIDUAL = 0.06  # of the radius
# What is hardly within each limit is no robot: the least of extreme blur and noise has 0.17.
QUALITY_MIN = 0.12
SAME_PLACE_M = 0.02
STRIP_PX = 320_000  # those of 640 x 480, which take some 3 ms
TWO_PLACES = "two places look like the robot"


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """Two discs taken for the robot's marks."""

    discs: Marks
    spots: tuple[Spot, Spot]
    gap_m: float

    @property
    def centres_m(self) -> Centres:
        """Where the marks are."""
        return self.spots[0].at_m, self.spots[1].at_m


class MarkLocaliser:
    """Finds the robot's two colour marks; holds the configuration, not the past."""

    def __init__(self, model: CameraModel, marks: MarksConfig, *, alone: bool = True) -> None:
        """Take a camera and two marks; `alone` says that the robot carries no further ones."""
        self._model = model
        self._compiled = compiled(model)
        self._height_m = marks.height_m
        self._radius_m = 0.5 * marks.diameter_m
        self._ground_ratio_max = marks.ground_ratio_max
        self._which_m = marks.which_m
        self._front_m, self._rear_m = ((m.x_m, m.y_m) for m in (marks.front, marks.rear))
        self._distance_m = math.dist(self._front_m, self._rear_m)
        weights = np.stack([_response(marks.front), _response(marks.rear)])
        self._rims = RimFitter(model, self._radius_m, self._height_m, weights)
        self._places = MarkSearch(
            model, self._radius_m, self._height_m, self._distance_m, weights @ CHROMA_BASIS.T
        )
        self._rivals = Rivals(model, self._rims, marks, self._distance_m) if alone else None

    def locate(
        self, image_bgr: Picture, predicted: Pose | None, search_radius_m: float
    ) -> PoseMeasurement:
        """Return the pose seen in an image, (H, W, 3) uint8 BGR.

        With a prediction the marks are measured there, else looked for within `search_radius_m`
        of it, else in the whole frame. Raises BadInput for an image without colours.
        """
        check_colour(image_bgr)
        if predicted is not None:
            seen = self.near(image_bgr, predicted, search_radius_m)
            if seen is not None:
                return seen
        whole = (0, 0, image_bgr.shape[1], image_bgr.shape[0])
        return self.inside(image_bgr, whole, predicted)

    def near(
        self, image_bgr: Picture, predicted: Pose, search_radius_m: float
    ) -> PoseMeasurement | None:
        """Return the pose at a prediction or within `search_radius_m` of it, None if not there."""
        check_colour(image_bgr)
        centres = self._marks_of(predicted)
        found, _ = self._measured(image_bgr, centres)
        if found is None:
            window = self._window(image_bgr, centres, search_radius_m)
            finds = self._search(image_bgr, window)[0] if window else []
            found = self._ours(finds, predicted)
        return None if found is None else self._measurement(found, in_window=True)

    def inside(
        self, image_bgr: Picture, window: Window, predicted: Pose | None = None
    ) -> PoseMeasurement:
        """Return the pose seen in a part of the image; of several alike, the one that is ours."""
        check_colour(image_bgr)
        finds, reason = self._search(image_bgr, window)
        found = self._ours(finds, predicted)
        if found is None:
            reason = TWO_PLACES if finds else reason
            return PoseMeasurement(None, 0.0, reason, details={"window": 0.0})
        return self._measurement(found, in_window=False)

    def ours(self, finds: list[PoseMeasurement], predicted: Pose | None) -> PoseMeasurement | None:
        """Return which of several finds is our robot; None for none, "not seen" for too many."""
        if len(finds) < 2:
            return finds[0] if finds else None
        place = self._place(predicted)
        if place is None or any(find.pose is None for find in finds):
            return PoseMeasurement(None, 0.0, TWO_PLACES, details={"window": 0.0})
        return min(finds, key=lambda find: _away(find, place))

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the frames."""
        return self._model.width_px, self._model.height_px

    @property
    def strip_px(self) -> int:
        """How many pixels are searched in one frame where the search is spread over several."""
        return STRIP_PX

    @property
    def span_px(self) -> int:
        """How long the robot's marks and their rims are together in the image, at most."""
        return longest_px(self._model, self._height_m, self._distance_m + 4.0 * self._radius_m)

    def _place(self, predicted: Pose | None) -> Point | None:
        """Return where our robot is expected among several alike; None where nobody said."""
        if self._which_m is None or predicted is None:
            return self._which_m
        return predicted.x_m, predicted.y_m

    def _ours(self, finds: list[_Found], predicted: Pose | None) -> _Found | None:
        """Return the find that is our robot; None for none, or where two could be it."""
        if len(finds) < 2:
            return finds[0] if finds else None
        place = self._place(predicted)
        if place is None:
            return None
        return min(finds, key=lambda found: math.dist(np.mean(found.centres_m, axis=0), place))

    # -- where to look -------------------------------------------------------------------------

    def _marks_of(self, pose: Pose) -> Centres:
        """Return where the marks of a robot at `pose` are."""
        c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
        front, rear = (
            (pose.x_m + c * x - s * y, pose.y_m + s * x + c * y)
            for x, y in (self._front_m, self._rear_m)
        )
        return front, rear

    def _window(self, image: Picture, centres_m: Centres, radius_m: float) -> Window | None:
        """Return the part of the image around predicted marks, None when out of view."""
        reach_m = radius_m + 2.0 * self._radius_m
        corners = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]) * reach_m
        floor = (np.array(centres_m)[:, None] + corners).reshape(-1, 2)
        px = self._model.project(np.column_stack((floor, np.full(8, self._height_m))))
        if not np.isfinite(px).all():
            return None
        height, width = image.shape[:2]
        left, top = np.maximum(px.min(axis=0).astype(int), 0).tolist()
        right, bottom = np.minimum(px.max(axis=0).astype(int) + 2, (width, height)).tolist()
        least = 4 * self._places.grid_px
        return (left, top, right, bottom) if min(right - left, bottom - top) > least else None

    # -- coarse --------------------------------------------------------------------------------

    def _search(self, image: Picture, window: Window) -> tuple[list[_Found], str]:
        """Return what looks like the robot in a part of the image; if nothing, the reason.

        Two at most where nobody said which is ours: one more is one too many.
        """
        looked = image if isinstance(image, np.ndarray) else image.part(self._places.seen(window))
        pairs, places, reason = self._places.pairs(looked, window)
        finds: list[_Found] = []
        why = ""
        for centres in pairs:
            if any(_near(centres, found, self._radius_m) for found in finds):
                continue
            found, refusal = self._measured(image, centres)
            why = why or refusal
            if found is None:
                continue
            rivals = [other for other in finds if _sharing(found, other)]
            best = min([found, *rivals], key=self._badness)
            finds = [other for other in finds if other not in rivals] + [best]
            if self._which_m is None and len(finds) > 1:
                break
        third = self._rivals if self._which_m is None and len(finds) == 1 else None
        if third and third.beside(image, finds[0].discs, finds[0].centres_m, places):
            return [], THIRD_MARK
        return finds, why or reason

    # -- fine ----------------------------------------------------------------------------------

    def _measured(self, image: Picture, centres_m: Centres) -> tuple[_Found | None, str]:
        """Return the marks near two guessed centres, or None and why they are not the robot's."""
        discs = self._rims.fit(image, centres_m)
        if discs is None:
            return None, "marks have no rim"
        for name, disc in zip(("front", "rear"), discs, strict=True):
            why = refusal(disc, self._ground_ratio_max)
            if why:
                return None, f"{name} mark: {why}"
        if four_cornered(discs):
            return None, "both marks have four corners"
        front, rear = (spot(self._compiled, disc, self._height_m) for disc in discs)
        gap_m = math.dist(front.at_m, rear.at_m) - self._distance_m
        length_m = max(math.dist(front.at_m, rear.at_m), 1e-9)
        doubt_m = 2.0 * math.sqrt(gap_variance(front, rear, length_m))
        most_m = DISTANCE_TOLERANCE * self._distance_m
        if not abs(gap_m) <= most_m + min(doubt_m, most_m):
            own_mm = 1e3 * self._distance_m
            return (
                None,
                f"marks {own_mm + 1e3 * gap_m:.0f} mm apart, the robot's are {own_mm:.0f} mm",
            )
        found = _Found(discs, (front, rear), gap_m)
        why = scale_refusal(discs, gap_m / self._distance_m) or self._poor(found)
        return (None, why) if why else (found, "")

    def _poor(self, found: _Found) -> str:
        """Return why a find is hardly within each limit, "" when it is well within some."""
        against = doubts(found.discs)
        score = self._quality(found) * math.exp(-0.5 * sum(off**2 for off in against.values()))
        if score >= QUALITY_MIN:
            return ""
        most = max(against, key=lambda what: against[what])
        why = f", {most}" if against[most] >= 1.0 else ""
        return f"rims and distance fit badly together{why}: {score:.3f}, limit {QUALITY_MIN}"

    def _quality(self, found: _Found) -> float:
        """Return the smaller share of rim times how well rims and distance fit; 1 is whole and sharp."""
        share = min(disc.share for disc in found.discs)
        sharp = max(rough_px(disc) / disc.radius_px for disc in found.discs) / QUALITY_RESIDUAL
        misfit = found.gap_m / (DISTANCE_TOLERANCE * self._distance_m)
        return share * math.exp(-0.5 * sharp**2 - misfit**2)

    def _measurement(self, found: _Found, *, in_window: bool) -> PoseMeasurement:
        """Return pose, quality (1: both rims whole and sharp) and claimed deviations."""
        front, rear = found.discs
        pose, claimed, misfit2 = weighted_pose((self._front_m, self._rear_m), *found.spots)
        # Marks further off their distance than they claim: both claims are too small.
        grown = (MISFIT_FREEDOM + misfit2) / (MISFIT_FREEDOM + 1.0)
        xx, xy, xt, yy, yt, tt = (grown * value for value in claimed)
        residual_m = 0.5 * abs(found.gap_m)
        return PoseMeasurement(
            pose,
            quality=self._quality(found),
            sigma_xy_m=math.sqrt(0.5 * (xx + yy)),
            sigma_theta_rad=math.sqrt(tt),
            covariance=(xx, xy, xt, yy, yt, tt),
            details={
                "front_u_px": front.u_px,
                "front_v_px": front.v_px,
                "rear_u_px": rear.u_px,
                "rear_v_px": rear.v_px,
                "front_area_px": _area_px(front),
                "rear_area_px": _area_px(rear),
                "front_share": front.share,
                "rear_share": rear.share,
                "contrast_dn": min(front.contrast_dn, rear.contrast_dn),
                "residual_px": max(front.residual_px, rear.residual_px),
                "residual_m": residual_m,
                "window": float(in_window),
            },
        )

    def _badness(self, found: _Found) -> float:
        """Return how far a find is from the marks as they are: distance, sizes and rims."""
        rims = sum(abs(d.growth) + d.residual_px / d.radius_px for d in found.discs)
        return rims + abs(found.gap_m) / (DISTANCE_TOLERANCE * self._distance_m)


def _away(find: PoseMeasurement, place_m: Point) -> float:
    """Return how far a find is from a place, m."""
    assert find.pose is not None
    return math.dist((find.pose.x_m, find.pose.y_m), place_m)


def _sharing(one: _Found, other: _Found) -> bool:
    """Return whether two finds have a mark in common: at most one of them is a robot."""
    pairs = zip(one.centres_m, other.centres_m, strict=True)
    return any(math.dist(a, b) < SAME_PLACE_M for a, b in pairs)


def _near(centres_m: Centres, found: _Found, within_m: float) -> bool:
    """Return whether a hypothesis is the one already measured."""
    pairs = zip(centres_m, found.centres_m, strict=True)
    return all(math.dist(a, b) < within_m for a, b in pairs)


def _area_px(disc: Disc) -> float:
    """Return the area of the part of a mark that is seen."""
    return disc.share * math.pi * (disc.radius_px * (1.0 + disc.growth)) ** 2


def _response(mark: MarkConfig) -> Array:
    """Return weights (b, g, r): zero for grey, unit noise gain, largest for the mark's colour."""
    colour = np.asarray(mark.colour)
    weights: Array = colour - colour.mean()
    return weights / np.linalg.norm(weights)
