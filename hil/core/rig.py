"""The boundary below which targets differ: a byte stream to the board, camera frames, a clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from hil.core import _native

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hil.core.types import Pose, PoseMeasurement, Vec2


class ByteStream(Protocol):
    """Bytes to and from the board, as a serial port gives them; never blocks."""

    def read(self) -> bytes:
        """Return every byte that has arrived by now, b"" if none."""

    def write(self, data: bytes) -> None:
        """Send the bytes; raises RigFault when the port is gone."""


# What a port and its driver hold of bytes that the line has not carried yet.
PORT_BYTES = _native.PORT_BYTES


@runtime_checkable
class PortStream(ByteStream, Protocol):
    """A byte stream that holds what is written until a line of limited speed has carried it.

    `write` raises RigFault when it would have to hold more than PORT_BYTES.
    """

    def room_bytes(self) -> int:
        """Return how many bytes `write` takes now."""

    def discard_unsent(self) -> None:
        """Forget what the line has not carried yet; what comes next goes out at once."""


class LineBacklog(_native.LineBacklog):
    """How many bytes a serial line (baud) still has to carry, from what was written and when.

    `waiting_bytes(t_s)` are those that it has not carried; `write(t_s, size)` raises RigFault when the port
    would have to hold more than PORT_BYTES.
    """


def discard_unsent(stream: ByteStream) -> None:
    """Let a stream that can forget what it still holds."""
    if isinstance(stream, PortStream):
        stream.discard_unsent()


class Drawing(Protocol):
    """A picture of a simulated camera that is drawn only where somebody looks; to be read in one thread."""

    @property
    def shape(self) -> tuple[int, ...]:
        """(H, W, 3)."""

    @property
    def content(self) -> object:
        """What drawings of equal pixels have equal."""

    def part(self, window: tuple[int, int, int, int]) -> NDArray[np.uint8]:
        """Return the whole picture's array, of which (left, top, right, bottom) at least is drawn."""

    def whole(self) -> NDArray[np.uint8]:
        """Return the picture, (H, W, 3) uint8 BGR."""


if TYPE_CHECKING:
    Picture = NDArray[np.uint8] | Drawing


def whole(picture: Picture) -> NDArray[np.uint8]:
    """Return a picture with all its pixels, (H, W, 3) uint8 BGR."""
    import numpy as np  # noqa: PLC0415 - only where there are pictures

    return picture if isinstance(picture, np.ndarray) else picture.whole()


@dataclass(frozen=True, slots=True)
class Frame:
    """One camera frame as it reached the host.

    `t_cam_s` is the middle of the exposure on the camera's own clock. `picture` is (H, W, 3) uint8
    BGR, or a drawing of that; it is None when the source gives poses itself (`--camera pose`), and
    `pose` is set then. `note` is what a camera has to say of itself since the frame before, for the
    record; "" mostly.
    """

    index: int
    t_cam_s: float
    picture: Picture | None
    pose: PoseMeasurement | None = None
    note: str = ""

    @property
    def image(self) -> NDArray[np.uint8] | None:
        """The picture with all its pixels, (H, W, 3) uint8 BGR."""
        return None if self.picture is None else whole(self.picture)


@dataclass(frozen=True, slots=True)
class Truth:
    """What the robot really did: known on simulated robots only, and used for the record only."""

    pose: Pose
    eta1_m_s: float
    theta_dot_rad_s: float
    z1_m: Vec2  # the flat output (2.35) with the robot's true d0


class Rig(Protocol):
    """A robot with its board and camera, real or simulated; times are host times in s."""

    @property
    def stream(self) -> ByteStream:
        """The bytes to and from the board."""

    def now_s(self) -> float:
        """Return the host clock (monotonic)."""

    def wait(self, until_s: float) -> None:
        """Return at `until_s`, or earlier as soon as bytes or a frame have arrived."""

    def poll_frame(self) -> Frame | None:
        """Return the oldest frame not yet taken that has arrived by now."""

    def begin(self, t_start_s: float) -> None:
        """Take note that the controlled part begins: timed disturbances and faults count from it."""

    def truth(self) -> Truth | None:
        """Return the true state now, or None where nobody knows it."""

    def close(self) -> None:
        """Release port and camera; safe to call twice."""


class RigAround:
    """A rig around another, which does what it does; whoever derives from it says what is otherwise."""

    stream: ByteStream

    def __init__(self, rig: Rig) -> None:
        self._rig = rig

    def now_s(self) -> float:
        """Return the host clock (monotonic)."""
        return self._rig.now_s()

    def wait(self, until_s: float) -> None:
        """Return at `until_s`, or earlier as soon as bytes or a frame have arrived."""
        self._rig.wait(until_s)

    def poll_frame(self) -> Frame | None:
        """Return the oldest frame not yet taken that has arrived by now."""
        return self._rig.poll_frame()

    def begin(self, t_start_s: float) -> None:
        """Take note that the controlled part begins."""
        self._rig.begin(t_start_s)

    def truth(self) -> Truth | None:
        """Return the true state now, or None where nobody knows it."""
        return self._rig.truth()

    def close(self) -> None:
        """Release port and camera; safe to call twice."""
        self._rig.close()
