"""Where real frames come from: a live camera, a video file with time stamps, a folder of images.

A V4L2 camera hands out the oldest frame of its queue first: a reader that comes back late gets
frames that are several periods old without a sign of it. So one thread empties the queue all the
time, the frames that lie in it at the start are thrown away, and each frame carries the driver's
stamp where there is one (else the time at which grab returned), never the time of decoding.
"""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from hil.core.errors import BadInput, RigFault
from hil.core.rig import Frame
from hil.core.wording import past
from vision import cv_compat
from vision.camera_watch import FrameWatch
from vision.frame_queue import FrameQueue
from vision.video_file import VideoFile as VideoFile  # noqa: PLC0414 - beside the other sources

Image = NDArray[np.uint8]

STALL_S = 0.2
START_S = 3.0
SETTLE_FRAMES = 20
STALE_FRAMES_MAX = 10
REOPEN_S = 0.2  # between two tries to open a camera that is gone
# A control within this of what was asked for is it: drivers work in steps of their own.
CONTROL_RATIO = 0.02
# Driver stamps are believed when they lie this close before the time at which grab returned.
STAMP_AGE_MAX_S = 1.0


class Capture(Protocol):
    """The part of cv2.VideoCapture that is used."""

    def isOpened(self) -> bool: ...  # noqa: N802, D102 - OpenCV's names
    def grab(self) -> bool: ...  # noqa: D102
    def retrieve(self) -> tuple[bool, Any]: ...  # noqa: D102
    def get(self, key: int) -> float: ...  # noqa: D102
    def set(self, key: int, value: float) -> bool: ...  # noqa: D102
    def release(self) -> None: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class CameraControls:
    """What a live camera is set to; None leaves size and rate, or locks what automatics chose."""

    width_px: int | None = None
    height_px: int | None = None
    rate_hz: float | None = None
    exposure: float | None = None
    gain: float | None = None
    white_balance_k: float | None = None
    focus: float | None = None
    raw: bool = False  # uncompressed pictures and not motion JPEG


# control -> (automatic's property, its value for off, the property locked); V4L2's meanings.
LOCKS = {
    "exposure": (cv2.CAP_PROP_AUTO_EXPOSURE, 1.0, cv2.CAP_PROP_EXPOSURE),
    "white_balance_k": (cv2.CAP_PROP_AUTO_WB, 0.0, cv2.CAP_PROP_WB_TEMPERATURE),
    "focus": (cv2.CAP_PROP_AUTOFOCUS, 0.0, cv2.CAP_PROP_FOCUS),
    "gain": (None, 0.0, cv2.CAP_PROP_GAIN),
}


