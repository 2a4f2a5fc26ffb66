"""Edges across the rim of a disc, found by sums over profiles of several lengths.

A profile runs from inside to outside. Its edge lies where the mean between two levels, taken at its
ends, says. A blurred edge fills a short profile, whose ends then move with the edge: it says little
of where the edge is, and that is measured here as the *gain* of each profile, how far its answer
moves when the profile is moved by one sample. Of the lengths tried the one that says most counts,
so that along the motion profiles are long and across it short.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Mask = NDArray[np.bool_]

RAYS = 48
# Rays over which an edge's two levels are averaged: a sixth of the rim follows a shadow's edge.
LEVEL_RAYS = 7
# Rays over which gain and noise are averaged.
GAIN_RAYS = 9
# How far from the rim an edge is looked for, and how far beyond that its two levels are taken, in
# radii. The longer, the more noise gets in; motion blur at 0.5 m/s over 20 ms is 0.17 each way.
REACHES = ((0.18, 0.3), (0.35, 0.2), (0.52, 0.15))
REACH_MIN_PX = 1.6
# A ray counts when its step is this share of the disc's typical one, and its edge within the profile.
STEP_SHARE = 0.3
SHIFT_SHARE = 0.8
RESPONSE_MIN_DN = 6.0
GAIN_MIN = 0.02


@dataclass(frozen=True, slots=True)
class Edges:
    """Edges along the profiles of both discs, all (2, RAYS) but `typical_dn` (2,).

    `shift` is in samples, outwards; `gain` what a shift of the disc by one sample does to it;
    `noise` its standard deviation for a noise of 1 DN; `typical_dn` the response of the discs.
    """

    shift: Floats
    gain: Floats
    noise: Floats
    usable: Mask
    typical_dn: Floats


class Profiles:
    """The sums that turn profiles of both discs into edges; `radius_px` is that of a typical disc.

    A profile has 2 `half` + 1 samples about a px apart; `edge` of them, on each side of its middle,
    are the longest reach; `own` and `ground` are those next to the rim, inside and outside.
    """

    def __init__(self, radius_px: float) -> None:
        self._edge = [math.ceil(max(reach * radius_px, REACH_MIN_PX)) for reach, _ in REACHES]
        self._level = [max(2, round(level * radius_px)) for _, level in REACHES]
        self.edge = self._edge[-1]
        self.half = max(e + n for e, n in zip(self._edge, self._level, strict=True)) + 1
        self._sums = self._sums_of()
        ray = np.arange(RAYS)
        apart = np.abs((ray[:, None] - ray + RAYS // 2) % RAYS - RAYS // 2)
        self._smooth = ((apart <= LEVEL_RAYS // 2) / LEVEL_RAYS).astype(np.float32)
        self._about = ((apart <= GAIN_RAYS // 2) / GAIN_RAYS).astype(np.float32)
        self.ground = slice(self.half + self._edge[0] + 1, self.half + self._edge[0] + 3)
        self.own = slice(self.half - self._edge[0] - 2, self.half - self._edge[0])
        # Levels are shared by neighbouring rays, which does not average them over a whole disc.
        self._scatter = np.array([
            2.0 * e * math.sqrt(0.5 / e + 0.5 / n)
            for e, n in zip(self._edge, self._level, strict=True)
        ], np.float32)[:, None, None]  # fmt: skip
        self._all = np.arange(2 * RAYS)
        self._reach = np.array(self._edge, np.float32)[:, None, None]

    def _sums_of(self) -> Floats:
        """Return sums over a profile, (samples, lengths x 3 offsets x 3): inner, outer, between."""
        sums = np.zeros((2 * self.half + 1, len(REACHES), 3, 3), np.float32)
        for k, (edge, level) in enumerate(zip(self._edge, self._level, strict=True)):
            for j, offset in enumerate((0, -1, 1)):
                middle = self.half + offset
                sums[middle - edge - level : middle - edge, k, j, 0] = 1.0 / level
                sums[middle + edge + 1 : middle + edge + 1 + level, k, j, 1] = 1.0 / level
                sums[middle - edge : middle + edge + 1, k, j, 2] = 0.5 / edge
                sums[[middle - edge, middle + edge], k, j, 2] = 0.25 / edge
        return sums.reshape(2 * self.half + 1, -1)

    def edges(self, response: Floats) -> Edges:
        """Return the edges of profiles, (2, RAYS, samples), of the marks' responses."""
        sums = (response @ self._sums).reshape(2, RAYS, len(REACHES), 3, 3)
        sums = np.ascontiguousarray(sums.transpose(4, 2, 3, 0, 1))  # which, length, offset, disc
        inside = sums[0, :, 0]
        inner, outer = sums[:2] @ self._smooth
        rise = inner - outer
        swing = 2.0 * (sums[2] - outer) / np.maximum(rise, 1.0) - 1.0
        level, gain = _better_side(
            np.maximum(rise[:, 0] @ self._about, 1.0),
            ((swing[:, 1] - swing[:, 2]) * (0.5 * self._reach)) @ self._about,
        )
        gain = np.minimum(np.maximum(gain, GAIN_MIN), 1.0)
        noise = self._scatter / level
        best = np.argmax(gain / noise, axis=0).ravel()
        of = np.stack((rise[:, 0], inside, swing[:, 0] * self._reach, gain, noise))
        of = of.reshape(5, len(REACHES), 2 * RAYS)[:, best, self._all].reshape(5, 2, RAYS)
        step, own, shift, gain, noise = of
        typical = np.sort(own, axis=1)[:, (3 * RAYS) // 4]
        least = np.maximum(STEP_SHARE * typical, RESPONSE_MIN_DN)[:, None]
        room = (SHIFT_SHARE * self._reach.ravel())[best].reshape(2, RAYS)
        usable = (np.minimum(step, own) > least) & (np.abs(shift) < room)
        return Edges(shift, gain, noise, usable, typical)


def _better_side(level: Floats, gain: Floats) -> tuple[Floats, Floats]:
    """Return level and gain of each ray or of the one across the disc, where that rises more.

    Blur is the same on both sides; what covers one side is no blur.
    """
    level_across, gain_across = (
        values.reshape(-1, 2, 2, RAYS // 2)[:, :, ::-1].reshape(values.shape)
        for values in (level, gain)
    )
    here = level >= level_across
    return np.where(here, level, level_across), np.where(here, gain, gain_across)
