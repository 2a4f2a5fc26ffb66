"""`inputs.tape`: everything a session was told from below, in order, so that it can be told again.

A session learns of the world in five ways: what the host clock shows, which bytes have arrived,
that a frame has arrived, that something broke, and what an operator orders. The tape holds just that,
clock readings as float64, bytes as they came (good or damaged), an order as JSON. With frames.parquet,
or camera.mkv, beside it a replay is exact on any target, also where the clock is the wall's (docs/replay.md).

One line of JSON, then entries: a kind byte and its value. A torn last entry is left by the reader.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil.core.errors import BadInput, RigFault
from hil.core.rig import PORT_BYTES, PortStream, RigAround, discard_unsent

if TYPE_CHECKING:
    from hil.core.rig import ByteStream, Frame, Rig
    from hil.record.writing import GuardedFile

_HEADER = json.dumps({"format": "hil-tape-1"}).encode() + b"\n"
_CLOCK = struct.Struct("<cd")
_BLOCK = struct.Struct("<cI")

# A clock reading, and one that is the first after a wait: readings of one instant belong together.
CLOCK, WAITED = b"C", b"W"
BYTES, FRAME = b"R", b"F"
FAULT, INTERRUPT = b"X", b"K"
ORDER = b"O"
# In which call that was: the first byte of the entry's value.
IN_READ, IN_WRITE, IN_WAIT = b"r", b"w", b"t"

Entry = tuple[bytes, float | bytes]


class TapeWriter:
    """Appends entries to a new file; `write` takes them packed."""

    def __init__(self, file: GuardedFile) -> None:
        self.write: Callable[[bytes], int] = file.write
        self.write(_HEADER)

    def order(self, order: Mapping[str, Any]) -> None:
        """Note what an operator ordered, where the session took it."""
        text = json.dumps(order).encode()
        self.write(_BLOCK.pack(ORDER, len(text)) + text)

    def stop(self, place: bytes, cause: BaseException) -> None:
        """Note that the rig broke, or that the user stopped the run, in this very call."""
        fault = isinstance(cause, RigFault)
        text = place + str(cause).encode()
        self.write(_BLOCK.pack(FAULT if fault else INTERRUPT, len(text)) + text)


class TapedStream:
    """A byte stream whose reading is taped; what is written is in link.tlog."""

    def __init__(self, stream: ByteStream, tape: TapeWriter) -> None:
        self._stream = stream
        self._tape = tape
        self._read = stream.read

    def read(self) -> bytes:
        """Return every byte that has arrived by now, b"" if none."""
        try:
            data = self._read()
        except (RigFault, KeyboardInterrupt) as cause:
            self._tape.stop(IN_READ, cause)
            raise
        if data:
            self._tape.write(_BLOCK.pack(BYTES, len(data)) + data)
        return data

    def write(self, data: bytes) -> None:
        """Send the bytes."""
        try:
            self._stream.write(data)
        except (RigFault, KeyboardInterrupt) as cause:
            self._tape.stop(IN_WRITE, cause)
            raise

    def room_bytes(self) -> int:
        """Return how many bytes `write` takes now."""
        inner = self._stream
        return inner.room_bytes() if isinstance(inner, PortStream) else PORT_BYTES

    def discard_unsent(self) -> None:
        """Let the stream forget what it still holds."""
        discard_unsent(self._stream)


class TapedRig(RigAround):
    """A rig whose every answer is taped; otherwise it is the rig itself.

    `obey` may raise KeyboardInterrupt; it is called at each wait, before it (`hil.runs.interruption`).
    """

    def __init__(self, rig: Rig, tape: TapeWriter, obey: Callable[[], None]) -> None:
        super().__init__(rig)
        self._obey = obey
        self._tape = tape
        self._kind = WAITED
        self.stream = TapedStream(rig.stream, tape)
        # These run some hundred times a second: looked up once.
        self._now_s, self._wait, self._poll_frame = rig.now_s, rig.wait, rig.poll_frame
        self._write, self._pack = tape.write, _CLOCK.pack

    def now_s(self) -> float:
        """Return the host clock."""
        now_s = self._now_s()
        self._write(self._pack(self._kind, now_s))
        self._kind = CLOCK
        return now_s

    def wait(self, until_s: float) -> None:
        """Return at `until_s`, or earlier as soon as bytes or a frame have arrived."""
        self._kind = WAITED
        try:
            self._obey()
            self._wait(until_s)
        except (RigFault, KeyboardInterrupt) as cause:
            self._tape.stop(IN_WAIT, cause)
            raise

    def poll_frame(self) -> Frame | None:
        """Return the oldest frame not yet taken that has arrived by now."""
        frame = self._poll_frame()
        if frame is not None:
            self._write(FRAME)
        return frame


@dataclass(frozen=True, slots=True)
class Tape:
    """The whole entries of a tape up to its end or to the first flaw, which `problem` names."""

    entries: tuple[Entry, ...]
    problem: str = ""

    def orders(self) -> list[dict[str, Any]]:
        """Return everything that an operator ordered, in order."""
        return [order_in(value) for kind, value in self.entries if kind == ORDER]


def order_in(value: float | bytes) -> dict[str, Any]:
    """Return the order of an entry of this kind."""
    found: dict[str, Any] = json.loads(value) if isinstance(value, bytes) else {}
    return found


def read_tape(path: Path) -> Tape:
    """Return what is whole of a tape; raises BadInput for a file that is none."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise BadInput(f"{path}: cannot be read: {error.strerror}") from None
    if not data.startswith(_HEADER):
        raise BadInput(f"{path}: damaged: the first line is not that of a hil-tape-1 file")
    entries: list[Entry] = []
    at, size = len(_HEADER), len(data)
    while at < size:
        found = _entry_at(data, at)
        if found is None:
            torn = data[at : at + 1] in _KINDS
            flaw = "cut off in the middle of an entry" if torn else "damaged"
            return Tape(tuple(entries), f"{path.name} is {flaw} at byte {at} of {size}")
        entry, at = found
        entries.append(entry)
    return Tape(tuple(entries))


_KINDS = (CLOCK, WAITED, BYTES, FRAME, FAULT, INTERRUPT, ORDER)


def _entry_at(data: bytes, at: int) -> tuple[Entry, int] | None:
    """Return the entry at byte `at` and where the next one begins; None when it is not whole."""
    kind = data[at : at + 1]
    if kind == FRAME:
        return (FRAME, b""), at + 1
    if kind in {CLOCK, WAITED}:
        end = at + _CLOCK.size
        return ((kind, _CLOCK.unpack_from(data, at)[1]), end) if end <= len(data) else None
    start = at + _BLOCK.size
    if kind not in _KINDS or start > len(data):
        return None
    end = start + _BLOCK.unpack_from(data, at)[1]
    return ((kind, data[start:end]), end) if end <= len(data) else None
