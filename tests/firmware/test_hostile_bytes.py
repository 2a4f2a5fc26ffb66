"""Bytes that no honest host sends: nothing crashes, nothing moves, the link recovers."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.wire import dialect
from hil.wire.framing import FrameWriter
from tests.firmware import hostile
from tests.firmware.bench import BoardBench


def honest_frames() -> list[bytes]:
    """Frames of every kind the board takes, none of which may arm it."""
    writer = FrameWriter()
    messages = [
        dialect.MAVLink_wheel_setpoint_message(5.0, 5.0, 1),
        dialect.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0),
        dialect.MAVLink_param_set_message(1, 1, b"PWM_MAX", 0.5, 9),
        dialect.MAVLink_param_request_list_message(1, 1),
        dialect.MAVLink_timesync_message(0, 1),
    ]
    return [writer.encode(message) for message in messages]


def answers_again(bench: BoardBench) -> bool:
    """Return whether the board identifies itself within a second of requests at 30 Hz."""
    bench.messages.clear()
    writer = FrameWriter()
    for tick in range(250):
        if tick % 8 == 0:
            request = dialect.MAVLink_command_long_message(
                1, 1, 512, 0, float(dialect.MAVLINK_MSG_ID_BOARD_INFO), 0, 0, 0, 0, 0, 0
            )
            bench.receive(writer.encode(request))
        bench.tick()
    return bool(bench.of(dialect.MAVLINK_MSG_ID_BOARD_INFO))


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.lists(st.one_of(st.binary(max_size=300), st.sampled_from(honest_frames())), max_size=30))
def test_random_bytes_never_move_the_wheels(chunks):
    """Any mixture of noise and honest but unauthorised frames: PWM 0, not armed, link recovers."""
    bench = BoardBench()
    for chunk in chunks:
        bench.receive(chunk)
        bench.tick()
        assert bench.pwm == (0, 0)
    assert bench.board.state != dialect.HIL_STATE_ARMED
    assert answers_again(bench)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.data())
def test_a_flipped_bit_never_changes_a_set_point(data):
    """One bit of a set-point frame flipped on the way: the frame is not taken."""
    bench = BoardBench()
    assert bench.arm() == dialect.MAV_RESULT_ACCEPTED
    frame = bytearray(FrameWriter().encode(dialect.MAVLink_wheel_setpoint_message(5.0, 4.0, 1)))
    bit = data.draw(st.integers(0, 8 * len(frame) - 1))
    frame[bit // 8] ^= 1 << bit % 8
    bench.receive(bytes(frame))
    bench.tick()
    assert bench.pwm == (0, 0)


@pytest.mark.parametrize("cut", range(0, 22, 3))
def test_a_frame_cut_short_costs_at_most_what_follows_directly(cut):
    """After a truncated frame the third honest one at the latest is taken."""
    bench = BoardBench()
    assert bench.arm() == dialect.MAV_RESULT_ACCEPTED
    writer = FrameWriter()
    frames = [
        writer.encode(dialect.MAVLink_wheel_setpoint_message(5.0 + k, 4.0, 1 + k)) for k in range(4)
    ]
    bench.receive(frames[0][:cut] + frames[1] + frames[2] + frames[3])
    bench.tick()
    assert bench.board.wheel(0).setpoint_rad_s == 8.0


@pytest.mark.skipif(shutil.which("c++") is None, reason="needs a C++ compiler on the PATH")
def test_a_hundred_thousand_hostile_frames_under_sanitizers(tmp_path: Path):
    """The core built with ASan and UBSan: random, truncated, flipped, oversized, replayed frames."""
    hostile.build(tmp_path / "hostile_bytes")
    assert hostile.throw(tmp_path / "hostile_bytes", 50_000, 1) == ""
