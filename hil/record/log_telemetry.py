"""Telemetry logs of other programs: whose pose it is, whose commands, and what has no value.

A row is made for each message that gives est_x_m; other signals hold their latest value. Several
vehicles in one log are told apart by MAVLink system and component; fields that a message says to
ignore, or that have the value the standard gives to "unknown", are empty.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hil.core.errors import BadInput
from hil.record.log_frames import Damage, Message, messages
from hil.record.log_mapping import STANDARD, LogMapping, Source
from hil.record.log_signals import (
    POSE,
    Signals,
    fall_text,
    held,
    in_order,
    read_bytes,
    scaled,
    whole_poses,
)

_SETPOINT = "SET_POSITION_TARGET_LOCAL_NED"
# MAV_FRAME_BODY_NED, _BODY_OFFSET_NED, _BODY_FRD: vx is along the vehicle.
_BODY_FRAMES = frozenset({8, 9, 12})
_IGNORED = {  # bit of type_mask that says to leave a field alone (MAVLink common)
    name: 1 << bit
    for bit, name in enumerate(("x", "y", "z", "vx", "vy", "vz", "afx", "afy", "afz"))
} | {"yaw": 1 << 10, "yaw_rate": 1 << 11}
_MASKED = frozenset(
    {
        _SETPOINT,
        "POSITION_TARGET_LOCAL_NED",
        "SET_POSITION_TARGET_GLOBAL_INT",
        "POSITION_TARGET_GLOBAL_INT",
    }
)
_ATTITUDE_IGNORED = {
    "body_roll_rate": 1,
    "body_pitch_rate": 2,
    "body_yaw_rate": 4,
    "thrust": 64,
    "q": 128,
}
_LIMITS = {
    f"{kind}{bits}_MAX": (1 << (bits - (kind == "INT"))) - 1
    for kind in ("INT", "UINT")
    for bits in (8, 16, 32)
}


class Sender(NamedTuple):
    """Who sent a message, and to which system (None: to nobody in particular)."""

    system: int
    component: int
    target: int | None

    def __str__(self) -> str:
        return f"system {self.system} component {self.component}"


@dataclass(slots=True)
class _Series:
    """Values of one signal from one sender in the order of the log."""

    t_s: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    at: list[int] = field(default_factory=list)


class _Log:
    """Everything of a telemetry log that the sources ask for."""

    def __init__(self, path: Path, sources: dict[str, Source]) -> None:
        self.path = path
        self.sources = sources
        self.damage = Damage()
        self.notes: list[str] = []
        self.frames: list[tuple[float, bytes]] = []
        self.series: dict[str, dict[Sender, _Series]] = {name: {} for name in sources}
        self._other_frames: Counter[int] = Counter()
        wanted: dict[str, list[str]] = defaultdict(list)
        for name, source in sources.items():
            wanted[source.message].append(name)
        for message in messages(read_bytes(path), self.damage):
            if message.frame is not None:
                self.frames.append((message.t_s, message.frame))
            for name in wanted.get(message.name, ()):
                self._take(name, sources[name], message)
        self.notes += self.damage.notes()
        for number, count in sorted(self._other_frames.items()):
            self.notes.append(
                f"{count} set-points in frame {number}, which is not the robot's own: "
                "no forward speed in them"
            )

    def _take(self, name: str, source: Source, message: Message) -> None:
        target = getattr(message.values, "target_system", None)
        sender = Sender(message.system, message.component, target)
        series = self.series[name].setdefault(sender, _Series())
        value = value_of(message.name, message.values, source.field, str(self.path))
        if source == STANDARD.get(name) and message.name == _SETPOINT and source.field == "vx":
            frame = message.values.coordinate_frame
            if frame not in _BODY_FRAMES and math.isfinite(value):
                self._other_frames[frame] += 1
                value = math.nan
        series.t_s.append(message.t_s)
        series.values.append(value)
        series.at.append(message.at)


def read_tlog(path: Path, settings: LogMapping) -> Signals:
    """Return a row per pose of the chosen vehicle; raises BadInput."""
    sources = STANDARD | {n: s for n, s in settings.columns.items() if s.message}
    log = _Log(path, sources)
    robot, others = _robot(log, settings)
    notes = list(log.notes)
    columns: dict[str, _Series] = {}
    for name, source in sources.items():
        chosen, said = _chosen(log, name, robot, others)
        notes += said
        if chosen is not None:
            columns[name], said = _ordered(log, name, source, chosen, settings)
            notes += said
    rows = columns["est_x_m"].t_s
    filled = {name: held(series.t_s, series.values, rows) for name, series in columns.items()}
    empty = [n for n, values in filled.items() if n not in POSE and not np.isfinite(values).any()]
    signals = whole_poses(
        np.array(rows), {n: v for n, v in filled.items() if n not in empty}, str(path)
    )
    start_s = _first_whole(rows, filled)
    frames = tuple((t_s - start_s, frame) for t_s, frame in log.frames)
    return Signals(
        signals.t_s, signals.columns, frames, tuple(dict.fromkeys((*notes, *signals.notes)))
    )


def _first_whole(rows: list[float], columns: dict[str, Any]) -> float:
    whole = np.all([np.isfinite(columns[name]) for name in POSE], axis=0)
    return rows[int(np.flatnonzero(whole)[0])]


def _robot(log: _Log, settings: LogMapping) -> tuple[Sender, set[int]]:
    """Return who gives the pose, and the systems that are other vehicles; raises BadInput."""
    source = log.sources["est_x_m"]
    found = log.series["est_x_m"]
    if not log.damage.messages:
        raise BadInput(
            f"{log.path}: no telemetry frame in it; a .tlog has 8 bytes of time before each frame"
        )
    if not found:
        raise BadInput(
            f"{log.path}: has no {source.message} among its {log.damage.messages} messages; "
            "name the message of the pose in a mapping"
        )
    system = source.system or settings.system
    component = settings.component if source.component is None else source.component
    fitting = [
        sender
        for sender in found
        if system in {None, sender.system} and component in {None, sender.component}
    ]
    told = ", ".join(f"{sender} ({len(found[sender].t_s)})" for sender in sorted(found, key=str))
    if not fitting:
        raise BadInput(f"{log.path}: {source.message} comes from {told} and from no other")
    if len(fitting) > 1:
        raise BadInput(
            f"{log.path}: poses of more than one vehicle: {source.message} comes from {told}; say in"
            f" a mapping which is the robot: system = {fitting[0].system}"
            + (f", component = {fitting[0].component}" if _one_system(fitting) else "")
        )
    return fitting[0], {sender.system for sender in found} - {fitting[0].system}


def _one_system(senders: list[Sender]) -> bool:
    return len({sender.system for sender in senders}) == 1


def _chosen(
    log: _Log, name: str, robot: Sender, others: set[int]
) -> tuple[list[Sender] | None, list[str]]:
    """Return which senders' values a column takes, None for a column that stays empty."""
    source, found = log.sources[name], list(log.series[name])
    if name == "est_x_m":
        return [robot], []
    fitting = [
        sender
        for sender in found
        if source.system in {None, sender.system} and source.component in {None, sender.component}
    ]
    if source.system is None:
        fitting = [sender for sender in fitting if not _is_of(sender, others)]
        own = [sender for sender in fitting if robot.system in {sender.system, sender.target}]
        broadcast = [sender for sender in fitting if sender.target == 0]
        fitting = own + [s for s in broadcast if s not in own] or fitting
        exact = [s for s in fitting if s[:2] == robot[:2] and s.target is None]
        fitting = exact or fitting
    if not fitting:
        return None, []
    stranger = not any(robot.system in {s.system, s.target} or s.target == 0 for s in fitting)
    if name in POSE and stranger and source.system is None:
        raise BadInput(
            f"{log.path}: {name} would come from {fitting[0]} and est_x_m from {robot}; name both in"
            " a mapping"
        )
    if len(fitting) > 1 and any(sender.target is None for sender in fitting):
        told = ", ".join(str(sender) for sender in fitting)
        said = f"{source.message} comes from {told}: {name} left empty; name one in a mapping"
        if name in POSE:
            raise BadInput(f"{log.path}: {said.replace(': ' + name + ' left empty', '')}")
        return None, [said]
    if stranger and source.system is None:
        return fitting, [f"{source.message} taken from {fitting[0]}: there is none of {robot}"]
    return fitting, []


