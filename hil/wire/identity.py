"""The two hashes of the arming handshake, as the host computes them (firmware: wire.h, params.h)."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping

from hil.wire import dialect

_ENTRY = struct.Struct("<IBB")
_PARAMETER = struct.Struct("<16sf")


def dialect_hash() -> int:
    """Return CRC-32 over (message id, CRC_EXTRA, payload length) in order of message id.

    CRC_EXTRA covers names and types of message and fields; ids and lengths cover the rest. SETUP_SIGNING
    is left out: who never sets a key need not know it.
    """
    return zlib.crc32(
        b"".join(
            _ENTRY.pack(msg_id, message.crc_extra, message.unpacker.size)
            for msg_id, message in sorted(dialect.mavlink_map.items())
            if msg_id != dialect.MAVLINK_MSG_ID_SETUP_SIGNING
        )
    )


def parameter_hash(parameters: Mapping[str, float]) -> int:
    """Return the sum modulo 2^32 of CRC-32 over each zero-padded name and its float32 value."""
    terms = (
        zlib.crc32(_PARAMETER.pack(name.encode(), value + 0.0))  # no negative zero
        for name, value in parameters.items()
    )
    return sum(terms) & 0xFFFF_FFFF


def board_hashes(parameters: Mapping[str, float]) -> tuple[int, int]:
    """Return (dialect hash, parameter hash) that a board with these parameters must show."""
    return dialect_hash(), parameter_hash(parameters)
