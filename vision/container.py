"""Whether a video file is whole, judged by the structure of its container.

Duration times rate says nothing: rates vary, sound is longer than the picture, frames are left out.
A file that was cut off ends in the middle of an element whose length it states, or its index points
beyond its end. Kinds without lengths (MPEG-TS, raw streams) cannot be judged and count as whole.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

EBML = b"\x1aE\xdf\xa3"
_SEGMENT, _CLUSTER = 0x18538067, 0x1F43B675
_MP4_PARENTS = {b"moov", b"trak", b"mdia", b"minf", b"stbl"}
_MP4_KINDS = {
    b"ftyp",
    b"moov",
    b"mdat",
    b"free",
    b"skip",
    b"wide",
    b"pnot",
    b"moof",
    b"styp",
    b"uuid",
}
_OGG_HEADER, _FLV_TAG, _ASF_OBJECT = 27, 11, 24


def missing_bytes(path: Path) -> int:
    """Return how many bytes the file's structure has beyond its end, 0 for a whole one."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(16)
        for fits, end_of in _KINDS:
            if fits(head):
                try:
                    return max(0, end_of(file, size) - size)
                except (struct.error, IndexError, ValueError):
                    return 1
    return 0


def _at(file: BinaryIO, place: int, count: int) -> bytes:
    """Return bytes at a place; IndexError where the file ends before."""
    file.seek(place)
    data = file.read(count)
    if len(data) < count:
        raise IndexError(place)
    return data


# -- MP4, MOV ----------------------------------------------------------------------------------------


def _boxes(file: BinaryIO, start: int, end: int) -> Iterator[tuple[bytes, int, int]]:
    """Yield (kind, start of the content, end) of the boxes between two places."""
    at = start
    while at + 8 <= end:
        length, kind = struct.unpack(">I4s", _at(file, at, 8))
        head = 8
        if length == 1:
            length, head = struct.unpack(">Q", _at(file, at + 8, 8))[0], 16
        if length == 0:
            length = end - at
        if length < head:
            raise ValueError(kind)
        yield kind, at + head, at + length
        at += length


def _mp4_end(file: BinaryIO, size: int) -> int:
    """Return the end of the last box or of the last sample that the index points to."""
    last = 0
    for kind, start, end in _boxes(file, 0, size):
        # Some programs append what is no box.
        if kind not in _MP4_KINDS and not kind.isalnum():
            break
        last = max(last, end)
        if kind == b"moov" and end <= size:
            last = max(last, _samples_end(file, start, end))
    return last


def _samples_end(file: BinaryIO, start: int, end: int) -> int:
    """Return where the samples of all tracks end, by the tables of chunks and sizes."""
    last, tables = 0, dict[bytes, tuple[int, int]]()
    for kind, inner, stop in _boxes(file, start, end):
        if kind == b"stbl":
            tables = {k: (a, b) for k, a, b in _boxes(file, inner, stop)}
            last = max(last, _table_end(file, tables))
        elif kind in _MP4_PARENTS:
            last = max(last, _samples_end(file, inner, stop))
    return last


def _table_end(file: BinaryIO, tables: dict[bytes, tuple[int, int]]) -> int:
    """Return the end of the chunk that lies last, by its offset and the sizes of its samples."""
    wide = b"co64" in tables
    if not (wide or b"stco" in tables) or b"stsz" not in tables or b"stsc" not in tables:
        return 0
    offsets = _numbers(file, tables[b"co64" if wide else b"stco"][0] + 4, "Q" if wide else "I")
    runs = _numbers(file, tables[b"stsc"][0] + 4, "III")
    fixed, count = struct.unpack(">II", _at(file, tables[b"stsz"][0] + 4, 8))
    sizes = [fixed] * count if fixed else _numbers(file, tables[b"stsz"][0] + 8, "I")
    last, sample = 0, 0
    for number, (first, each, _) in enumerate(zip(runs[0::3], runs[1::3], runs[2::3], strict=True)):
        after = runs[3 * (number + 1)] if 3 * (number + 1) < len(runs) else len(offsets) + 1
        for chunk in range(first, min(after, len(offsets) + 1)):
            last = max(last, offsets[chunk - 1] + sum(sizes[sample : sample + each]))
            sample += each
    return last


