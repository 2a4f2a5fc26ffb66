"""MAVLink 2 frames: cut out of a byte stream, checked, decoded; and encoded.

The generated dialect is the only declaration of the layout. What a control loop sends and hears all the
time goes the short way, through the structs generated from the same file (native/framing.hpp); every
other message goes through the dialect's own decode and pack.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from hil.wire import _wire, dialect

BOARD_SYSTEM, BOARD_COMPONENT = 1, 1
HOST_SYSTEM, HOST_COMPONENT = 255, 190


class Received(NamedTuple):
    """One good frame: message id, message (fields as attributes) and its bytes."""

    msg_id: int
    message: Any
    frame: bytes


class FrameReader:
    """Cuts the frames of one source out of whatever bytes arrive, and finds back after damage.

    A damaged frame costs its marker byte only: the search goes on inside it, so that a good frame
    behind a false marker is not lost. `counters` says what it has met (`lost`: gaps in the sequence
    numbers of the source). native/framing.hpp does the cutting.
    """

    def __init__(self, system: int = BOARD_SYSTEM) -> None:
        self._native = _wire.FrameReader(system)
        self.counters = self._native.counters

    def feed(self, data: bytes) -> list[Received]:
        """Return the messages completed by `data`, in order."""
        return [
            Received(msg_id, decode(msg_id, frame), frame)
            for msg_id, frame in self._native.feed(data)
        ]


_DECODER = dialect.MAVLink(None)


def decode(msg_id: int, frame: bytes) -> Any:
    """Return the message of a good frame, fields as attributes."""
    if msg_id == dialect.MAVLINK_MSG_ID_WHEEL_STATE:
        return _wire.wheel_state(frame)
    return _DECODER.decode(bytearray(frame))


class FrameWriter:
    """Numbers and encodes the frames of one source; `native` is the one that counts."""

    def __init__(
        self,
        system: int = HOST_SYSTEM,
        component: int = HOST_COMPONENT,
        native: _wire.FrameWriter | None = None,
    ) -> None:
        self._mavlink = dialect.MAVLink(None, system, component)
        self._native = native or _wire.FrameWriter(system, component)

    def encode(self, message: dialect.MAVLink_message) -> bytes:
        """Return the frame of any dialect message."""
        self._mavlink.seq = self._native.seq
        frame = bytes(message.pack(self._mavlink))
        self._native.count()
        return frame

    def encode_setpoint(self, left_rad_s: float, right_rad_s: float, seq: int) -> bytes:
        """Return a WHEEL_SETPOINT frame."""
        return self._native.setpoint(left_rad_s, right_rad_s, seq)
