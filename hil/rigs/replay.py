"""The rig of a replay: it tells the session what the record's tape was told, in the same order.

Nothing here looks at a clock. `wait` jumps to the next recorded instant, so the loop runs as fast
as the host code does. What the session sends goes nowhere; the link's tap keeps it for comparison.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from hil.config.mismatch import true_robot
from hil.core.errors import BadInput, RigFault
from hil.core.rig import Frame, Truth
from hil.core.types import Covariance, Pose, PoseMeasurement
from hil.record import layout, tape
from hil.record.reader import read_events
from hil.record.tick_rows import COVARIANCE, MARKS

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from hil.config.scenario import Scenario
    from hil.core.rig import ByteStream
    from hil.record.journal import Columns
    from hil.record.source import Source

END = "replay: the record ends here"
# Kind and text of the event of a robot that is kept at rest until somebody arms it.
HELD = ("operator", "robot found; it is armed by hand")
# What happened in a record, and what was asked there.
HAPPENED = ("duration_s", "start", "mismatch", "disturbances", "faults")
_TASK = ("name", "reference", *HAPPENED)


class ReplayRig:
    """A `Rig` made of a tape, the recorded frames and the recorded truth (for the rows only).

    A session that looks at the clock once more or less between two waits than the recorded one did
    is brought back into step at the next wait. `was_held` says that the robot was to be armed by hand.
    """

    def __init__(
        self,
        recorded: tape.Tape,
        frames: Iterator[Frame],
        truths: Iterator[Truth | None],
        *,
        was_held: bool = False,
    ) -> None:
        self._entries: tuple[tuple[bytes, Any], ...] = recorded.entries
        self._at = 0
        self.was_held = was_held
        self._now_s = math.nan
        self._fresh = False  # the time after a wait was not asked for yet
        self._frames = frames
        self._truths = truths
        self.ended = False
        self.stream: ByteStream = _ReplayStream(self)
        if self._kind() == tape.WAITED:
            self._begin_instant()

    def now_s(self) -> float:
        """Return what the host clock showed; RigFault once, when the record ends here."""
        if self._fresh:
            self._fresh = False
        elif self._kind() == tape.CLOCK:
            self._now_s = float(self._take())
        elif self._kind() == b"" and not self.ended:
            self._end()
        return self._now_s

    def wait(self, until_s: float) -> None:  # noqa: ARG002 - the record knows how long it took
        """Go on to the next recorded instant; RigFault at the end of the record."""
        while self._kind() not in {tape.WAITED, b""}:
            try:
                self.raise_recorded(tape.IN_WAIT)
            except (RigFault, KeyboardInterrupt):
                if self._kind() == tape.WAITED:  # the time after it is the wait's, cut short
                    self._begin_instant()
                raise
            self._at += 1
        if self._kind() == b"":
            self._end()
        self._begin_instant()

    def poll_frame(self) -> Frame | None:
        """Return the next recorded frame when one was taken here."""
        if self._kind() != tape.FRAME:
            return None
        frame = next(self._frames, None)
        if frame is None:  # the table of frames was cut off before the tape
            self._at = len(self._entries)
            return None
        self._at += 1
        return frame

    def take_orders(self) -> list[dict[str, Any]]:
        """Return what the operator had ordered where the session asked for it."""
        found = []
        while self._kind() == tape.ORDER:
            found.append(tape.order_in(self._take()))
        return found

    def begin(self, t_start_s: float) -> None:
        """Nothing counts from here: disturbances are in the record."""

    def truth(self) -> Truth | None:
        """Return the truth of the next row."""
        return next(self._truths, None)

    def close(self) -> None:
        """Nothing is held that needs releasing."""

    def take_bytes(self) -> bytes:
        """Return the bytes that were read here, b"" if none."""
        self.raise_recorded(tape.IN_READ)
        if self._kind() != tape.BYTES:
            return b""
        data: bytes = self._take()
        return data

    def raise_recorded(self, place: bytes) -> None:
        """Raise again what was raised in this call here."""
        kind = self._kind()
        if kind not in {tape.FAULT, tape.INTERRUPT} or self._entries[self._at][1][:1] != place:
            return
        text: bytes = self._take()
        if kind == tape.FAULT:
            raise RigFault(text[1:].decode(errors="replace"))
        raise KeyboardInterrupt(text[1:].decode(errors="replace"))

    def _end(self) -> NoReturn:
        self.ended = True
        raise RigFault(END)

    def _begin_instant(self) -> None:
        self._now_s = float(self._take())
        self._fresh = True

    def _kind(self) -> bytes:
        return self._entries[self._at][0] if self._at < len(self._entries) else b""

    def _take(self) -> Any:
        value = self._entries[self._at][1]
        self._at += 1
        return value


class _ReplayStream:
    """The byte stream of a replay."""

    def __init__(self, rig: ReplayRig) -> None:
        self._rig = rig

    def read(self) -> bytes:
        """Return the recorded bytes of this instant."""
        return self._rig.take_bytes()

    def write(self, data: bytes) -> None:  # noqa: ARG002 - see the module
        """Send nowhere; fail where the recorded port failed, and after the record's end.

        Raises RigFault there.
        """
        self._rig.raise_recorded(tape.IN_WRITE)
        if self._rig.ended:
            raise RigFault(END)


def recorded_frames(frames: Columns, images: Iterator[NDArray[np.uint8]]) -> Iterator[Frame]:
    """Yield the recorded frames with their images; with the recorded pose where none is left."""
    for row in range(frames["t_cam_s"].size if frames else 0):
        values = {name: float(column[row]) for name, column in frames.items()}
        image = next(images, None)
        pose = _measurement(values) if image is None else None
        yield Frame(int(values["index"]), values["t_cam_s"], image, pose)


def _measurement(values: dict[str, float]) -> PoseMeasurement:
    """Return what the localiser said, as the row of the frame has it."""
    seen = values["seen"] == 1.0
    pose = Pose(values["x_m"], values["y_m"], values["theta_rad"])
    return PoseMeasurement(
        pose if seen else None,
        values["quality"],
        "" if seen else "not seen in the record",
        values["sigma_xy_m"],
        values["sigma_theta_rad"],
        {name: values[name] for name in MARKS if not math.isnan(values[name])},
        _covariance(values),
    )


def _covariance(values: dict[str, float]) -> Covariance | None:
    """Return the covariance recorded; None where the localiser, or an older record, had none."""
    xx, xy, xt, yy, yt, tt = (values.get(name, math.nan) for name in COVARIANCE)
    return None if math.isnan(xx) else (xx, xy, xt, yy, yt, tt)


def recorded_images(path: Path) -> Iterator[NDArray[np.uint8]]:
    """Yield the images of a lossless video, as far as it can be read."""
    import cv2  # noqa: PLC0415 - a tenth of a second, where there is a video only

    video = cv2.VideoCapture(str(path))
    try:
        while True:
            good, image = video.read()
            if not good:
                return
            yield np.asarray(image, dtype=np.uint8)
    finally:
        video.release()


def recorded_truths(samples: Columns, d0_m: float) -> Iterator[Truth | None]:
    """Yield the truth of each row; None where the record has none. `d0_m` is the true one."""
    names = ("x_m", "y_m", "theta_rad", "eta1_m_s", "theta_dot_rad_s")
    columns = [samples[f"true_{name}"].tolist() for name in names] if samples else []
    for x, y, theta, eta1, theta_dot in zip(*columns, strict=True):
        if math.isnan(x):
            yield None
            continue
        z1_m = (x + d0_m * math.cos(theta), y + d0_m * math.sin(theta))
        yield Truth(Pose(x, y, theta), eta1, theta_dot, z1_m)


def open_replay(source: Source, recorded: Scenario) -> ReplayRig:
    """Return the rig that a record makes; `recorded` is its scenario."""
    video = source.path / layout.CAMERA
    images: Iterator[Any] = recorded_images(video) if source.has_video else iter(())
    return ReplayRig(
        source.tape,
        recorded_frames(source.frames, images),
        recorded_truths(source.samples, true_robot(recorded).d0_m),
        was_held=any(
            (event.kind, event.text) == HELD for event in read_events(source.path / layout.EVENTS)
        ),
    )


def refuse_other_task(scenario: Scenario, recorded: Scenario, path: Path) -> None:
    """Raise BadInput when a record of another task is to answer for a scenario (`--on replay:`)."""
    pairs = {key: (getattr(scenario, key), getattr(recorded, key)) for key in _TASK}
    pairs["control.rate_hz"] = (scenario.control.rate_hz, recorded.control.rate_hz)
    for key, (asked, there) in pairs.items():
        if asked != there:
            shown = f" ({asked} asked, {there} recorded)" if isinstance(asked, str | float) else ""
            raise BadInput(
                f"--on replay:{path}: is a record of another task: {key} differs{shown}; name its "
                "scenario and what was --set there, or use hil replay"
            )
