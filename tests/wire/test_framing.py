"""Cutting, checking, decoding and encoding of frames, against pymavlink's own code."""

import math
import random

import pytest
from fastcrc.crc16 import mcrf4xx
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.wire import _wire, dialect
from hil.wire.framing import FrameReader, FrameWriter

F32 = st.floats(width=32, allow_nan=False)
I32 = st.integers(-(2**31), 2**31 - 1)
U32 = st.integers(0, 2**32 - 1)
I16 = st.integers(-(2**15), 2**15 - 1)
U16 = st.integers(0, 2**16 - 1)
U8 = st.integers(0, 255)
WHEEL_STATE = st.builds(
    dialect.MAVLink_wheel_state_message,
    U32, I32, I32, F32, F32, F32, F32, F32, F32, U32, I16, I16, U16, U8, U8, U8,
)  # fmt: skip


def board_frames(*messages) -> bytes:
    """Return the frames as pymavlink packs them for the board, numbered from 0."""
    mavlink = dialect.MAVLink(None, 1, 1)
    data = b""
    for message in messages:
        data += bytes(message.pack(mavlink))
        mavlink.seq = (mavlink.seq + 1) & 0xFF
    return data


def wheel_state(t_mcu_us: int):
    return dialect.MAVLink_wheel_state_message(
        t_mcu_us, 10, -20, 1.5, -2.5, 0.0, 0.0, 0.1, 0.2, 5, 100, -100, 7, 1, 0, 0
    )


@given(WHEEL_STATE)
def test_the_short_way_decodes_as_pymavlink(message):
    """Every field of a WHEEL_STATE is what the generated decoder says, zeros cut off or not."""
    frame = board_frames(message)
    ((msg_id, fast, raw),) = FrameReader().feed(frame)
    slow = dialect.MAVLink(None).decode(bytearray(frame))
    assert msg_id == slow.get_msgId()
    assert raw == frame
    for name in slow.fieldnames:
        assert getattr(fast, name) == getattr(slow, name), name


@given(F32, F32, U16, U8)
def test_the_short_way_encodes_as_pymavlink(left, right, seq, frames_before):
    """A set-point frame is byte for byte what the generated pack makes, zeros cut off."""
    writer = FrameWriter()
    mavlink = dialect.MAVLink(None, 255, 190)
    for _ in range(frames_before):
        writer.encode(dialect.MAVLink_timesync_message(0, 1))
    mavlink.seq = frames_before & 0xFF
    expected = dialect.MAVLink_wheel_setpoint_message(left, right, seq).pack(mavlink)
    assert writer.encode_setpoint(left, right, seq) == bytes(expected)


@settings(max_examples=50)
@given(st.lists(st.integers(1, 40), min_size=1, max_size=30), st.randoms(use_true_random=False))
def test_any_cut_of_the_stream_gives_the_same_messages(cuts, rng):
    """Where the reads fall does not matter: byte by byte or all at once, in or out of frames."""
    messages = [wheel_state(t) for t in range(5)] + [dialect.MAVLink_timesync_message(3, 4)]
    rng.shuffle(messages)
    stream = board_frames(*messages)
    reader, received = FrameReader(), []
    while stream:
        size = cuts[len(received) % len(cuts)] if cuts else 1
        received += reader.feed(stream[:size])
        stream = stream[size:]
        cuts = cuts[1:] + cuts[:1]
    assert [r.msg_id for r in received] == [m.id for m in messages]
    assert reader.counters.lost == reader.counters.skipped_bytes == 0


