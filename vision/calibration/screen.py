"""The terminal as a light for the latency measurement: white and black by escape sequences."""

from __future__ import annotations

import sys
import time

import numpy as np

from hil.core.errors import BadInput
from vision.calibration.latency import switching_times
from vision.sources import LiveCamera

SWITCHINGS = 30
SETTLE_S = 1.0
WHITE, BLACK, RESET = "\x1b[107m\x1b[2J", "\x1b[40m\x1b[2J", "\x1b[0m\x1b[2J\x1b[H"


def watch_blinking_terminal(index: int) -> tuple[list[float], list[float], list[float]]:
    """Blink and watch; return switching times, frame arrivals (host, s) and brightness (DN).

    Raises BadInput where stderr is no terminal.
    """
    if not sys.stderr.isatty():
        raise BadInput("latency: stderr is no terminal, so there is nothing to blink with")
    camera = LiveCamera(index)
    planned = switching_times(time.monotonic() + SETTLE_S, SWITCHINGS, np.random.default_rng(1))
    edges_s: list[float] = []
    arrivals_s: list[float] = []
    levels_dn: list[float] = []
    try:
        while len(edges_s) < SWITCHINGS or time.monotonic() < edges_s[-1] + SETTLE_S:
            now_s = time.monotonic()
            if len(edges_s) < SWITCHINGS and now_s >= planned[len(edges_s)]:
                sys.stderr.write(BLACK if len(edges_s) % 2 else WHITE)
                sys.stderr.flush()
                edges_s.append(time.monotonic())
            frame = camera.poll()
            if frame is None or frame.image is None:
                time.sleep(0.0005)
                continue
            arrivals_s.append(time.monotonic())
            height, width = frame.image.shape[:2]
            middle = frame.image[height // 3 : 2 * height // 3, width // 3 : 2 * width // 3]
            levels_dn.append(float(middle.mean()))
    finally:
        sys.stderr.write(RESET)
        sys.stderr.flush()
        camera.close()
    return edges_s, arrivals_s, levels_dn
