"""What leaves a run for the page: bounded, the newest only, and never waited for by the control loop.

The loop's thread puts references into a few slots and goes on. A thread of its own empties them some 15
times a second and writes them to a pipe; while the pipe is full it waits there, and what is overtaken
meanwhile is dropped. A message is a kind byte, its length, and its bytes.
"""

from __future__ import annotations

import json
import math
import struct
import threading
import time
from array import array
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, BinaryIO

import cv2

from hil.control.references import make_reference
from hil.record.schema import FRAME_NAMES
from hil.runs.orders import OperatorOrders

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hil.config.scenario import Scenario
    from hil.runs.parts import Parts

# Kinds: JSON, rows of samples (float64), a camera picture (JPEG) behind its frame's row.
JSON, ROWS, PICTURE = b"J", b"R", b"I"
HEAD = struct.Struct("<cI")
FRAME_LENGTH = struct.Struct("<I")
RATE_HZ = 15.0
_PICTURES_HZ = 6.0
_PICTURE_WIDTH_PX = 480
_JPEG_QUALITY = 70
# Rows and events kept for a page that does not come; a minute of ticks.
_ROWS, _EVENTS = 1800, 200
_REFERENCE_POINTS = 240


class HandOver:
    """Watches a run (`hil.runs.watched.Watch`) and sends what it sees to `out`.

    `real_time` holds a simulated run back so that one second of it takes one second to watch; the
    simulated clock, and with it the record, does not know.
    """

    def __init__(self, out: BinaryIO, real_time: bool) -> None:
        self._out = out
        self._real_time = real_time
        self._rows: deque[Sequence[float]] = deque(maxlen=_ROWS)
        self._events: deque[tuple[float, str, str]] = deque(maxlen=_EVENTS)
        self._notes: deque[tuple[str, str]] = deque(maxlen=20)
        self._frame: tuple[Sequence[float], NDArray[np.uint8] | None] | None = None
        self._sigma: list[float] | None = None
        self._parts: Parts | None = None
        self._changed: Mapping[str, float] = {}
        self._holding = False
        self._covariance: Callable[[], Any] | None = None
        self._start_s = 0.0
        self._ended = threading.Event()
        self._write_lock = threading.Lock()  # of the sending thread and `say`, never of the loop
        self._next_picture_s = 0.0
        self._thread = threading.Thread(target=self._send, name="hand-over", daemon=True)
        self._thread.start()

    # -- in the control loop -------------------------------------------------------------------

    def began(self, parts: Parts) -> None:
        """Take the estimator, whose covariance is shown where it has one, and the frames before the start."""
        self._parts = parts
        parts.timeline.early = self.frame
        estimator: Any = parts.estimator
        if hasattr(type(estimator), "covariance"):
            self._covariance = lambda: estimator.covariance

    def tick(self, row: Sequence[float]) -> None:
        """Take a tick; with `real_time`, wait until it is due on the wall's clock."""
        self._rows.append(row)
        if self._covariance is not None and self._sigma is None:
            p = self._covariance()
            self._sigma = [float(p[0][0]), float(p[0][1]), float(p[1][1]), float(p[2][2])]
        if self._real_time:
            now_s = time.monotonic()
            self._start_s = self._start_s or now_s - row[0]
            if (ahead_s := self._start_s + row[0] - now_s) > 0.0:
                time.sleep(ahead_s)

    def frame(self, row: Sequence[float], image: NDArray[np.uint8] | None) -> None:
        """Take a frame; it replaces one that was not sent yet."""
        self._frame = (row, image)

    def event(self, t_s: float, kind: str, text: str) -> None:
        """Take an event."""
        self._events.append((t_s, kind, text))

    def notes(self) -> Sequence[tuple[str, str]]:
        """Return what the operator did since the last call."""
        found = []
        while self._notes:
            found.append(self._notes.popleft())
        return found

    # -- beside it -----------------------------------------------------------------------------

    def note(self, kind: str, text: str) -> None:
        """Have something written into the run's events."""
        self._notes.append((kind, text))

    def say(self, **message: Any) -> None:
        """Send one JSON message at once."""
        self._write(JSON, json.dumps(message).encode())

    def close(self) -> None:
        """Send what is left."""
        self._ended.set()
        self._thread.join(timeout=5.0)

    def _send(self) -> None:
        try:
            while not self._ended.wait(1.0 / RATE_HZ):
                self._send_newest()
            self._send_newest()
        except OSError:
            return  # nobody reads any more; the run goes on, or is stopped by the closed command pipe

    def _send_orders(self) -> None:
        """Send the robot as found while it waits to be armed, and the values that were changed."""
        parts = self._parts
        if parts is None or not isinstance(parts.orders, OperatorOrders):
            return
        orders, link = parts.orders, parts.link
        if orders.holding:
            frame = self._frame
            seen = dict(zip(FRAME_NAMES, frame[0], strict=True)) if frame is not None else {}
            pose = [seen.get(name, math.nan) for name in ("x_m", "y_m", "theta_rad")]
            board = link.info.build_id if link.info is not None else ""
            self.say(found={"pose": pose, "battery_v": link.battery_v, "firmware": board})
        elif self._holding:
            self.say(armed=True)
        self._holding = orders.holding
        if orders.changed is not self._changed:
            self._changed = orders.changed
            self.say(tuned=dict(self._changed))

    def _send_newest(self) -> None:
        self._send_orders()
        rows = array("d")
        while self._rows:
            rows.extend(self._rows.popleft())
        sigma, self._sigma = self._sigma, None
        if sigma is not None and rows:
            self.say(sigma=sigma)  # before the rows it goes with: a short run has no later ones
        if rows:
            self._write(ROWS, rows.tobytes())
        events = []
        while self._events:
            events.append(self._events.popleft())
        if events:
            self.say(events=events)
        now_s = time.monotonic()
        if now_s >= self._next_picture_s and self._frame is not None:
            (row, image), self._frame = self._frame, None
            self._next_picture_s = now_s + 1.0 / _PICTURES_HZ
            packed = array("d", row).tobytes()
            picture = b"" if image is None else jpeg(image)
            self._write(PICTURE, FRAME_LENGTH.pack(len(packed)) + packed + picture)

    def _write(self, kind: bytes, body: bytes) -> None:
        with self._write_lock:
            self._out.write(HEAD.pack(kind, len(body)) + body)
            self._out.flush()


