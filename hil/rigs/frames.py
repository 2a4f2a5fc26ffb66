"""Where camera frames come from on a rig in real time: a camera, a video file, or a served twin.

A source has a thread that fills a short queue and a file descriptor that becomes readable then,
so that one select covers port and camera.
"""

from __future__ import annotations

import contextlib
import json
import socket
import threading
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from hil.core.errors import BadInput, RigFault
from hil.core.rig import Frame
from hil.core.types import Pose, PoseMeasurement
from vision.frame_queue import FrameQueue

if TYPE_CHECKING:
    from hil.config.camera import CameraConfig
    from vision.sources import CameraControls

TWIN_PREFIX = "twin:"


class FrameSource(Protocol):
    """Camera frames as they arrive, in real time."""

    def fileno(self) -> int:
        """Return a descriptor that is readable while a frame is waiting."""

    def poll(self) -> Frame | None:
        """Return the oldest frame waiting, None if there is none; raises RigFault at the end."""

    def close(self) -> None:
        """Release the camera; safe to call twice."""


def open_source(text: str, wanted: CameraConfig | None = None) -> FrameSource:
    """Return the source that `--camera` names: INDEX, FILE or twin:SOCKET.

    A live camera is asked for the size, rate and controls `wanted`. Raises BadInput or RigFault.
    """
    size_px = (wanted.width_px, wanted.height_px) if wanted else None
    if text.startswith(TWIN_PREFIX):
        return SocketSource(text.removeprefix(TWIN_PREFIX), size_px)
    if text.isdigit():
        from vision.sources import LiveCamera  # noqa: PLC0415 - most runs have none

        return LiveCamera(int(text), controls_of(wanted))
    if Path(text).is_file():
        return CaptureSource(text, size_px)
    raise BadInput(
        f"camera {text!r}: neither a camera index, a video file nor twin:SOCKET; "
        "`hil doctor` lists the cameras"
    )


def wrong_size(have_px: tuple[int, int], wanted_px: tuple[int, int] | None) -> str:
    """Return what is wrong with the size of a delivered picture, "" for nothing.

    Lens and pose of a camera hold for one width and height, px.
    """
    if wanted_px is None or have_px == wanted_px:
        return ""
    return (
        f"pictures of {have_px[0]} x {have_px[1]} px, the lens is that of"
        f" {wanted_px[0]} x {wanted_px[1]} px; set camera.width_px and height_px with a lens"
        " calibrated at that size"
    )


def controls_of(wanted: CameraConfig | None) -> CameraControls:
    """Return what a live camera is set to for a run: nothing where none is described."""
    from vision.sources import CameraControls  # noqa: PLC0415 - most runs have none

    if wanted is None:
        return CameraControls()
    return CameraControls(
        wanted.width_px, wanted.height_px, wanted.rate_hz, **wanted.controls.model_dump()
    )


class CaptureSource:
    """A video file through OpenCV, played at its own rate; `t_cam_s` is the container's stamp.

    Raises BadInput where its pictures are not of `size_px`, width and height; None takes any.
    """

    def __init__(self, path: str, size_px: tuple[int, int] | None = None) -> None:
        import cv2  # noqa: PLC0415 - most runs have no camera and need not load the decoders

        self._name = f"camera {path}"
        self._capture = cv2.VideoCapture(path)
        if not self._capture.isOpened():
            raise BadInput(f"{self._name}: not a video OpenCV can read")
        # A rotation tag turns the picture and not the lens.
        self._capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0.0)
        have = tuple(
            round(self._capture.get(key))
            for key in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)
        )
        if why := wrong_size((have[0], have[1]), size_px):
            self._capture.release()
            raise BadInput(f"{self._name}: {why}")
        self._stamp_property = cv2.CAP_PROP_POS_MSEC
        self._queue = FrameQueue()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        start_s = time.monotonic()
        index = 0
        while not self._stop.is_set():
            done, image = self._capture.read()
            if not done or image is None:
                self._queue.fail(f"{self._name}: end of file after {index} frames")
                return
            stamp_s = self._capture.get(self._stamp_property) * 1e-3
            self._stop.wait(start_s + stamp_s - time.monotonic())
            self._queue.put(Frame(index, stamp_s, np.asarray(image, np.uint8)))
            index += 1

    def fileno(self) -> int:
        """Return a descriptor that is readable while a frame is waiting."""
        return self._queue.fileno()

    def poll(self) -> Frame | None:
        """Return the oldest frame waiting; raises RigFault at the end of the file."""
        return self._queue.poll()

    def close(self) -> None:
        """Stop the thread and release the camera."""
        self._stop.set()
        self._thread.join(timeout=2.0)
        self._capture.release()
        self._queue.close()


def encode_frame(frame: Frame) -> bytes:
    """Return a frame for the socket: one line of JSON, then the image's bytes, row by row."""
    head: dict[str, Any] = {"index": frame.index, "t_cam_s": frame.t_cam_s}
    body = b""
    if frame.image is not None:
        head["shape"] = list(frame.image.shape)
        body = frame.image.tobytes()
    if frame.pose is not None:
        head["pose"] = asdict(frame.pose)
    return json.dumps(head).encode() + b"\n" + body


def _decode_head(line: bytes) -> tuple[dict[str, Any], int]:
    """Return the header and the number of image bytes that follow it."""
    head = json.loads(line)
    shape = head.get("shape")
    return head, shape[0] * shape[1] * shape[2] if shape else 0


def _decode_frame(head: dict[str, Any], body: bytes) -> Frame:
    image = np.frombuffer(body, np.uint8).reshape(head["shape"]) if body else None
    measurement = None
    if "pose" in head:
        fields = dict(head["pose"])
        pose, covariance = fields.pop("pose"), fields.pop("covariance", None)
        if covariance is not None:
            fields["covariance"] = tuple(covariance)
        measurement = PoseMeasurement(pose=Pose(**pose) if pose else None, **fields)
    return Frame(head["index"], head["t_cam_s"], image, measurement)


class SocketSource:
    """The frames of a served twin, from its Unix socket; of `size_px`, else it is a rig fault."""

    def __init__(self, path: str, size_px: tuple[int, int] | None = None) -> None:
        self._size_px = size_px
        self._name = f"camera {TWIN_PREFIX}{path}"
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._socket.connect(path)
        except OSError as error:
            self._socket.close()
            raise RigFault(
                f"{self._name}: {error.strerror}; start `hil twin serve` first"
            ) from None
        self._queue = FrameQueue()
        self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        with self._socket.makefile("rb") as stream:
            try:
                while line := stream.readline():
                    head, length = _decode_head(line)
                    if "shape" in head:
                        height, width, _ = head["shape"]
                        if why := wrong_size((width, height), self._size_px):
                            self._queue.fail(f"{self._name}: {why}")
                            return
                    self._queue.put(_decode_frame(head, stream.read(length)))
            except (OSError, ValueError) as error:
                self._queue.fail(f"{self._name}: {error}")
                return
        self._queue.fail(f"{self._name}: the twin closed the socket")

    def fileno(self) -> int:
        """Return a descriptor that is readable while a frame is waiting."""
        return self._queue.fileno()

    def poll(self) -> Frame | None:
        """Return the oldest frame waiting; raises RigFault when the twin is gone."""
        return self._queue.poll()

    def close(self) -> None:
        """Close the socket and end the thread."""
        with contextlib.suppress(OSError):  # the twin may have closed it first
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()
        self._thread.join(timeout=2.0)
        self._queue.close()
