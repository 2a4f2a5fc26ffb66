"""ArduPilot's DataFlash logs (.bin): formats by pymavlink, messages found again after damage.

A log describes its own messages: FMT gives type, length, name, format and columns of each. Without
a mapping, poses come from the EKF (XKF1), commands of a rover from THR and STER.
"""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
from pymavlink.DFReader import FORMAT_TO_STRUCT, DFFormat

from hil.core.errors import BadInput
from hil.record.log_mapping import Source
from hil.record.log_signals import read_bytes
from hil.record.log_topics import Topic, TopicLog
from hil.record.log_walk import Holes, walk

_HEAD = b"\xa3\x95"
_FMT = 0x80
_FMT_BYTES = 89
_TIMES = {"TimeUS": 1e-6, "TimeMS": 1e-3}
_INSTANCES = ("C", "I", "Inst", "Instance")
_DEG = math.pi / 180.0

# ArduPilot's log message reference: XKF1.PN, PE in m, Yaw in degrees clockwise from north; STER's
# DesTurnRate in degrees/s clockwise; BAT.Volt in V.
STANDARD = {
    "est_x_m": Source(message="XKF1", field="PE"),
    "est_y_m": Source(message="XKF1", field="PN"),
    "est_theta_rad": Source(message="XKF1", field="Yaw", scale=-_DEG, offset=math.pi / 2),
    "eta1_cmd_m_s": Source(message="THR", field="DesSpeed"),
    "theta_dot_cmd_rad_s": Source(message="STER", field="DesTurnRate", scale=-_DEG),
    "battery_v": Source(message="BAT", field="Volt"),
}


def read_dataflash(path: Path) -> TopicLog:
    """Return the topics of a DataFlash log; raises BadInput."""
    data = read_bytes(path)
    holes = Holes()
    formats = _formats(data)
    if len(formats) < 2:
        raise BadInput(f"{path}: describes no message (FMT): no DataFlash log of ArduPilot")

    def end_of(at: int) -> int | None:
        if data[at : at + 2] != _HEAD or at + 2 >= len(data) or data[at + 2] not in formats:
            return None
        end = at + int(formats[data[at + 2]].len)
        return end if end <= len(data) else None

    def next_start(at: int) -> int | None:
        found = data.find(_HEAD, at)
        return None if found < 0 else found

    rows: dict[str, list[tuple[Any, ...]]] = {}
    for at, end in walk(len(data), 0, end_of, next_start, holes):
        form = formats[data[at + 2]]
        if any(name in form.colhash for name in _TIMES):
            values = struct.unpack(form.msg_struct, data[at + 3 : end])
            rows.setdefault(_topic_name(form, values), []).append(values)
    by_name = {str(form.name): form for form in formats.values()}
    topics = {
        name: _topic(by_name[name.partition("[")[0]], messages) for name, messages in rows.items()
    }
    return TopicLog(path, _first_instances(topics), STANDARD, tuple(holes.notes()))


def _formats(data: bytes) -> dict[int, Any]:
    """Return the format of each message type the log describes, wherever the description stands."""
    found: dict[int, Any] = {
        _FMT: DFFormat(_FMT, "FMT", _FMT_BYTES, "BBnNZ", "Type,Length,Name,Format,Columns")
    }
    at = data.find(_HEAD + bytes([_FMT]))
    while at >= 0:
        body = data[at + 3 : at + _FMT_BYTES]
        form = _format(body) if len(body) == _FMT_BYTES - 3 else None
        if form is not None and form.type not in found:
            found[form.type] = form
        at = data.find(_HEAD + bytes([_FMT]), at + 1)
    return found


def _format(body: bytes) -> Any:
    """Return the format that a FMT message describes, None for one that cannot be."""
    kind, length, name, letters, columns = struct.unpack("<BB4s16s64s", body)
    try:
        texts = [part.rstrip(b"\0").decode("ascii") for part in (name, letters, columns)]
    except UnicodeDecodeError:
        return None
    if not texts[0].isprintable() or any(c not in FORMAT_TO_STRUCT for c in texts[1]):
        return None
    if len(texts[2].split(",")) != len(texts[1]):
        return None
    form = DFFormat(kind, texts[0], length, texts[1], texts[2])
    return form if struct.calcsize(form.msg_struct) == length - 3 else None


def _instance(form: Any) -> str | None:
    """Return the column that numbers the instances of a message, None when it has none."""
    for column, letter in zip(form.columns, form.format, strict=True):
        if column in _INSTANCES and letter == "B":
            return str(column)
    return None


def _topic_name(form: Any, values: tuple[Any, ...]) -> str:
    column = _instance(form)
    return f"{form.name}[{values[form.colhash[column]]}]" if column else str(form.name)


def _first_instances(topics: dict[str, Topic]) -> dict[str, Topic]:
    """Add to topics of several instances the name without a number, which is the first of them."""
    plain: dict[str, Topic] = {}
    for name in sorted(topics, key=lambda name: (len(name), name)):
        plain.setdefault(name.partition("[")[0], topics[name])
    return topics | plain


def _topic(form: Any, messages: list[tuple[Any, ...]]) -> Topic:
    fields = {}
    for k, (column, letter) in enumerate(zip(form.columns, form.format, strict=True)):
        _, scale, kind = FORMAT_TO_STRUCT[letter]
        if kind is not str:
            raw = np.array([values[k] for values in messages], dtype=np.float64)
            fields[str(column)] = raw if scale is None else raw * scale
    name = next(name for name in _TIMES if name in form.colhash)
    return Topic(fields[name] * _TIMES[name], fields)