def jpeg(image: NDArray[np.uint8]) -> bytes:
    """Return a picture as JPEG, no wider than a page shows it."""
    height, width = image.shape[:2]
    if width > _PICTURE_WIDTH_PX:
        size = (_PICTURE_WIDTH_PX, round(height * _PICTURE_WIDTH_PX / width))
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)  # type: ignore[assignment]
    done, packed = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    return packed.tobytes() if done else b""


def floor_of(scenario: Scenario) -> dict[str, Any]:
    """Return what the page draws once: fence and start (m, rad), and the reference's path (m)."""
    safety, start = scenario.safety, scenario.start
    reference = make_reference(scenario.reference)
    count = _REFERENCE_POINTS
    path = [reference.at(scenario.duration_s * k / count).z1_m for k in range(count + 1)]
    return {
        "fence": [
            safety.fence_x_min_m, safety.fence_x_max_m, safety.fence_y_min_m, safety.fence_y_max_m
        ],
        "start": [start.x_m, start.y_m, start.theta_rad],
        "reference": path,
        "camera": [scenario.camera.width_px, scenario.camera.height_px],
        "duration_s": scenario.duration_s,
        "robot": [scenario.robot.track_m, scenario.robot.wheel_radius_m],
        "battery_low_v": scenario.board.get("BATT_MIN"),
    }  # fmt: skip