def _is_of(sender: Sender, others: set[int]) -> bool:
    """Return whether a message belongs to another vehicle: sent by it, or meant for it."""
    return sender.system in others or (sender.target or 0) in others


def _ordered(
    log: _Log, name: str, source: Source, senders: list[Sender], settings: LogMapping
) -> tuple[_Series, list[str]]:
    """Return one series in order of time and in the column's unit; raises BadInput."""
    notes: list[str] = []
    joined = _Series()
    for sender in senders:
        series = log.series[name][sender]
        t_s, at = np.array(series.t_s), series.at

        def refusal(k: int, t_s: Any = t_s, at: list[int] = at, sender: Sender = sender) -> str:
            return (
                f"{log.path}: {source.message} no. {k + 1} of {sender} (byte {at[k]}): "
                f"{fall_text(t_s[k - 1] - t_s[0], t_s[k] - t_s[0])}"
            )

        what = f"{source.message} of {sender}"
        places, said = in_order(t_s, settings.disorder, refusal, what)
        notes += said
        values = scaled(np.array(series.values), source)
        joined.t_s += t_s[places].tolist()
        joined.values += values[places].tolist()
    if len(senders) > 1:
        order = np.argsort(joined.t_s, kind="stable")
        joined.t_s = [joined.t_s[k] for k in order]
        joined.values = [joined.values[k] for k in order]
    return joined, notes


