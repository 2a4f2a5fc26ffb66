"""PX4's ULog (.ulg), read by pyulog (extra `logs`) after what is no message was cut out.

Without a mapping, poses come from vehicle_local_position.
"""

from __future__ import annotations

import contextlib
import io
import math
from pathlib import Path
from typing import Any

import numpy as np

from hil.core.errors import BadInput
from hil.record.log_mapping import Source
from hil.record.log_signals import read_format
from hil.record.log_topics import Topic, TopicLog
from hil.record.log_walk import Holes, walk

_MAGIC = b"ULog\x01\x12\x35"
_HEADER_BYTES = 16
# Message types of the ULog format, version 1.
_TYPES = frozenset(b"BFIMPQALCDSOR")

# PX4's VehicleLocalPosition.msg: x north, y east in m, heading from north, clockwise, in rad.
STANDARD = {
    "est_x_m": Source(message="vehicle_local_position", field="y"),
    "est_y_m": Source(message="vehicle_local_position", field="x"),
    "est_theta_rad": Source(
        message="vehicle_local_position", field="heading", scale=-1.0, offset=math.pi / 2
    ),
    "battery_v": Source(message="battery_status", field="voltage_v"),
}


def read_ulog(path: Path) -> TopicLog:
    """Return the topics of a ULog; raises BadInput."""
    data = read_format(path, "pyulog", "ULog", _MAGIC, "a ULog")
    from pyulog import ULog  # noqa: PLC0415 - an extra

    holes = Holes()
    whole = _without_holes(data, holes)
    said = io.StringIO()  # pyulog prints what it thinks of a file
    try:
        with contextlib.redirect_stdout(said):
            log = ULog(io.BytesIO(whole))
    except Exception as error:  # pyulog raises whatever a damaged definition leads to
        told = " ".join(f"{type(error).__name__}: {error}".split())
        raise BadInput(f"{path}: pyulog cannot read it: {told}") from None
    if log.file_corruption and not holes.holes:
        holes.others.append(
            "pyulog says that the file is damaged: what it could not read is left out"
        )
    lost = [dropout.duration for dropout in log.dropouts]
    if lost:
        holes.others.append(f"the logger dropped messages {len(lost)} times, {sum(lost)} ms in all")
    timed = [item for item in log.data_list if "timestamp" in item.data]
    if len(timed) < len(log.data_list):
        holes.others.append(f"{len(log.data_list) - len(timed)} topics without a time: left out")
    return TopicLog(path, _topics(timed), STANDARD, tuple(holes.notes()))


def _without_holes(data: bytes, holes: Holes) -> bytes:
    """Return the log without what is no message."""

    def end_of(at: int) -> int | None:
        if at + 3 > len(data) or data[at + 2] not in _TYPES:
            return None
        size = int.from_bytes(data[at : at + 2], "little")
        end = at + 3 + size
        return end if size and end <= len(data) else None

    pieces = [data[:_HEADER_BYTES]]
    places = walk(
        len(data), _HEADER_BYTES, end_of, lambda at: at if at < len(data) else None, holes
    )
    pieces += [data[at:end] for at, end in places]
    return b"".join(pieces)


def _topics(data: list[Any]) -> dict[str, Topic]:
    """Return every instance of every topic; the plain name is the first instance's."""
    found: dict[str, Topic] = {}
    for item in sorted(data, key=lambda item: (item.name, item.multi_id)):
        with np.errstate(invalid="ignore"):  # a damaged float may be a NaN that signals
            fields = {name: np.asarray(x, dtype=np.float64) for name, x in item.data.items()}
        topic = Topic(fields["timestamp"] * 1e-6, fields)
        found[f"{item.name}[{item.multi_id}]"] = topic
        found.setdefault(item.name, topic)
    return found
