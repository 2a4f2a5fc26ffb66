"""What a measured disc must be like to be one of the robot's marks."""

from __future__ import annotations

import math

from vision.disc_fit import Disc, Marks

SHARE_MIN = 0.4
# So little of a rim is enough where it has the known radius within so much.
SHARE_SURE_MIN, GROWTH_SURE = 0.33, 0.03
GROWTH_MAX = 0.12  # of a rim that is seen whole; less of one
GROWTH_CUT = 0.4
GROWTH_DOUBT = 0.5  # more where the rim is rough: noise, blur longer than the profiles
RESIDUAL_MAX = (
    0.09  # of the radius, for a rim that is seen whole: blur; a cover leaves the rest sharp
)
RESIDUAL_FREE_DN = 10.5  # px at a contrast of 1 DN: a sensor's noise
# Squares of the same width are four-cornered by 0.5 to 0.9 on average of both, discs to 0.6. What is left
# out of a square's rim are its corners: less is enough where both rims, or one, are not whole.
SQUARE_MAX, SQUARE_MAX_CUT, SQUARE_MAX_BOTH_CUT = 0.65, 0.52, 0.42
WHOLE_SHARE = 0.96
# A wrong height changes size and distance alike; blur, focus and gamma the size alone, by 5 % at most
# beyond the noise in all conditions of the bench, and scissors by some more.
SCALE_MAX, SCALE_SIGMAS = 0.065, 2.5
# What else speaks against two discs, each as a standard deviation of robots with and without covers: corners
# beyond so many; the part of a rim over which its colour goes on; the part inside which that colour is not.
CORNERS_FREE, CORNERS_SIGMA = 0.4, 0.12
BEYOND_SIGMA = 0.06
HOLLOW_SIGMA = 0.2


def refusal(disc: Disc, ground_ratio_max: float, sizes: float = 1.0) -> str:
    """Return why a disc cannot be a mark, "" when it can; with `sizes` times the limit of its size."""
    least = SHARE_SURE_MIN if abs(disc.growth) <= GROWTH_SURE else SHARE_MIN
    if disc.share < least:
        return f"{disc.share:.0%} of its rim seen, limit {least:.0%}"
    most = sizes * (
        GROWTH_MAX * (GROWTH_CUT + (1.0 - GROWTH_CUT) * disc.share)
        + GROWTH_DOUBT * disc.residual_px / disc.radius_px
    )
    if not abs(disc.growth) <= most:
        return f"{1.0 + disc.growth:.2f} of its size, limit 1 +- {most:.2f}"
    most_px = free_px(disc) + RESIDUAL_MAX * disc.share**2 * disc.radius_px
    if not disc.residual_px <= most_px:
        return f"rim off by {disc.residual_px:.2f} px RMS, limit {most_px:.2f} px"
    if not disc.ground_ratio <= ground_ratio_max:
        return f"ground {disc.ground_ratio:.2f} times as bright, limit {ground_ratio_max:g}"
    return ""


def four_cornered(discs: Marks) -> bool:
    """Return whether two marks have four corners each."""
    cut = sum(disc.share < WHOLE_SHARE for disc in discs)
    most = (SQUARE_MAX, SQUARE_MAX_CUT, SQUARE_MAX_BOTH_CUT)[cut]
    return 0.5 * sum(disc.square for disc in discs) > most


def doubts(discs: Marks) -> dict[str, float]:
    """Return what speaks against two discs and is no limit by itself, in sigmas, by what it is."""
    corners = 0.5 * sum(disc.square for disc in discs)
    beyond = max(disc.beyond for disc in discs)
    hollow = max(disc.hollow for disc in discs)
    return {
        "four corners": max(corners - CORNERS_FREE, 0.0) / CORNERS_SIGMA,
        f"their colour goes on over {beyond:.0%} of a rim": beyond / BEYOND_SIGMA,
        "a middle of another colour": hollow / HOLLOW_SIGMA,
    }


def scale_refusal(discs: Marks, gap_ratio: float) -> str:
    """Return why two discs are not the robot's marks from whatever height, "" when they may be.

    `gap_ratio` is how far their distance is off the robot's, relative.
    """
    growth = 0.5 * (discs[0].growth + discs[1].growth)
    variance = sum(
        0.5 * (disc.covariance_px2[0] + disc.covariance_px2[2]) / disc.radius_px**2
        for disc in discs
    )
    most = SCALE_MAX + SCALE_SIGMAS * 0.5 * math.sqrt(variance)
    if abs(growth - gap_ratio) <= most:
        return ""
    return (
        f"marks {1.0 + growth:.3f} of their size and {1.0 + gap_ratio:.3f} of their distance,"
        f" limit {most:.3f} apart"
    )


def rough_px(disc: Disc) -> float:
    """Return how far a rim is off its disc beyond a sensor's noise, RMS."""
    return math.sqrt(max(disc.residual_px**2 - free_px(disc) ** 2, 0.0))


def free_px(disc: Disc) -> float:
    """Return how far a noisy sensor's rim is off its disc, RMS: the paler the disc, the more."""
    return RESIDUAL_FREE_DN / max(disc.contrast_dn, 1.0)
