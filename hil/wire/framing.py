"""MAVLink 2 frames: cut out of a byte stream, checked, decoded; and encoded.

The generated dialect is the only declaration of the layout. The two messages of the control loop
take a short way through the same generated `unpacker`, field order and CRC_EXTRA (about a tenth
of the time); every other message goes through the dialect's own decode and pack.

Frame: FD, length, incompatible flags, compatible flags, sequence, system, component, message id
(3 bytes), payload with trailing zeros cut off, CRC-16/MCRF4XX over all but FD, and CRC_EXTRA.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from fastcrc.crc16 import mcrf4xx

from hil.wire import dialect

BOARD_SYSTEM, BOARD_COMPONENT = 1, 1
HOST_SYSTEM, HOST_COMPONENT = 255, 190

_MARKER = b"\xfd"
_OVERHEAD = 12  # header of ten bytes and the CRC


class _Spec:
    """What the cutter needs to know of one message, taken from its generated class."""

    __slots__ = ("crc_tail", "make", "size", "unpack")

    def __init__(self, message_class: type[dialect.MAVLink_message], hot: bool) -> None:
        self.size: int = message_class.unpacker.size
        self.crc_tail = bytes([message_class.crc_extra])
        self.unpack = message_class.unpacker.unpack
        self.make: Callable[[tuple[Any, ...]], Any] | None = None
        if hot:
            record: Any = namedtuple(message_class.msgname, message_class.ordered_fieldnames)  # type: ignore[misc]
            self.make = record._make


_HOT = (dialect.MAVLINK_MSG_ID_WHEEL_STATE,)
_SPECS = {key: _Spec(value, key in _HOT) for key, value in dialect.mavlink_map.items()}


class Received(NamedTuple):
    """One good frame: message id, message (fields as attributes) and its bytes."""

    msg_id: int
    message: Any
    frame: bytes


@dataclass(slots=True)
class ReadCounters:
    """What the reader has met; `lost` counts gaps in the sequence numbers of the source."""

    frames: int = 0
    lost: int = 0
    bad_crc: int = 0
    skipped_bytes: int = 0
    foreign: int = 0


class FrameReader:
    """Cuts the frames of one source out of whatever bytes arrive, and finds back after damage.

    A damaged frame costs its marker byte only: the search goes on inside it, so that a good frame
    behind a false marker is not lost.
    """

    def __init__(self, system: int = BOARD_SYSTEM) -> None:
        self._system = system
        self._rest = b""
        self._next_seq: int | None = None
        self._decoder = dialect.MAVLink(None)
        self.counters = ReadCounters()

    def feed(self, data: bytes) -> list[Received]:
        """Return the messages completed by `data`, in order."""
        buf = self._rest + data if self._rest else data
        end_of_data = len(buf)
        received: list[Received] = []
        start = 0
        while True:
            marker = buf.find(_MARKER, start)
            if marker < 0:
                self.counters.skipped_bytes += end_of_data - start
                self._rest = b""
                return received
            self.counters.skipped_bytes += marker - start
            start = marker
            if end_of_data - start < _OVERHEAD:
                break
            spec = _SPECS.get(buf[start + 7] | buf[start + 8] << 8 | buf[start + 9] << 16)
            if spec is None or buf[start + 1] > spec.size or buf[start + 2]:
                self.counters.skipped_bytes += 1
                start += 1
                continue
            end = start + _OVERHEAD + buf[start + 1]
            if end > end_of_data:
                break
            frame = buf[start:end]
            if mcrf4xx(frame[1:-2] + spec.crc_tail) != frame[-2] | frame[-1] << 8:
                self.counters.bad_crc += 1
                self.counters.skipped_bytes += 1
                start += 1
                continue
            start = end
            self._accept(frame, spec, received)
        self._rest = buf[start:]
        return received

    def _accept(self, frame: bytes, spec: _Spec, received: list[Received]) -> None:
        counters = self.counters
        if frame[5] != self._system:
            counters.foreign += 1
            return
        seq = frame[4]
        gap = (seq - self._next_seq) & 0xFF if self._next_seq is not None else 0
        counters.lost += gap if gap < 128 else 0  # a step back is a restart or a late frame
        self._next_seq = (seq + 1) & 0xFF
        counters.frames += 1
        msg_id = frame[7] | frame[8] << 8 | frame[9] << 16
        if spec.make is None:
            message = self._decoder.decode(bytearray(frame))
        else:
            message = spec.make(spec.unpack(frame[10:-2].ljust(spec.size, b"\0")))
        received.append(Received(msg_id, message, frame))


class FrameWriter:
    """Numbers and encodes the frames of one source."""

    def __init__(self, system: int = HOST_SYSTEM, component: int = HOST_COMPONENT) -> None:
        self._mavlink = dialect.MAVLink(None, system, component)
        setpoint = dialect.MAVLink_wheel_setpoint_message
        self._setpoint_tail = bytes([system, component]) + setpoint.id.to_bytes(3, "little")
        self._setpoint_order = [
            setpoint.fieldnames.index(name) for name in setpoint.ordered_fieldnames
        ]

    def encode(self, message: dialect.MAVLink_message) -> bytes:
        """Return the frame of any dialect message."""
        frame = bytes(message.pack(self._mavlink))
        self._count()
        return frame

    def encode_setpoint(self, *fields: float) -> bytes:
        """Return a WHEEL_SETPOINT frame; fields in the order of the message's constructor."""
        spec = dialect.MAVLink_wheel_setpoint_message
        payload = spec.unpacker.pack(*[fields[i] for i in self._setpoint_order])
        payload = payload.rstrip(b"\0") or b"\0"
        body = bytes((len(payload), 0, 0, self._mavlink.seq)) + self._setpoint_tail + payload
        crc = mcrf4xx(body + bytes((spec.crc_extra,)))
        self._count()
        return _MARKER + body + crc.to_bytes(2, "little")

    def _count(self) -> None:
        self._mavlink.seq = (self._mavlink.seq + 1) & 0xFF
