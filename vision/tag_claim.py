"""How sure the outline of a tag is: the fit's own information times what its edges are off it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hil.core.types import Covariance

Array = NDArray[np.float64]

# What moves a side or turns it varies slowly along it, as does noise whose grain is larger than an edge
# (pixels that edges share, blocks of a JPEG, the sides' own lean on the pixels): in the residual that is what
# is left of polynomials of order 1 to SLOW along each side, less the turn, which the fit has taken up. Of
# order 0 the size alone is left, which blur changes and which moves nothing.
SLOW = 5
SLOW_FREE = 4 * SLOW - 1
# How much more of it there is in orders 0 and 1 than is left in those: frames of 1280 x 720, both views, 24
# each of moderate, noise, clean, gradient and JPEG, seed 101.
COARSER = 1.2
PAIR_TAKEN = 2  # numbers that the fit takes from a pair of opposite sides: where they are, and their distance


def covariance_m2(
    information: Array, rest_m: Array, side: NDArray[np.intp], along: Array, free_m: float
) -> Array:
    """Return that of (dx, dy, dtheta), (3, 3), in the tag's frame, from the N edges that were kept.

    `information` is the fit's matrix, (N, 4), a row an edge, `rest_m` how far each is off the fit, m, `side`
    the number of its side, 0 to 3 round the tag, `along` its place there, -1 to 1, and `free_m` what pixels
    leave unknown of an edge without noise. Blur and a slanting view leave the edges of one pair of sides
    less certain than those of the other: each pair has the noise that is left in it.
    """
    noise = np.empty(len(rest_m))
    for pair in (0, 1):
        of_pair = side % 2 == pair
        free = max(int(of_pair.sum()) - PAIR_TAKEN, 1)
        noise[of_pair] = rest_m[of_pair] @ rest_m[of_pair] / free
    even = rest_m / np.sqrt(np.maximum(noise, 1e-18))
    slow = sum(_slow(even[side == k], along[side == k]) for k in range(4)) / SLOW_FREE
    weights = np.linalg.pinv(information)
    whole = (weights * (COARSER * max(slow, 1.0) * noise + free_m**2)) @ weights.T
    return np.asarray(whole[:3, :3], np.float64)


def _slow(rest: Array, along: Array) -> float:
    """Return the square of what varies slowly along one side."""
    if len(rest) <= SLOW:
        return float(SLOW)
    basis, _ = np.linalg.qr(np.polynomial.legendre.legvander(along, SLOW))
    return float(np.sum((basis[:, 1:].T @ rest) ** 2))


def of_body(tag_m2: Array, theta_rad: float, x_m: float, y_m: float) -> Covariance:
    """Return the covariance of the robot's pose, world axes, for that of a tag at (x_m, y_m) on it."""
    c, s = math.cos(theta_rad), math.sin(theta_rad)
    turned = np.array([[c, -s, s * x_m + c * y_m], [s, c, s * y_m - c * x_m], [0.0, 0.0, 1.0]])
    whole = turned @ tag_m2 @ turned.T
    return (
        float(whole[0, 0]), float(whole[0, 1]), float(whole[0, 2]),
        float(whole[1, 1]), float(whole[1, 2]), float(whole[2, 2]),
    )  # fmt: skip
