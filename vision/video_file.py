"""A video file as frames with their stamps."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from hil.core.errors import BadInput
from hil.core.rig import Frame
from vision import cv_compat  # noqa: F401 - quiets the video backend before it opens a file
from vision.container import missing_bytes
from vision.picture_file import HEADER_BYTES, SIDE_MAX_PX, check_size, read_header

FRAMES_TABLE = "frames.parquet"
USUAL_RATE_HZ = 30.0
RATE_FRAMES = 60
RATE_TOLERANCE = 0.03
# Stamps may stand still or fall back by a few frames; further back, another recording begins.
FALL_BACK_MAX_S = 1.0


class VideoFile:
    """The frames of a video with their stamps, in the sensor's own axes.

    Stamps come from `frames.parquet` beside the file (a run record), else from the container. A
    frame that carries the stamp of the one before (browsers record such) has no time of its own: it
    is left out and counted in `unstamped`.
    """

    def __init__(self, path: Path) -> None:
        if not path.is_file():
            raise BadInput(f"{path}: no such video file")
        self.path = path
        self.unstamped = 0
        self._capture = _opened(path)
        self.width_px = round(self._capture.get(cv2.CAP_PROP_FRAME_WIDTH))
        self.height_px = round(self._capture.get(cv2.CAP_PROP_FRAME_HEIGHT))
        if max(self.width_px, self.height_px) > SIDE_MAX_PX:
            raise BadInput(
                f"{path}: video of {self.width_px} x {self.height_px} px, the limit is"
                f" {SIDE_MAX_PX} px each way"
            )
        announced_hz = self._capture.get(cv2.CAP_PROP_FPS)
        self._announced_hz = announced_hz if 0.0 < announced_hz < 1e4 else USUAL_RATE_HZ
        self._rate_hz = math.nan
        self._stamps = _recorded_stamps(path)
        with path.open("rb") as file:
            self._is_avi = file.read(12)[8:] == b"AVI "
        announced = int(self._capture.get(cv2.CAP_PROP_FRAME_COUNT))
        self.count = len(self._stamps) or max(0, announced)

    @property
    def rate_hz(self) -> float:
        """The frame rate: the container's where its first frames agree with it, else theirs."""
        if math.isnan(self._rate_hz):
            stamps_s = self._first_stamps()
            self._rate_hz = self._announced_hz
            if len(stamps_s) > 1:
                seen_hz = (len(stamps_s) - 1) / (stamps_s[-1] - stamps_s[0])
                if abs(seen_hz / self._announced_hz - 1.0) > RATE_TOLERANCE:
                    self._rate_hz = seen_hz
        return self._rate_hz

    def _first_stamps(self) -> list[float]:
        """Return the stamps that differ of the first frames, s."""
        if self._stamps:
            return sorted(set(self._stamps[:RATE_FRAMES]))
        capture = _opened(self.path)
        stamps_s = set()
        for _ in range(RATE_FRAMES):
            if not capture.grab():
                break
            stamps_s.add(float(capture.get(cv2.CAP_PROP_POS_MSEC)) * 1e-3)
        capture.release()
        return sorted(stamps_s)

    def frames(self) -> Iterator[Frame]:
        """Yield every frame; raises BadInput at the end of a file that holds less than it says."""
        index, previous_s, stamped = 0, -math.inf, True
        while True:
            done, image = self._capture.read()
            if not done or image is None:
                break
            stamp_s = self._stamp_s(index)
            if index == 1 and stamp_s <= previous_s:
                stamped = len(self._first_stamps()) > 1
            # Decoders that give frames back in another order have no stamp for the last ones of an AVI.
            lost = self._is_avi and stamp_s == 0.0 < previous_s
            if not stamped or lost or (self._stamps and index >= len(self._stamps)):
                stamp_s = previous_s + 1.0 / self.rate_hz
            if stamp_s < previous_s - FALL_BACK_MAX_S:
                raise BadInput(
                    f"{self.path}: stamps fall back from {previous_s:.2f} to {stamp_s:.2f} s at"
                    f" frame {index}: two recordings in one file? Cut it there"
                )
            if stamp_s > previous_s:
                previous_s = stamp_s
                yield Frame(index, stamp_s, np.asarray(image, dtype=np.uint8))
            else:
                self.unstamped += 1
            index += 1
        self._require_whole(index, previous_s)

    def _require_whole(self, read: int, last_s: float) -> None:
        lacking = missing_bytes(self.path)
        short = bool(self._stamps) and read < self.count - 1
        if read == 0 or lacking or short:
            count = self.count if self.count > read else "some"
            raise BadInput(
                f"{self.path}: cut off: {read} of {count} frames can be read"
                f" ({max(0.0, last_s):.2f} s); copy it again, or write what is there anew with"
                " ffmpeg -i FILE -c copy NEW"
            )

    def _stamp_s(self, index: int) -> float:
        if index < len(self._stamps):
            return self._stamps[index]
        return float(self._capture.get(cv2.CAP_PROP_POS_MSEC)) * 1e-3

    def close(self) -> None:
        """Release the file."""
        self._capture.release()


def _opened(path: Path) -> cv2.VideoCapture:
    """Return the opened file; a rotation tag turns the picture and not the lens: not followed."""
    with path.open("rb") as file:
        header = read_header(file.read(HEADER_BYTES))
    if header is not None:
        check_size(header, str(path))
    capture = cv2.VideoCapture(str(path))
    if not capture.isOpened():
        raise BadInput(f"{path}: not a video OpenCV can read, or cut off before its first frame")
    capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0.0)
    return capture


def _recorded_stamps(video: Path) -> list[float]:
    """Return the camera stamps that a run record keeps beside its video; none elsewhere."""
    table = video.with_name(FRAMES_TABLE)
    if not table.is_file():
        return []
    import pyarrow.parquet  # noqa: PLC0415 - only for videos of run records

    try:
        column = pyarrow.parquet.read_table(table, columns=["t_cam_s"]).column("t_cam_s")
    except (OSError, pyarrow.ArrowException, KeyError) as error:
        raise BadInput(f"{table}: cannot be read: {error}") from None
    return [float(value) for value in column.to_pylist()]