class LiveCamera:
    """A camera in real time, as `hil.rigs.frames.FrameSource`.

    Exposure, gain, white balance and focus are locked: at the given values, else at those the
    automatics settled on. `locked` says at what, read back from the driver; `unlocked` which it did
    not let be, `refused` where another value is in force than was asked for: name, asked, in force.
    What is odd comes with the next frame as its `note`. A camera that is unplugged is waited for
    `patience_s` long; a run has none, for its robot must stop.
    """

    def __init__(
        self,
        device: int,
        controls: CameraControls | None = None,
        capture: Capture | None = None,
        clock: Callable[[], float] = time.monotonic,
        *,
        patience_s: float = STALL_S,
        opener: Callable[[int], Capture] = cv2.VideoCapture,
    ) -> None:
        self.name = f"camera {device}"
        self._device, self._opener = device, opener
        self._clock = clock
        self._capture: Capture = capture if capture is not None else opener(device)
        if not self._capture.isOpened():
            raise RigFault(f"{self.name}: cannot be opened; `hil doctor` lists the cameras")
        self._controls = controls = controls or CameraControls()
        try:
            self._set_up()
        except RigFault:
            self._capture.release()
            raise
        self._queue = FrameQueue()
        self._watch = FrameWatch(controls.rate_hz)
        self._newest_s = clock()
        self._patience_s = patience_s
        self._limit_s = START_S
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=self.name, daemon=True)
        self._thread.start()

    def _set_up(self) -> None:
        """Set format and controls, and note what the driver did not take."""
        self.locked: dict[str, float] = {}
        self.unlocked: list[str] = []
        self.refused: list[tuple[str, float, float]] = []
        self._set_format(self._controls)
        self._lock(self._controls)
        self._notes = self._oddities()

    def _set_format(self, controls: CameraControls) -> None:
        """Ask for motion JPEG (raw 720p does not fit USB 2 at 30 Hz), size, rate, a short queue."""
        self._fourcc = cv2.VideoWriter.fourcc(*("YUYV" if controls.raw else "MJPG"))
        wanted = {
            cv2.CAP_PROP_FOURCC: float(self._fourcc),
            cv2.CAP_PROP_FRAME_WIDTH: controls.width_px,
            cv2.CAP_PROP_FRAME_HEIGHT: controls.height_px,
            cv2.CAP_PROP_FPS: controls.rate_hz,
            cv2.CAP_PROP_BUFFERSIZE: 1.0,
        }
        for key, value in wanted.items():
            if value is not None:
                self._capture.set(key, float(value))
        have = tuple(
            round(self._capture.get(key))
            for key in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)
        )
        asked = (controls.width_px or have[0], controls.height_px or have[1])
        if have != asked:
            raise RigFault(
                f"{self.name}: gives {have[0]} x {have[1]} px, {asked[0]} x {asked[1]} px were"
                " asked for; take a size that it offers"
            )
        self.width_px, self.height_px = have

    def _lock(self, controls: CameraControls) -> None:
        """Let the automatics settle, then turn them off and set what they chose or what is given.

        What is in force is read back: many a driver takes a value without a word and drops it.
        """
        for _ in range(SETTLE_FRAMES):
            if not self._capture.grab():
                raise RigFault(f"{self.name}: gives no frames; is another program using it?")
        for name, (automatic, off, key) in LOCKS.items():
            given = getattr(controls, name)
            value = self._capture.get(key) if given is None else float(given)
            done = automatic is None or self._capture.set(automatic, off)
            if not (done and self._capture.set(key, value)):
                self.unlocked.append(name)
                continue
            self.locked[name] = self._capture.get(key)
            if abs(self.locked[name] - value) > CONTROL_RATIO * abs(value):
                self.refused.append((name, value, self.locked[name]))

    def _oddities(self) -> list[str]:
        """Return what the driver did not do, a sentence each."""
        said = [
            f"{name}: {asked:g} asked for, {have:g} in force" for name, asked, have in self.refused
        ]
        given = [name for name in self.unlocked if getattr(self._controls, name) is not None]
        said += [f"{name}: cannot be set" for name in given]
        automatic = [name for name in self.unlocked if name not in given]
        if automatic:
            said.append(f"{', '.join(automatic)}: left to the camera's automatics")
        have = int(self._capture.get(cv2.CAP_PROP_FOURCC))
        if have not in {0, self._fourcc}:
            said.append(f"pictures come as {_letters(have)}, {_letters(self._fourcc)} asked for")
        return said

    @property
    def rate_hz(self) -> float:
        """The true frame rate: one over the median distance of the last stamps; NaN before."""
        return self._watch.rate_hz

    @property
    def age_s(self) -> float:
        """How old frames are when they arrive, by the driver's stamps; NaN where it has none."""
        return self._watch.age_s

    def _run(self) -> None:
        """Empty the driver's queue for ever, stamping each frame as it is grabbed."""
        self._drop_stale()
        index = 0
        while not self._stop.is_set():
            if not self._capture.grab():
                if self._back_again(index):
                    continue
                if not self._stop.is_set():
                    self._queue.fail(f"{self.name}: gone after {index} frames; was it unplugged?")
                return
            arrival_s = self._clock()
            stamp_s = self._stamp_s(arrival_s)
            done, image = self._capture.retrieve()
            if not done or image is None:
                continue  # a broken JPEG: as good as a dropped frame
            if image.shape[:2] != (self.height_px, self.width_px):
                self._queue.fail(
                    f"{self.name}: a picture of {image.shape[1]} x {image.shape[0]} px came, its driver"
                    f" says {self.width_px} x {self.height_px} px; take a size that it offers"
                )
                return
            if not self._watch.take(stamp_s, arrival_s, np.asarray(image, dtype=np.uint8)):
                continue  # the frame before once more
            said = self._watch.said()
            note = "; ".join([*self._notes, *([said] if said else [])])
            self._notes = []
            self._newest_s, self._limit_s = arrival_s, max(STALL_S, self._patience_s)
            self._queue.put(Frame(index, stamp_s, np.asarray(image, np.uint8), note=note))
            index += 1

    def _back_again(self, index: int) -> bool:
        """Wait for a camera that is gone, and set it up anew; False when patience is at its end."""
        gone_s = self._clock()
        if self._patience_s <= STALL_S:
            return False
        self._capture.release()
        while not self._stop.wait(REOPEN_S) and self._clock() - gone_s < self._patience_s:
            self._capture = self._opener(self._device)
            if not self._capture.isOpened():
                continue
            try:
                self._set_up()
            except RigFault:
                self._capture.release()
                continue
            self._drop_stale()
            self._watch.restart()
            self._notes.append(f"gone for {self._clock() - gone_s:.1f} s after frame {index - 1}")
            return True
        return False

    def _drop_stale(self) -> None:
        """Throw away what waited in the driver's queue: frames that come without a wait."""
        rate_hz = self._capture.get(cv2.CAP_PROP_FPS)
        half_period_s = 0.5 / (rate_hz if rate_hz > 1.0 else 30.0)
        for _ in range(STALE_FRAMES_MAX):
            before_s = self._clock()
            if not self._capture.grab() or self._clock() - before_s > half_period_s:
                return

    def _stamp_s(self, arrival_s: float) -> float:
        """Return the driver's stamp when it is on this machine's monotonic clock, else arrival."""
        stamp_s = self._capture.get(cv2.CAP_PROP_POS_MSEC) * 1e-3
        return stamp_s if 0.0 <= arrival_s - stamp_s <= STAMP_AGE_MAX_S else arrival_s

    def fileno(self) -> int:
        """Return a descriptor that is readable while a frame is waiting."""
        return self._queue.fileno()

    def poll(self) -> Frame | None:
        """Return the oldest frame waiting, None if none; RigFault once 200 ms passed without one."""
        frame = self._queue.poll()
        silence_s = self._clock() - self._newest_s
        if frame is None and silence_s > self._limit_s:
            repeated = self._watch.repeated
            same = f" ({repeated} came that were the one before once more)" if repeated else ""
            raise RigFault(
                f"{self.name}: no frame for {past(silence_s, self._limit_s, '.2f')} s, limit"
                f" {self._limit_s:g} s{same}; check the cable, and that exposure fits the frame rate"
            )
        return frame

    def read(self) -> Frame:
        """Wait for the next frame; raises RigFault when the camera stalls or is gone."""
        while (frame := self.poll()) is None:
            self._stop.wait(0.002)
        return frame

    def close(self) -> None:
        """Stop the thread and release the camera; a driver that hangs is left behind."""
        self._stop.set()
        self._thread.join(timeout=1.0)
        if not self._thread.is_alive():
            self._capture.release()
        self._queue.close()


