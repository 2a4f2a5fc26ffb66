"""MAVLink 2 signatures of the host: frames signed on their way out, checked and bared on their way in.

What is above never meets a signature: a frame that was found good is handed on as the unsigned frame it
would be without a key, so that records, replays and procedures are the same with one. The standard's rules
are in mavlink.io/en/guide/message_signing.html; firmware: src/core/signer.h.
"""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from hil.wire import _wire, dialect

KEY_BYTES = 32
BLOCK_BYTES = 13
# 2015-01-01 in the Unix clock; a stamp counts 10 us.
EPOCH_UNIX_S = 1_420_070_400
_NS_PER_STAMP = 10_000
_MINUTE = 6_000_000
# No clock says more: 48 bits end in 2104. The firmware's STAMP_MOST.
STAMP_MOST = 2**48 - 1 - 365 * 24 * 60 * _MINUTE
_MARKER, _FLAGS, _SIGNED = 0xFD, 2, 1
_HEADER_BYTES, _OVERHEAD_BYTES, _STAMP_BYTES, _SIGNATURE_BYTES = 10, 12, 6, 6


_DECODER = dialect.MAVLink(None)


@dataclass(frozen=True, slots=True)
class Key:
    """A secret key and what it is called in messages: the name of its file. It never shows its bytes."""

    secret: bytes = field(repr=False)
    name: str

    def signature(self, signed: bytes) -> bytes:
        """Return the signature of what is signed: header, payload, CRC, link id and time stamp."""
        return hashlib.sha256(self.secret + signed).digest()[:_SIGNATURE_BYTES]


class Cut(NamedTuple):
    """A good frame of the stream, bared of its signature, and the block that came behind it, b"" if none."""

    frame: bytes
    block: bytes


def stamp_at(unix_ns: int) -> int:
    """Return the time stamp of a moment of the Unix clock; of one before 2015 (a clock never set) 0."""
    stamp = (unix_ns - EPOCH_UNIX_S * 1_000_000_000) // _NS_PER_STAMP
    return min(max(stamp, 0), STAMP_MOST)


def flagged(frame: bytes, flags: int) -> bytes:
    """Return a frame with these incompatible flags and the checksum that belongs to them."""
    entry = dialect.mavlink_map[int.from_bytes(frame[7:10], "little")]
    body = frame[1:2] + bytes([flags]) + frame[3:-2]
    crc = _wire.checksum(body, entry.crc_extra)
    return bytes([_MARKER]) + body + crc.to_bytes(2, "little")


class FrameSigner:
    """Signs the frames of one sender; `stamp` is the last time stamp used, or heard."""

    def __init__(self, key: Key, link_id: int = 0) -> None:
        self._key = key
        self._link_id = bytes([link_id])
        self.stamp = 0

    def sign(self, frame: bytes, now: int) -> bytes:
        """Return an unsigned frame signed at the stamp `now`, or at the next one that is free."""
        self.stamp = max(self.stamp + 1, now)
        signed = flagged(frame, _SIGNED) + self._link_id + self.stamp.to_bytes(6, "little")
        return signed + self._key.signature(signed)


class FrameCutter:
    """Cuts good frames out of a byte stream and bares them; looks at no signature."""

    def __init__(self) -> None:
        self._rest = bytearray()

    def feed(self, data: bytes) -> Iterator[Cut]:
        """Yield the frames completed by `data`, in order; what is damaged is left out."""
        rest = self._rest
        rest += data
        while True:
            marker = rest.find(_MARKER)
            del rest[: len(rest) if marker < 0 else marker]
            if len(rest) < _OVERHEAD_BYTES:
                return
            entry = dialect.mavlink_map.get(int.from_bytes(rest[7:10], "little"))
            length, flags = rest[1], rest[_FLAGS]
            if entry is None or length > entry.unpacker.size or flags not in (0, _SIGNED):
                del rest[:1]
                continue
            size = _OVERHEAD_BYTES + length
            block = BLOCK_BYTES if flags else 0
            if len(rest) < size + block:
                return
            frame = bytes(rest[:size])
            if flagged(frame, flags) != frame:
                del rest[:1]
                continue
            yield Cut(flagged(frame, 0) if flags else frame, bytes(rest[size : size + block]))
            del rest[: size + block]


@dataclass(slots=True)
class CheckCounts:
    """What a check has met: good frames, and those refused, by why."""

    good: int = 0
    unsigned: int = 0
    other_key: int = 0
    old: int = 0

    @property
    def refused(self) -> int:
        """Frames that were not handed on."""
        return self.unsigned + self.other_key + self.old


class FrameChecker:
    """Hands on the frames of a stream that are signed with the key and new, bared of their signatures."""

    def __init__(self, key: Key, signer: FrameSigner) -> None:
        self._key = key
        self._signer = signer
        self._cutter = FrameCutter()
        self._last: dict[tuple[int, int, int], int] = {}
        self.counts = CheckCounts()
        self.said = ""  # the last text of the sender that was not signed

    def feed(self, data: bytes) -> bytes:
        """Return the good frames completed by `data`."""
        return b"".join(cut.frame for cut in self._cutter.feed(data) if self._is_good(cut))

    def _is_good(self, cut: Cut) -> bool:
        counts, block = self.counts, cut.block
        if not block:
            counts.unsigned += 1
            self._hear(cut.frame)
            return False
        signed = flagged(cut.frame, _SIGNED) + block[: 1 + _STAMP_BYTES]
        if not hmac.compare_digest(self._key.signature(signed), block[1 + _STAMP_BYTES :]):
            counts.other_key += 1
            return False
        stamp = int.from_bytes(block[1 : 1 + _STAMP_BYTES], "little")
        sender = (cut.frame[5], cut.frame[6], block[0])
        # A new sender may be one minute behind.
        if not self._last.get(sender, self._signer.stamp - _MINUTE - 1) < stamp <= STAMP_MOST:
            counts.old += 1
            return False
        self._last[sender] = stamp
        self._signer.stamp = max(self._signer.stamp, stamp)
        counts.good += 1
        return True

    def _hear(self, frame: bytes) -> None:
        if int.from_bytes(frame[7:10], "little") == dialect.MAVLINK_MSG_ID_STATUSTEXT:
            self.said = str(getattr(_DECODER.decode(bytearray(frame)), "text", ""))