def test_one_flipped_bit_costs_one_frame():
    """Whichever bit of the middle frame flips, its neighbours arrive and nothing false does."""
    first, middle, last = (wheel_state(t) for t in (1, 2, 3))
    clean = board_frames(first, middle, last)
    size = len(clean) // 3
    for bit in range(size * 8, 2 * size * 8):
        damaged = bytearray(clean)
        damaged[bit // 8] ^= 1 << (bit % 8)
        reader = FrameReader()
        received = reader.feed(bytes(damaged) + board_frames(first))
        stamps = [r.message.t_mcu_us for r in received]
        assert stamps == [1, 3, 1], f"bit {bit}"
        assert reader.counters.lost >= 1


def test_garbage_between_frames_is_skipped():
    """Random bytes full of false markers before each frame cost no frame behind them."""
    rng = random.Random(7)
    frames = [board_frames(wheel_state(t)) for t in range(50)]
    stream = b"".join(rng.randbytes(40) + b"\xfd\xfd" + frame for frame in frames)
    received = FrameReader().feed(stream + bytes(300))
    assert [r.message.t_mcu_us for r in received] == list(range(50))


def test_loss_is_counted_over_the_wrap_of_the_sequence():
    """Of 600 frames 60 are taken away, across two wraps of the 8-bit number: 60 lost."""
    mavlink = dialect.MAVLink(None, 1, 1)
    reader = FrameReader()
    for n in range(600):
        frame = bytes(wheel_state(n).pack(mavlink))
        mavlink.seq = (mavlink.seq + 1) & 0xFF
        if n % 10 != 5:
            reader.feed(frame)
    assert (reader.counters.frames, reader.counters.lost) == (540, 60)


def test_frames_of_others_are_left_out():
    """The host's own frames, echoed by a loop in the line, are not the board's."""
    reader = FrameReader()
    assert reader.feed(FrameWriter().encode_setpoint(1.0, 2.0, 3)) == []
    assert reader.counters.foreign == 1


def test_a_wrong_crc_extra_is_refused(monkeypatch):
    """A frame from another declaration of the message (negative control) does not decode."""
    frame = board_frames(wheel_state(1))
    monkeypatch.setattr(dialect.MAVLink_wheel_state_message, "crc_extra", 1)
    other = board_frames(wheel_state(1))
    assert other != frame
    reader = FrameReader()
    assert reader.feed(other + bytes(300)) == []
    assert reader.counters.bad_crc == 1


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_damaged_number_still_passes_as_sent(value):
    """The wire does not judge values: a NaN that the board sent arrives as NaN."""
    message = wheel_state(1)
    message.omega_left_rad_s = value
    ((_, fast, _),) = FrameReader().feed(board_frames(message))
    assert fast.omega_left_rad_s == pytest.approx(value, nan_ok=True)


@given(st.binary(max_size=600))
def test_hostile_bytes_raise_nothing(data):
    """Whatever arrives, the reader returns; a good frame after 300 quiet bytes is found."""
    reader = FrameReader()
    reader.feed(data)
    received = reader.feed(bytes(300) + board_frames(wheel_state(9)))
    assert received[-1].message.t_mcu_us == 9


@given(st.sampled_from(sorted(dialect.mavlink_map)), st.binary(min_size=1, max_size=60), U8)
def test_any_payload_of_any_message_raises_nothing(msg_id, payload, seq):
    """A frame with a right checksum and random fields, cut short or not, decodes."""
    message = dialect.mavlink_map[msg_id]
    payload = payload[: message.unpacker.size]
    body = bytes((len(payload), 0, 0, seq, 1, 1)) + msg_id.to_bytes(3, "little") + payload
    crc = mcrf4xx(body + bytes((message.crc_extra,)))
    ((got, _, _),) = FrameReader().feed(b"\xfd" + body + crc.to_bytes(2, "little"))
    assert got == msg_id


@given(st.integers(0, 2**15 - 1), U8)
def test_a_request_for_a_parameter_is_as_pymavlink_packs_it(index, frames_before):
    """Byte for byte, zeros cut off, and it counts as a frame."""
    native = FrameWriter()._native
    for _ in range(frames_before):
        native.count()
    mavlink = dialect.MAVLink(None, 255, 190)
    mavlink.seq = frames_before
    message = dialect.MAVLink_param_request_read_message(1, 1, b"", index)
    assert native.parameter_request(index) == bytes(message.pack(mavlink))
    assert native.seq == (frames_before + 1) & 0xFF


@given(st.binary(min_size=0, max_size=16), F32, U16, U16)
def test_a_parameter_is_decoded_as_pymavlink_does(name, value, count, index):
    """Its name up to a zero, whatever its bytes are; value, count and index."""
    message = dialect.MAVLink_param_value_message(name, value, 9, count, index)
    frame = board_frames(message)
    slow = dialect.MAVLink(None).decode(bytearray(frame))
    fields = (slow.param_id, slow.param_value, slow.param_count, slow.param_index)
    assert _wire.parameter(frame) == fields
