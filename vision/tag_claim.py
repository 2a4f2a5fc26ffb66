"""How sure the outline of a tag is: the fit's own information times what its edges are off it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hil.core.types import Covariance

Array = NDArray[np.float64]

# How much more of the noise moves a whole side than is left in its edges, which share pixels; of frames of
# 1280 x 720, both views, 24 each, seed 101.
SHARED = 1.2
SIDES = 2  # offsets of a pair of opposite sides, which the fit takes up


def covariance_m2(information: Array, rest_m: Array, across: Array, free_m: float) -> Array:
    """Return that of (dx, dy, dtheta), (3, 3), in the tag's frame, from the edges that were kept.

    `information` is the fit's matrix, (N, 4), a row an edge, `rest_m` how far each is off the fit, m,
    `across` which of them lie on the sides ahead and behind, and `free_m` what pixels leave unknown
    of an edge without noise.
    Blur and a slanting view leave the edges of one pair of sides less certain than those of the other:
    each pair has the noise that is left in it.
    """
    variance = np.empty(len(rest_m))
    for pair in (across, ~across):
        free = max(int(pair.sum()) - SIDES, 1)
        noise = float(rest_m[pair] @ rest_m[pair]) / free
        variance[pair] = SHARED * noise + free_m**2
    weights = np.linalg.pinv(information)
    whole = (weights * variance) @ weights.T
    return np.asarray(whole[:3, :3], np.float64)


def of_body(tag_m2: Array, theta_rad: float, x_m: float, y_m: float) -> Covariance:
    """Return the covariance of the robot's pose, world axes, for that of a tag at (x_m, y_m) on it."""
    c, s = math.cos(theta_rad), math.sin(theta_rad)
    turned = np.array([[c, -s, s * x_m + c * y_m], [s, c, s * y_m - c * x_m], [0.0, 0.0, 1.0]])
    whole = turned @ tag_m2 @ turned.T
    return (
        float(whole[0, 0]), float(whole[0, 1]), float(whole[0, 2]),
        float(whole[1, 1]), float(whole[1, 2]), float(whole[2, 2]),
    )  # fmt: skip
