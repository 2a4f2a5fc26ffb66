"""How old a frame is when it reaches the host, from a light that the host switches.

The host turns a light on and off at known times and notes when each frame arrives and how bright
the light is in it. Middle of exposure and arrival differ by the latency that makes the brightness
follow the switching best. What the light itself takes (a screen 10 to 40 ms, an LED nothing) is
part of the figure: subtract it where it is known.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hil.core.errors import BadInput
from hil.core.wording import past

Array = NDArray[np.float64]

LATENCY_MAX_S = 0.5
STEP_S = 0.0005
EDGES_MIN = 6
CONTRAST_MIN_DN = 10.0
CORRELATION_MIN = 0.9


@dataclass(frozen=True, slots=True)
class Latency:
    """Exposure-to-arrival latency, its standard deviation, and the true frame rate.

    `correlation` of brightness with switching is 1 for a perfect sight of the light.
    """

    latency_s: float
    sigma_s: float
    rate_hz: float
    correlation: float


def measure_latency(
    edges_s: ArrayLike, arrivals_s: ArrayLike, levels_dn: ArrayLike, exposure_s: float = 0.0
) -> Latency:
    """Return the latency from switching times and the brightness of frames; raises BadInput.

    The light goes on at edges_s[0], off at edges_s[1] and so on, (E,) host times; frames arrive at
    arrivals_s with the mean level levels_dn of the light's place, both (N,).
    """
    edges = np.asarray(edges_s, dtype=np.float64)
    arrivals = np.asarray(arrivals_s, dtype=np.float64)
    levels = np.asarray(levels_dn, dtype=np.float64)
    if len(edges) < EDGES_MIN or len(arrivals) < 2 * EDGES_MIN:
        raise BadInput(
            f"latency: {len(edges)} switchings and {len(arrivals)} frames, at least {EDGES_MIN} and"
            f" {2 * EDGES_MIN} are needed"
        )
    contrast = float(np.quantile(levels, 0.9) - np.quantile(levels, 0.1))
    if contrast < CONTRAST_MIN_DN:
        raise BadInput(
            f"latency: the light changes by {past(contrast, CONTRAST_MIN_DN, '.0f')} DN in the image, limit"
            f" {CONTRAST_MIN_DN:.0f} DN; point the camera at it and darken the room"
        )
    shifts = np.arange(0.0, LATENCY_MAX_S, STEP_S)
    scores = np.array(
        [_correlation(edges, arrivals - shift, levels, exposure_s) for shift in shifts]
    )
    best = int(np.argmax(scores))
    if scores[best] < CORRELATION_MIN:
        raise BadInput(
            "latency: brightness follows the switching with a correlation of"
            f" {past(scores[best], CORRELATION_MIN, '.2f')}, limit {CORRELATION_MIN};"
            " is the light what fills the image's centre?"
        )
    # Between exposures nothing is seen: equally good shifts form a plateau, whose middle is taken.
    plateau = shifts[scores > scores[best] - 1e-3 * (1.0 - scores.min())]
    return Latency(
        float(plateau.mean()),
        float(max(np.ptp(plateau) / np.sqrt(12.0), STEP_S)),
        1.0 / float(np.median(np.diff(arrivals))),
        float(scores[best]),
    )


def _correlation(edges: Array, exposed_s: Array, levels: Array, exposure_s: float) -> float:
    """Return how well levels follow the share of each exposure during which the light was on."""
    half = 0.5 * max(exposure_s, 1e-6)
    lit = (_on_time(edges, exposed_s + half) - _on_time(edges, exposed_s - half)) / (2.0 * half)
    if np.ptp(lit) == 0.0:
        return 0.0
    return float(np.corrcoef(lit, levels)[0, 1])


def _on_time(edges: Array, t_s: Array) -> Array:
    """Return the time the light has been on until t_s."""
    durations = np.diff(edges, append=edges[-1])
    durations[1::2] = 0.0
    before = np.concatenate(([0.0], np.cumsum(durations)))
    index = np.searchsorted(edges, t_s, side="right")
    running = np.where(index % 2 == 1, t_s - edges[np.maximum(index - 1, 0)], 0.0)
    done = before[np.maximum(index - (index % 2), 0)]
    total: Array = done + running
    return total


def switching_times(start_s: float, count: int, rng: np.random.Generator) -> Array:
    """Return `count` times 0.25 to 0.55 s apart: uneven, so that no shift fits but the true one."""
    gaps: Array = rng.uniform(0.25, 0.55, count)
    return start_s + np.cumsum(gaps)