def _letters(fourcc: int) -> str:
    """Return the four letters of a picture format."""
    return fourcc.to_bytes(4, "little").decode("latin-1").strip()


def image_files(folder: Path) -> list[Path]:
    """Return a folder's images, img2 before img10; raises BadInput when there are none."""
    if not folder.is_dir():
        raise BadInput(f"{folder}: no such folder")
    files = [f for f in folder.iterdir() if f.suffix.lower() in cv_compat.IMAGE_SUFFIXES]
    if not files:
        raise BadInput(f"{folder}: no images in it ({', '.join(sorted(cv_compat.IMAGE_SUFFIXES))})")
    return sorted(files, key=_natural)


def _natural(path: Path) -> list[tuple[int, str]]:
    parts = re.split(r"(\d+)", path.name)
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]


class ImageFolder:
    """The images of a folder as frames, one period apart; all must have one size."""

    def __init__(self, folder: Path, rate_hz: float = 30.0) -> None:
        self.path = folder
        self.files = image_files(folder)
        self.rate_hz = rate_hz
        self.unstamped = 0
        self.count = len(self.files)
        first = cv_compat.read_image(self.files[0])
        self.height_px, self.width_px = first.shape[:2]

    def frames(self) -> Iterator[Frame]:
        """Yield every image; raises BadInput at a damaged one or one of another size."""
        for index, file in enumerate(self.files):
            image = cv_compat.read_image(file)
            if image.shape[:2] != (self.height_px, self.width_px):
                raise BadInput(
                    f"{file}: {image.shape[1]} x {image.shape[0]} px, {self.files[0].name} has"
                    f" {self.width_px} x {self.height_px} px; one folder holds one resolution"
                )
            yield Frame(index, index / self.rate_hz, image)

    def close(self) -> None:
        """Do nothing: files are opened one at a time."""
