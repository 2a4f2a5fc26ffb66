"""Keeps camera images of a run: a few JPEG pictures always, every frame when asked for.

Encoding happens on one thread of its own, so that the control loop only hands a reference over.
"""

from __future__ import annotations

import queue
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from hil.core.errors import RecordFault
from hil.core.rig import whole
from hil.record.reader import picture_name

if TYPE_CHECKING:
    import cv2
    import numpy as np
    from numpy.typing import NDArray

    from hil.core.rig import Picture

    Image = NDArray[np.uint8]

# Lossless, or a replay of the frames would not be exact. HuffYUV codes a 640 x 480 frame in about
# 3 ms where FFV1, a third smaller, takes 20 ms: too long beside a control loop on one core.
_CODEC = "HFYU"
# With losses: JPEG pictures of this quality, a sixth of the size (docs/run-record.md). A replay does
# not look at them.
_SMALL_CODEC = "MJPG"
_SMALL_QUALITY = 95
_JPEG_QUALITY = 80
_QUEUE_FRAMES = 256


class CameraKeeper:
    """Takes every frame; writes a JPEG per `picture_period_s`, and of the last frame, to `folder`.

    With `video` set, every frame also goes to that file, in order: frame k of the video belongs to
    row k of frames.parquet. It is lossless, or motion JPEG when its name ends in .avi. Images handed
    over must not be changed afterwards.
    """

    def __init__(
        self, folder: Path, picture_period_s: float, rate_hz: float, video: Path | None
    ) -> None:
        folder.mkdir()
        self._folder = folder
        self._period_s = picture_period_s
        self._rate_hz = rate_hz
        self._video_path = video
        self._writer: cv2.VideoWriter | None = None
        self._next_picture_s = float("-inf")
        self._newest: tuple[float, Picture] | None = None
        self.error = ""
        self._queue: queue.Queue[tuple[float, Image, bool] | None] = queue.Queue(_QUEUE_FRAMES)
        self._thread = threading.Thread(target=self._work, name="camera-keeper", daemon=True)
        self._thread.start()

    def take(self, t_s: float, image: Picture) -> None:
        """Hand one frame over; waits only when the encoder is 256 frames behind."""
        keep = t_s >= self._next_picture_s
        if keep:
            self._next_picture_s = t_s + self._period_s
        self._newest = None if keep else (t_s, image)
        if keep or self._video_path is not None:
            self._queue.put((t_s, whole(image), keep))

    def close(self) -> None:
        """Encode what is waiting and the newest frame; raises RecordFault when the video failed."""
        if not self._thread.is_alive():
            return
        self._queue.put(None)
        self._thread.join()
        if self._newest is not None:
            t_s, image = self._newest
            self._keep(t_s, whole(image))
        if self.error:
            raise RecordFault(self.error)

    def _work(self) -> None:
        item = self._queue.get()
        if item is not None:
            import cv2  # noqa: PLC0415 - a tenth of a second, where there are pictures only
        while item is not None:
            try:
                self._work_on(*item)
            except cv2.error as error:  # the control loop must not wait for a thread that has died
                self.error = self.error or f"pictures: {' '.join(str(error).split())}"
            item = self._queue.get()
        if self._writer is not None:
            self._writer.release()

    def _work_on(self, t_s: float, image: Image, keep: bool) -> None:
        if keep:
            self._keep(t_s, image)
        if self._video_path is not None and not self.error:
            self._write_video(self._video_path, image)

    def _keep(self, t_s: float, image: Image) -> None:
        import cv2  # noqa: PLC0415 - as above

        path = self._folder / picture_name(t_s)
        if not cv2.imwrite(str(path), image, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY]):
            self.error = self.error or f"{path}: the picture cannot be written; disk full?"

    def _write_video(self, path: Path, image: Image) -> None:
        import cv2  # noqa: PLC0415 - as above

        if self._writer is None:
            height, width = image.shape[:2]
            small = path.suffix == ".avi"
            codec = _SMALL_CODEC if small else _CODEC
            code = cv2.VideoWriter.fourcc(*codec)
            system = cv2.CAP_OPENCV_MJPEG if small else cv2.CAP_ANY
            size = (width, height)
            self._writer = cv2.VideoWriter(str(path), system, code, self._rate_hz, size)
            if not self._writer.isOpened():
                self.error = f"{path}: the video cannot be written ({codec}); run without it"
                return
            if small:
                self._writer.set(cv2.VIDEOWRITER_PROP_QUALITY, _SMALL_QUALITY)
        self._writer.write(image)
