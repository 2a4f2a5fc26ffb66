"""The frames of a telemetry log (.tlog), found again after damage, decoded by known dialects.

A frame stands after 8 bytes of wall time (microseconds, big-endian). Where none stands, the next
one whose checksum holds is looked for, and the hole is counted.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

_MAGIC_1, _MAGIC_2 = 0xFE, 0xFD
_MAGIC = re.compile(b"[\xfd\xfe]")
_STAMP = 8
_NEWEST_US = 4_000_000_000_000_000  # the year 2096: no stamp is later


class Message(NamedTuple):
    """One decoded frame and where it stood; `frame` is None for MAVLink 1."""

    t_s: float
    name: str
    values: Any
    system: int
    component: int
    at: int
    frame: bytes | None


@dataclass(slots=True)
class Damage:
    """What could not be read of a log."""

    messages: int = 0
    holes: list[tuple[int, int]] = field(default_factory=list)
    bad_checksums: int = 0
    unknown: Counter[int] = field(default_factory=Counter)
    torn_bytes: int = 0

    def notes(self) -> list[str]:
        """Return a line for each kind of damage."""
        said = []
        if self.holes:
            most = max(size for _, size in self.holes)
            said.append(
                f"{len(self.holes)} holes of {sum(size for _, size in self.holes)} bytes that are no"
                f" frames, the first at byte {self.holes[0][0]}, the largest of {most} bytes: left out"
            )
        if self.bad_checksums:
            said.append(f"{self.bad_checksums} frames with a wrong checksum: left out")
        if self.unknown:
            ids = ", ".join(str(number) for number in sorted(self.unknown)[:8])
            count = sum(self.unknown.values())
            said.append(
                f"{count} frames of messages that no dialect here knows (id {ids}): left out"
            )
        if self.torn_bytes:
            said.append(f"the last {self.torn_bytes} bytes are no whole frame: left out")
        return said


def messages(data: bytes, damage: Damage) -> Iterator[Message]:
    """Yield every message of a log that a known dialect can decode; the rest goes to `damage`."""
    decoders = _decoders()
    at = 0
    while at < len(data):
        end = _frame_end(data, at)
        message = None if end is None else _decoded(data, at, end, decoders)
        if message is None and (end is None or not _begins(data, end)):
            after = _next_message(data, at + 1, decoders)
            if after is None:
                damage.torn_bytes = len(data) - at
                return
            damage.holes.append((at, after - at))
            at = after
            continue
        assert end is not None
        if message is not None:
            damage.messages += 1
            yield message
        elif (number := _message_id(data, at + _STAMP)) in decoders[-1][1]:
            damage.bad_checksums += 1
        else:
            damage.unknown[number] += 1
        at = end


Decoders = list[tuple[Any, Mapping[int, Any]]]


def _decoders() -> Decoders:
    from pymavlink.dialects.v20 import ardupilotmega  # noqa: PLC0415 - large, for this errand only

    from hil.wire import dialect  # noqa: PLC0415 - as above

    known = ardupilotmega.mavlink_map | dialect.mavlink_map
    return [
        (dialect.MAVLink(None), dialect.mavlink_map),
        (ardupilotmega.MAVLink(None), known),
    ]


def _message_id(data: bytes, start: int) -> int:
    if data[start] == _MAGIC_2:
        return int.from_bytes(data[start + 7 : start + 10], "little")
    return data[start + 5]


def _frame_end(data: bytes, at: int) -> int | None:
    """Return where the stamped frame ends that stands at `at`; None where none can stand."""
    start = at + _STAMP
    if start + _STAMP > len(data) or data[start] not in {_MAGIC_1, _MAGIC_2}:
        return None
    if int.from_bytes(data[at:start], "big") > _NEWEST_US:
        return None
    if data[start] == _MAGIC_1:
        end = start + 8 + data[start + 1]
    else:
        end = start + 12 + data[start + 1] + 13 * (data[start + 2] & 1)
    return end if end <= len(data) else None


def _begins(data: bytes, at: int) -> bool:
    """Return whether the log ends at `at`, or a stamped frame can stand there."""
    return at == len(data) or _frame_end(data, at) is not None


def _decoded(data: bytes, at: int, end: int, decoders: Decoders) -> Message | None:
    """Return the message of the frame, None when its checksum is wrong or nobody knows it."""
    start = at + _STAMP
    frame = data[start:end]
    newer = frame[0] == _MAGIC_2
    number = _message_id(data, start)
    for decoder, known in decoders:
        if number not in known:
            continue
        try:
            values = decoder.decode(bytearray(frame))
        except Exception:  # the decoders raise plain Exception for whatever a frame is not
            continue
        sender = frame[5:7] if newer else frame[3:5]
        t_s = int.from_bytes(data[at:start], "big") * 1e-6
        whole = frame if newer else None
        return Message(t_s, values.get_type(), values, sender[0], sender[1], at, whole)
    return None


def _next_message(data: bytes, at: int, decoders: Decoders) -> int | None:
    """Return where the next stamped frame begins whose checksum holds, None when there is none."""
    while (mark := _MAGIC.search(data, at + _STAMP)) is not None:
        at = mark.start() - _STAMP
        end = _frame_end(data, at)
        if end is not None and _decoded(data, at, end, decoders) is not None:
            return at
        at += 1
    return None
