"""What a picture's file says of itself before it is decoded: its kind, its size, whether it is whole.

A file of 100 kB can hold a picture of 30000 x 30000 px, which takes the memory of the machine to
decode: so the size is read from the header first. Kinds are told by content, not by name.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from hil.core.errors import BadInput

# What a camera file can describe (`hil.config.camera.CameraConfig`).
SIDE_MIN_PX, SIDE_MAX_PX = 64, 4096
HEADER_BYTES = 1 << 20

Size = tuple[int, int]

_ENDING_WITHIN_BYTES = 64
# After a scan's data: the next marker that is not a stuffed byte, a restart or a fill byte.
_NEXT_MARKER = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]", re.DOTALL)
_START_OF_FRAME = set(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_TIFF_FORMS = {1: "B", 3: "H", 4: "I", 16: "Q"}
_BARE_MARKERS = {0x01, 0xD8, *range(0xD0, 0xD8)}


@dataclass(frozen=True, slots=True)
class Header:
    """A picture's kind ("JPEG"), (width, height) in px, and whether its own end is in the data."""

    kind: str
    size_px: Size
    whole: bool = True


def read_header(data: bytes) -> Header | None:
    """Return what the first bytes say, None where they are no picture of a kind known here."""
    for start, reader in _READERS.items():
        if data.startswith(start):
            try:
                return reader(data)
            except (struct.error, LookupError, ValueError):
                return None
    return None


def check_size(header: Header, where: str) -> None:
    """Raise BadInput for a picture larger than a camera file can describe."""
    width, height = header.size_px
    if max(width, height) > SIDE_MAX_PX:
        raise BadInput(
            f"{where}: {header.kind} of {width} x {height} px, the limit is {SIDE_MAX_PX} px each"
            " way; set the camera to a smaller picture, or scale all of its pictures alike"
        )


def check_picture(path: Path, data: bytes) -> None:
    """Raise BadInput for a file that is no picture, is too large to decode, or has lost its end."""
    header = read_header(data)
    if header is None:
        raise BadInput(
            f"{path}: not an image that can be read ({len(data)} bytes); JPEG, PNG, BMP, TIFF, WebP"
            " and PNM can, if they are whole"
        )
    check_size(header, str(path))
    if not header.whole:
        raise BadInput(
            f"{path}: damaged {header.kind}: its end is missing ({len(data)} bytes); copy it again"
        )


def _png(data: bytes) -> Header:
    size: Size = struct.unpack(">II", data[16:24])
    return Header("PNG", size, any(kind == b"IEND" for kind in _png_chunks(data)))


def _png_chunks(data: bytes) -> Iterator[bytes]:
    """Yield the kind of every chunk that is there completely, with its check sum."""
    at = 8
    while at + 12 <= len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        if at + 12 + length > len(data):
            return
        yield data[at + 4 : at + 8]
        at += 12 + length


def _jpeg(data: bytes) -> Header:
    """Walk the segments to the end of the picture; what programs append after it does not count."""
    size: Size | None = None
    at = 2
    while 0 <= at < len(data) - 1:
        marker = data[at + 1]
        if data[at] != 0xFF:
            break  # not in step: judged by the last bytes
        if marker == 0xD9 and size is not None:
            return Header("JPEG", size)
        if marker == 0xFF:
            at += 1
            continue
        if marker in _BARE_MARKERS:
            at += 2
            continue
        length = int.from_bytes(data[at + 2 : at + 4], "big")
        if marker in _START_OF_FRAME and size is None:
            height, width = struct.unpack(">HH", data[at + 5 : at + 9])
            size = (width, height)
        at += 2 + length
        if marker == 0xDA:
            found = _NEXT_MARKER.search(data, at)
            at = found.start() if found else len(data)
    if size is None:
        raise ValueError("no frame header")
    return Header("JPEG", size, at < len(data) and b"\xff\xd9" in data[-_ENDING_WITHIN_BYTES:])


def _bmp(data: bytes) -> Header:
    old = struct.unpack("<I", data[14:18])[0] == 12
    width, height = struct.unpack("<HH", data[18:22]) if old else struct.unpack("<ii", data[18:26])
    return Header("BMP", (abs(width), abs(height)))


def _tiff(data: bytes) -> Header:
    """Read width and height from the first directory, of a classic or a big TIFF."""
    entries = {tag: _number(data, order, kind, at) for tag, order, kind, at in _tiff_entries(data)}
    return Header("TIFF", (entries[256], entries[257]))


def without_orientation(data: bytes) -> bytes:
    """Return a TIFF whose orientation tag turns nothing, any other data as they are.

    OpenCV's TIFF reader follows the tag whatever it is told; for other kinds it can be told not to.
    """
    header = read_header(data)
    if header is None or header.kind != "TIFF":
        return data
    for tag, order, _, at in _tiff_entries(data):
        if tag == 274:
            return data[:at] + struct.pack(f"{order}H", 1) + data[at + 2 :]
    return data


def _tiff_entries(data: bytes) -> Iterator[tuple[int, str, int, int]]:
    """Yield (tag, byte order, type, place of the value) of the first directory's numbers."""
    order = "<" if data[:2] == b"II" else ">"
    big = _number(data, order, 3, 2) == 43
    at = _number(data, order, 16, 8) if big else _number(data, order, 4, 4)
    count = _number(data, order, 16 if big else 3, at)
    at += 8 if big else 2
    entry, value_at = (20, 12) if big else (12, 8)
    for start in range(at, at + min(count, 4096) * entry, entry):
        tag, kind = struct.unpack(f"{order}HH", data[start : start + 4])
        if kind in _TIFF_FORMS:
            yield tag, order, kind, start + value_at


def _number(data: bytes, order: str, kind: int, at: int) -> int:
    form = f"{order}{_TIFF_FORMS[kind]}"
    return int(struct.unpack(form, data[at : at + struct.calcsize(form)])[0])


def _webp(data: bytes) -> Header:
    kind = data[8:16]
    if kind == b"WEBPVP8 ":
        width, height = struct.unpack("<HH", data[26:30])
        return Header("WebP", (width & 0x3FFF, height & 0x3FFF))
    if kind == b"WEBPVP8L":
        bits = int.from_bytes(data[21:25], "little")
        return Header("WebP", ((bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1))
    if kind == b"WEBPVP8X":
        width, height = (int.from_bytes(data[at : at + 3], "little") + 1 for at in (24, 27))
        return Header("WebP", (width, height))
    raise ValueError("no WebP")


def _pnm(data: bytes) -> Header:
    """Read the numbers after the sign; comments reach from # to the end of the line."""
    head = re.sub(rb"#[^\n]*", b"", data[:4096])
    if data[:2] == b"P7":
        values = dict(re.findall(rb"(WIDTH|HEIGHT)\s+(\d{1,9})", head))
        return Header("PNM", (int(values[b"WIDTH"]), int(values[b"HEIGHT"])))
    found = re.match(rb"P[1-6fF]\s+(\d{1,9})\s+(\d{1,9})\s", head)
    if found is None:
        raise ValueError("no PNM")
    return Header("PNM", (int(found[1]), int(found[2])))


_READERS = {
    b"\xff\xd8": _jpeg,
    b"\x89PNG\r\n\x1a\n": _png,
    b"BM": _bmp,
    b"II*\x00": _tiff,
    b"II+\x00": _tiff,
    b"MM\x00*": _tiff,
    b"MM\x00+": _tiff,
    b"RIFF": _webp,
    **{b"P%c" % sign: _pnm for sign in b"1234567fF"},
}
