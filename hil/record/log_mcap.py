"""MCAP files (Foxglove, ROS 2), read by the package mcap (extra `logs`), through damaged chunks.

Messages in JSON are read as they are; those of ROS 2 and Protobuf with the packages
mcap-ros2-support and mcap-protobuf-support where they are installed. Fields have dotted names, as in
pose.position.x or wheels[2]. There is no standard place of a pose: a mapping says it.
"""

from __future__ import annotations

import importlib
import io
import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.record.log_signals import MOST_BYTES, read_format
from hil.record.log_topics import Topic, TopicLog
from hil.record.log_walk import Holes, walk

if TYPE_CHECKING:
    from mcap.records import Channel, Schema

_MAGIC = b"\x89MCAP0\r\n"
_LAST_OPCODE = 0x0F  # DataEnd
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 0x03, 0x04, 0x05, 0x06
_DECODERS = ("mcap_ros2.decoder", "mcap_protobuf.decoder")

Decode = Callable[[bytes], Any]


def read_mcap(path: Path) -> TopicLog:
    """Return the topics of an MCAP file; raises BadInput."""
    data = read_format(path, "mcap", "MCAP", _MAGIC, "an MCAP file")
    content = _Content()
    end = len(data) - len(_MAGIC) if data.endswith(_MAGIC) else len(data)

    def end_of(at: int) -> int | None:
        if at + 9 > end or not 0 < data[at] <= _LAST_OPCODE:
            return None
        after = at + 9 + int.from_bytes(data[at + 1 : at + 9], "little")
        return after if after <= end else None

    places = walk(end, len(_MAGIC), end_of, lambda at: at if at < end else None, content.holes)
    for at, after in places:
        content.take(data[at], data[at + 9 : after])
    return TopicLog(path, content.topics(), {}, tuple(content.notes()))


class _Content:
    """Collects the messages of a file by topic."""

    def __init__(self) -> None:
        self.holes = Holes()
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._decode: dict[int, Decode | None] = {}
        self._times_s: dict[str, list[float]] = {}
        self._rows: dict[str, list[dict[str, float]]] = {}
        self._chunks_lost = 0
        self._unreadable: Counter[str] = Counter()
        self._unknown: Counter[str] = Counter()

    def take(self, opcode: int, body: bytes) -> None:
        """Take one record of the file, or of a chunk."""
        from mcap.data_stream import ReadDataStream  # noqa: PLC0415 - an extra
        from mcap.records import Channel, Chunk, Message, Schema  # noqa: PLC0415

        stream = ReadDataStream(io.BytesIO(body))
        try:
            if opcode == _CHUNK:
                self._chunk(Chunk.read(stream))
            elif opcode == _SCHEMA:
                schema = Schema.read(stream)
                self._schemas[schema.id] = schema
            elif opcode == _CHANNEL:
                channel = Channel.read(stream)
                self._channels[channel.id] = channel
            elif opcode == _MESSAGE:
                message = Message.read(stream, len(body))
                self._message(message.channel_id, message.log_time, message.data)
        except Exception:  # whatever a damaged record leads to inside the package
            self._chunks_lost += opcode == _CHUNK
            self._unreadable["records"] += opcode != _CHUNK

    def _chunk(self, chunk: Any) -> None:
        from mcap.stream_reader import get_chunk_data_stream  # noqa: PLC0415 - an extra

        if chunk.uncompressed_size > MOST_BYTES:
            raise ValueError("larger than any log that is read")
        stream, size = get_chunk_data_stream(chunk, validate_crc=True)
        data = stream.read(size)
        at = 0
        while at + 9 <= len(data):
            after = at + 9 + int.from_bytes(data[at + 1 : at + 9], "little")
            self.take(data[at], data[at + 9 : after])
            at = after

    def _message(self, channel_id: int, log_time_ns: int, data: bytes) -> None:
        channel = self._channels.get(channel_id)
        if channel is None:
            self._unknown["a channel that the file does not describe"] += 1
            return
        if channel_id not in self._decode:
            self._decode[channel_id] = _decoder(channel, self._schemas.get(channel.schema_id))
        decode = self._decode[channel_id]
        if decode is None:
            self._unknown[f"topic {channel.topic}, encoded as {channel.message_encoding!r}"] += 1
            return
        try:
            row = dict(_numbers("", decode(data)))
        except Exception:  # whatever the decoder says of a damaged message
            self._unreadable[f"messages of {channel.topic}"] += 1
            return
        self._times_s.setdefault(channel.topic, []).append(log_time_ns * 1e-9)
        self._rows.setdefault(channel.topic, []).append(row)

    def topics(self) -> dict[str, Topic]:
        """Return the topics; a field that a message does not have is NaN there."""
        found = {}
        for topic, rows in self._rows.items():
            names = dict.fromkeys(name for row in rows for name in row)
            fields = {name: np.array([row.get(name, np.nan) for row in rows]) for name in names}
            found[topic] = Topic(np.array(self._times_s[topic]), fields)
        return found

    def notes(self) -> Iterator[str]:
        """Yield a line for each kind of thing that was left out."""
        yield from self.holes.notes()
        if self._chunks_lost:
            yield f"{self._chunks_lost} chunks with a wrong checksum or damaged inside: left out"
        for what, count in self._unreadable.items():
            yield f"{count} {what} cannot be read: left out"
        for what, count in self._unknown.items():
            yield f"{count} messages of {what}: left out"


def _decoder(channel: Channel, schema: Schema | None) -> Decode | None:
    """Return what decodes the messages of a channel, None when nothing here does."""
    if channel.message_encoding == "json":
        return json.loads
    for module in _DECODERS:
        try:
            factory = importlib.import_module(module).DecoderFactory()
        except ImportError:
            continue
        decode: Decode | None = factory.decoder_for(channel.message_encoding, schema)
        if decode is not None:
            return decode
    return None


def _numbers(name: str, value: Any) -> Iterator[tuple[str, float]]:
    """Yield (dotted name, number) of every number and truth value inside a message."""
    if isinstance(value, bool | int | float):
        yield name, float(value)
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _numbers(f"{name}.{key}" if name else str(key), inner)
    elif isinstance(value, list | tuple):
        for k, inner in enumerate(value):
            yield from _numbers(f"{name}[{k}]", inner)
    elif hasattr(value, "__slots__"):  # ROS 2 messages
        for key in value.__slots__:
            yield from _numbers(f"{name}.{key}" if name else key, getattr(value, key))
    elif hasattr(value, "ListFields"):  # Protobuf
        for item, inner in value.ListFields():
            yield from _numbers(f"{name}.{item.name}" if name else item.name, inner)
