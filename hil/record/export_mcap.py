"""A run as an MCAP file that Foxglove opens: signals by group, poses, events and pictures, in JSON.

Times are wall time: start of the run plus t_s. Poses, texts and pictures have Foxglove's own schemas
(PoseInFrame, Log, CompressedImage), so its panels show them as they are. World frame, SI units.
"""

from __future__ import annotations

import base64
import io
import json
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from mcap.writer import CompressionType, Writer

from hil.record.export_groups import groups

if TYPE_CHECKING:
    from hil.record.reader import RunRecord
    from hil.record.schema import Column

_FRAME = "world"
_TIME = {
    "type": "object",
    "title": "time",
    "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}},
}
_POSES = {"estimate": "est", "truth": "true"}
_LEVELS = {"fault": 4, "note": 3}  # foxglove.Log: 2 info, 3 warning, 4 error

# (time in s since the start, topic, message)
Item = tuple[float, str, dict[str, Any]]


def run_mcap(run: RunRecord) -> bytes:
    """Return the run as the bytes of an MCAP file."""
    out = io.BytesIO()
    writer = Writer(out, compression=CompressionType.ZSTD)
    writer.start(profile="", library="skid-steer-hil")
    columns = groups(run)
    channels = {
        topic: writer.register_channel(
            topic, "json", writer.register_schema(name, "jsonschema", json.dumps(schema).encode())
        )
        for topic, (name, schema) in _schemas(columns).items()
    }
    start_ns = run.manifest.start_unix_us * 1000
    items = [*_signals(run, columns), *_poses(run, start_ns), *_events(run, start_ns)]
    for t_s, topic, message in sorted(
        [*items, *_pictures(run, start_ns)], key=lambda item: item[0]
    ):
        at_ns = max(start_ns + round(t_s * 1e9), 0)
        data = json.dumps(message, allow_nan=False).encode()
        writer.add_message(channels[topic], at_ns, data, at_ns)
    writer.add_metadata("manifest", {"json": run.manifest.model_dump_json()})
    writer.finish()  # type: ignore[no-untyped-call]
    return out.getvalue()


def _schemas(columns: dict[str, list[Column]]) -> dict[str, tuple[str, dict[str, Any]]]:
    """Return topic -> (name of the schema, JSON Schema)."""
    found: dict[str, tuple[str, dict[str, Any]]] = {
        "/events": ("foxglove.Log", _object(timestamp=_TIME, level="integer", message="string",
                                            name="string", file="string", line="integer")),
        "/pictures": ("foxglove.CompressedImage", _object(
            timestamp=_TIME, frame_id="string", format="string",
            data={"type": "string", "contentEncoding": "base64"})),
    }  # fmt: skip
    pose = _object(
        position=_object(x="number", y="number", z="number"),
        orientation=_object(x="number", y="number", z="number", w="number"),
    )
    for topic in _POSES:
        found[f"/{topic}/pose"] = (
            "foxglove.PoseInFrame",
            _object(timestamp=_TIME, frame_id="string", pose=pose),
        )
    for group, members in columns.items():
        fields = {
            column.name: {"type": "number", "description": f"{column.meaning} ({column.unit})"}
            for column in members
        }
        found[f"/{group}"] = (f"hil.{group}", _object(t_s="number", **fields))
    return found


def _object(**properties: str | dict[str, Any]) -> dict[str, Any]:
    kinds = {
        name: {"type": kind} if isinstance(kind, str) else kind for name, kind in properties.items()
    }
    return {"type": "object", "properties": kinds}


def _signals(run: RunRecord, columns: dict[str, list[Column]]) -> Iterator[Item]:
    times_s = run.samples["t_s"].tolist()
    for group, members in columns.items():
        values = [run.samples[column.name].tolist() for column in members]
        for t_s, *row in zip(times_s, *values, strict=True):
            known = {c.name: v for c, v in zip(members, row, strict=True) if math.isfinite(v)}
            yield t_s, f"/{group}", {"t_s": t_s} | known


def _poses(run: RunRecord, start_ns: int) -> Iterator[Item]:
    for topic, prefix in _POSES.items():
        names = ("t_s", f"{prefix}_x_m", f"{prefix}_y_m", f"{prefix}_theta_rad")
        for t_s, x_m, y_m, theta in zip(*(run.samples[n].tolist() for n in names), strict=True):
            if math.isfinite(x_m + y_m + theta):
                turn = {"x": 0.0, "y": 0.0, "z": math.sin(theta / 2), "w": math.cos(theta / 2)}
                pose = {"position": {"x": x_m, "y": y_m, "z": 0.0}, "orientation": turn}
                stamp = _stamp(start_ns, t_s)
                message = {"timestamp": stamp, "frame_id": _FRAME, "pose": pose}
                yield t_s, f"/{topic}/pose", message


def _events(run: RunRecord, start_ns: int) -> Iterator[Item]:
    for event in run.events:
        yield (
            event.t_s,
            "/events",
            {
                "timestamp": _stamp(start_ns, event.t_s),
                "level": _LEVELS.get(event.kind, 2),
                "message": event.text,
                "name": event.kind,
                "file": "",
                "line": 0,
            },
        )


def _pictures(run: RunRecord, start_ns: int) -> Iterator[Item]:
    for picture in run.pictures:
        yield (
            picture.t_s,
            "/pictures",
            {
                "timestamp": _stamp(start_ns, picture.t_s),
                "frame_id": "camera",
                "format": "jpeg",
                "data": base64.b64encode(picture.path.read_bytes()).decode("ascii"),
            },
        )


def _stamp(start_ns: int, t_s: float) -> dict[str, int]:
    at_ns = max(start_ns + round(t_s * 1e9), 0)
    return {"sec": at_ns // 10**9, "nsec": at_ns % 10**9}