def value_of(message: str, values: Any, name: str, where: str) -> float:
    """Return a field of a message as a number, NaN for one that says it has no value.

    `name` may end in [k] for one element of an array. Raises BadInput for a field that is not
    there, or is no number.
    """
    plain, _, index = name.partition("[")
    if not hasattr(values, plain) or plain not in values.get_fieldnames():
        known = ", ".join(values.get_fieldnames())
        raise BadInput(f"{where}: {message} has no field {plain!r}; it has {known}")
    value = getattr(values, plain)
    if index:
        place = int(index[:-1]) if re.fullmatch(r"\d+\]", index) else -1
        if not isinstance(value, list | tuple) or not 0 <= place < len(value):
            raise BadInput(f"{where}: {message}.{name}: there is no such element")
        value = value[place]
    if isinstance(value, list | tuple):
        raise BadInput(
            f"{where}: {message}.{plain} is an array of {len(value)}; name one element, for example"
            f" {plain}[0]"
        )
    if not isinstance(value, int | float):
        raise BadInput(f"{where}: {message}.{plain} is text ({str(value)[:20]!r}), not a number")
    mask = getattr(values, "type_mask", 0)
    bits = _IGNORED if message in _MASKED else _ATTITUDE_IGNORED
    masked = message in _MASKED or message == "SET_ATTITUDE_TARGET"
    if masked and isinstance(mask, int) and mask & bits.get(plain, 0):
        return math.nan
    unknown = _unknown_values().get((message, plain))
    return math.nan if unknown is not None and value == unknown else float(value)


@cache
def _unknown_values() -> dict[tuple[str, str], float]:
    """Return the value by which each field of MAVLink's common messages says "unknown"."""
    found: dict[tuple[str, str], float] = {("SYS_STATUS", "voltage_battery"): 65535.0}
    folder = resources.files("pymavlink.dialects.v20")
    for file in ("minimal.xml", "standard.xml", "common.xml", "ardupilotmega.xml"):
        definition = folder / file
        if not definition.is_file():
            continue
        for message in ET.fromstring(definition.read_bytes()).iter("message"):
            for item in message.iter("field"):
                value = _limit(item.get("invalid", "").strip("[]").rstrip(":"))
                if value is not None:
                    found[(message.get("name", ""), item.get("name", ""))] = value
    return found


def _limit(text: str) -> float | None:
    """Return the number of an `invalid` attribute, None for NaN, a name, or none."""
    if text in _LIMITS:
        return float(_LIMITS[text])
    try:
        value = float(int(text, 16)) if text.startswith("0x") else float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
