"""Logs of messages for the tests: DataFlash packed by hand, ULog by pyulog, MCAP by mcap."""

from __future__ import annotations

import io
import json
import math
import struct
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import CompressionType, Writer
from pyulog import ULog

from tests.replay.logs import arc

HEAD = b"\xa3\x95"
START_US = 5_000_000
Row = tuple[float, float, float, float]


def rows_of(count: int = 100, period_s: float = 0.05) -> list[Row]:
    """Return (t, x, y, theta) on the arc of 0.3 m/s and 0.5 rad/s."""
    return [(k * period_s, *arc(k * period_s)) for k in range(count)]


def _format(kind: int, name: str, letters: str, columns: str, size: int) -> bytes:
    return HEAD + struct.pack(
        "<BBB4s16s64s", 0x80, kind, size, name.encode(), letters.encode(), columns.encode()
    )


def dataflash(rows: Iterable[Row]) -> list[bytes]:
    """Return the messages of a rover's log: formats first, then THR and two cores of XKF1 a row."""
    messages = [
        _format(0x80, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns", 89),
        _format(10, "XKF1", "QBcff", "TimeUS,C,Yaw,PN,PE", 22),
        _format(11, "THR", "Qff", "TimeUS,DesSpeed,Speed", 19),
    ]
    for t_s, x_m, y_m, theta in rows:
        at_us = START_US + round(t_s * 1e6)
        yaw = round(math.degrees(math.remainder(math.pi / 2 - theta, 2 * math.pi)) * 100)
        messages += [
            HEAD + struct.pack("<BQff", 11, at_us, 0.3, 0.29),
            HEAD + struct.pack("<BQBhff", 10, at_us, 0, yaw, y_m, x_m),
            HEAD + struct.pack("<BQBhff", 10, at_us, 1, yaw, y_m + 9.0, x_m + 9.0),
        ]
    return messages


def _ulog_message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


def ulog(rows: Iterable[Row]) -> bytes:
    """Return a log of vehicle_local_position, written by pyulog."""
    table = np.array(list(rows))
    form = b"vehicle_local_position:uint64_t timestamp;float x;float y;float heading;"
    first = b"ULog\x01\x12\x35\x01" + bytes(8) + _ulog_message("F", form)
    first += _ulog_message("A", struct.pack("<BH", 0, 0) + b"vehicle_local_position")
    log = ULog(io.BytesIO(first + _ulog_message("D", struct.pack("<HQfff", 0, 0, 0, 0, 0))))
    log.data_list[0].data = {
        "timestamp": np.round(START_US + table[:, 0] * 1e6).astype(np.uint64),
        "x": table[:, 2],
        "y": table[:, 1],
        "heading": math.pi / 2 - table[:, 3],
    }
    out = io.BytesIO()
    log.write_ulog(out)
    return out.getvalue()


def mcap(rows: Iterable[Row], chunk_bytes: int = 500, *, chunks: bool = True) -> bytes:
    """Return a file of /pose in JSON and /blob in an encoding nobody knows, written by mcap."""
    out = io.BytesIO()
    writer = Writer(
        out, chunk_size=chunk_bytes, compression=CompressionType.ZSTD, use_chunking=chunks
    )
    writer.start()
    pose = writer.register_channel("/pose", "json", 0)
    blob = writer.register_channel("/blob", "secret", 0)
    for t_s, x_m, y_m, theta in rows:
        at_ns = (START_US + round(t_s * 1e6)) * 1000
        message: dict[str, Any] = {
            "header": {"frame": "map"},
            "position": {"x": x_m, "y": y_m},
            "angles": [0, 0, math.degrees(theta)],
        }
        writer.add_message(pose, at_ns, json.dumps(message).encode(), at_ns)
    writer.add_message(blob, 0, b"?", 0)
    writer.finish()  # type: ignore[no-untyped-call]
    return out.getvalue()


MCAP_MAP = """
scenario = "circle"
set = ["requirements=[]"]
[columns]
est_x_m = { message = "/pose", field = "position.x" }
est_y_m = { message = "/pose", field = "position.y" }
est_theta_rad = { message = "/pose", field = "angles[2]", scale = 0.017453292519943295 }
"""
PLAIN_MAP = 'scenario = "circle"\nset = ["requirements=[]"]\n'
KINDS = {".bin": PLAIN_MAP, ".ulg": PLAIN_MAP, ".mcap": MCAP_MAP}


def write_log(folder: Path, suffix: str, rows: Iterable[Row]) -> Path:
    """Write a log of one kind, and its mapping beside it."""
    path = folder / f"log{suffix}"
    data = {".bin": lambda r: b"".join(dataflash(r)), ".ulg": ulog, ".mcap": mcap}[suffix](rows)
    path.write_bytes(data)
    path.with_suffix(".toml").write_text(KINDS[suffix], encoding="utf-8")
    return path