def _numbers(file: BinaryIO, place: int, form: str) -> list[int]:
    """Return a table's numbers: a count, then that many rows of big-endian values."""
    (count,) = struct.unpack(">I", _at(file, place, 4))
    row = struct.calcsize(f">{form}")
    return [
        number
        for values in struct.iter_unpack(f">{form}", _at(file, place + 4, count * row))
        for number in values
    ]


# -- Matroska, WebM ----------------------------------------------------------------------------------


def _matroska_end(file: BinaryIO, size: int) -> int:
    """Return the end of the last element; segments and clusters of a live recording have no length."""
    at, last = 0, 0
    while at < size:
        number, at = _variable(file, at, keep_marker=True)
        length, start = _variable(file, at, keep_marker=False)
        unknown = length == (1 << 7 * (start - at)) - 1
        if unknown and number not in {_SEGMENT, _CLUSTER}:
            raise ValueError(number)
        last = max(last, start if unknown else start + length)
        at = start if number in {_SEGMENT, _CLUSTER} else start + length
    return last


def _variable(file: BinaryIO, at: int, *, keep_marker: bool) -> tuple[int, int]:
    """Return a number of variable length and the place after it."""
    first = _at(file, at, 1)[0]
    count = 9 - first.bit_length()
    if count > 8:
        raise ValueError(first)
    value = int.from_bytes(_at(file, at, count), "big")
    return (value if keep_marker else value & ((1 << 7 * count) - 1)), at + count


# -- RIFF, Ogg, FLV, ASF -----------------------------------------------------------------------------


def _avi_end(file: BinaryIO, size: int) -> int:
    """Return the end of the last RIFF chunk; one of length 0 was never closed: its list is walked."""
    at, last = 0, 0
    while at + 12 <= size:
        sign, length = struct.unpack("<4sI", _at(file, at, 8))
        if sign != b"RIFF":
            break
        if length == 0:
            return _chunks_end(file, at + 12, size)
        last = at + 8 + length
        at = last + length % 2
    return last


def _chunks_end(file: BinaryIO, at: int, size: int) -> int:
    last = at
    while at + 8 <= size:
        sign, length = struct.unpack("<4sI", _at(file, at, 8))
        if not sign.strip(b"\0"):
            return last
        inside = sign == b"LIST" and (length == 0 or _at(file, at + 8, 4) in {b"movi", b"rec "})
        last = at + 12 if inside else at + 8 + length
        at = last + (0 if inside else length % 2)
    return last


def _ogg_end(file: BinaryIO, size: int) -> int:
    at = 0
    while at < size:
        head = _at(file, at, _OGG_HEADER)
        if head[:4] != b"OggS":
            break
        at += _OGG_HEADER + head[26] + sum(_at(file, at + _OGG_HEADER, head[26]))
    return at


def _flv_end(file: BinaryIO, size: int) -> int:
    at = int.from_bytes(_at(file, 5, 4), "big") + 4
    while at < size:
        at += _FLV_TAG + int.from_bytes(_at(file, at, 4)[1:], "big") + 4
    return at


def _asf_end(file: BinaryIO, size: int) -> int:
    at = 0
    while at < size:
        length = int.from_bytes(_at(file, at + 16, 8), "little")
        at += max(length, _ASF_OBJECT)
    return at


_KINDS: tuple[tuple[Callable[[bytes], bool], Callable[[BinaryIO, int], int]], ...] = (
    (lambda head: head[4:8] in _MP4_KINDS, _mp4_end),
    (lambda head: head[:4] == EBML, _matroska_end),
    (lambda head: head[:4] == b"RIFF" and head[8:12] == b"AVI ", _avi_end),
    (lambda head: head[:4] == b"OggS", _ogg_end),
    (lambda head: head[:3] == b"FLV", _flv_end),
    (lambda head: head[:4] == b"\x30\x26\xb2\x75", _asf_end),
)
