"""A run as PX4's ULog: signals by group, and the pose where PX4's tools look for it.

pyulog writes the log it has read. So a log with the definitions and one message of each topic is
made here, read by pyulog, filled with the run, and written by pyulog. Events and pictures have no
place in it; `vehicle_local_position` has the estimate, north and east for world Y and X.
"""

from __future__ import annotations

import io
import struct
from typing import TYPE_CHECKING

import numpy as np
from pyulog import ULog

from hil.record.export_groups import groups

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.record.reader import RunRecord

    Fields = dict[str, NDArray[np.float64]]

_MAGIC = b"ULog\x01\x12\x35\x01"
_STAMP = "timestamp"


def run_ulog(run: RunRecord) -> bytes:
    """Return the run as the bytes of a ULog; timestamps are microseconds since the first tick."""
    topics: dict[str, Fields] = {
        f"hil_{group}": {column.name: run.samples[column.name] for column in members}
        for group, members in groups(run).items()
    }
    samples = run.samples
    topics["vehicle_local_position"] = {
        "x": samples["est_y_m"],
        "y": samples["est_x_m"],
        "heading": np.pi / 2 - samples["est_theta_rad"],
    }
    log = ULog(io.BytesIO(_definitions(topics)))
    stamps_us = np.round((samples["t_s"] - samples["t_s"][:1]) * 1e6).astype(np.uint64)
    for item in log.data_list:
        item.data = {_STAMP: stamps_us} | topics[item.name]
    out = io.BytesIO()
    log.write_ulog(out)
    return out.getvalue()


def _definitions(topics: dict[str, Fields]) -> bytes:
    """Return a log that describes the topics and has one empty message of each."""
    formats, links, data = [], [], []
    for number, (topic, fields) in enumerate(topics.items()):
        names = "".join(f"double {name};" for name in fields)
        formats.append(_message("F", f"{topic}:uint64_t {_STAMP};{names}".encode()))
        links.append(_message("A", struct.pack("<BH", 0, number) + topic.encode()))
        data.append(_message("D", struct.pack("<HQ", number, 0) + bytes(8 * len(fields))))
    return b"".join([_MAGIC, bytes(8), *formats, *links, *data])


def _message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body
