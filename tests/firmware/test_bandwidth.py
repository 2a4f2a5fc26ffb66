"""What the board sends fits 57,600 baud with a third to spare."""

from __future__ import annotations

import math

from hil.board import _firmware
from hil.wire import dialect
from tests.firmware.bench import BoardBench, Motor

LINE_BYTES_S = 57_600 / 10  # 8N1: ten bits a byte


def test_a_run_at_the_worst_leaves_a_third_of_the_line():
    """Ten seconds armed, full payloads, a parameter list, 5 TIMESYNC a second and refusals throughout."""
    wheels = (Motor(angle_rad=-9e4), Motor(angle_rad=9e4))
    # high bytes set: nothing is trimmed off the frames
    bench = BoardBench(0x9000_0000, (wheels[0].counts, wheels[1].counts))
    assert bench.arm() == dialect.MAV_RESULT_ACCEPTED
    bench.sent_bytes = 0
    for tick in range(2500):
        if tick % 50 == 0:
            bench.send(dialect.MAVLink_timesync_message(0, 2**60 + tick))
            bench.send(dialect.MAVLink_param_request_list_message(1, 1))
            bench.send(dialect.MAVLink_wheel_setpoint_message(math.nan, 1.0, 7))
        bench.run(wheels, 1, setpoint=3.0 if tick % 8 == 0 else None)
    assert bench.board.state == dialect.HIL_STATE_ARMED
    assert bench.board.dropped_frames == 0
    assert len(bench.of(dialect.MAVLINK_MSG_ID_WHEEL_STATE)) >= 500
    assert bench.sent_bytes / 10.0 < 2.0 / 3.0 * LINE_BYTES_S


def test_wheel_state_and_set_points_alone_fit_each_way():
    """By hand: 61 bytes x 50 Hz = 3,050 B/s up and 22 bytes x 30 Hz = 660 B/s down of 5,760 B/s."""
    overhead = 12
    up = (dialect.MAVLink_wheel_state_message.unpacker.size + overhead) * 50
    down = (dialect.MAVLink_wheel_setpoint_message.unpacker.size + overhead) * 30
    assert (up, down) == (3050, 660)
    assert max(up, down) < 2.0 / 3.0 * LINE_BYTES_S


def test_a_slow_port_starves_nothing_but_the_list():
    """Drained at line speed while a list runs, wheel state loses nothing."""
    bench = BoardBench()
    bench.send(dialect.MAVLink_param_request_list_message(1, 1))
    credit, got = 0.0, 0
    for _ in range(1250):
        bench.board.tick(bench.t_us, 0, 0)
        bench.t_us += _firmware.TICK_US
        credit += LINE_BYTES_S * 0.004
        take = int(credit)
        got += len(bench.board.transmit(take))
        credit -= take
    assert bench.board.dropped_frames == 0
    assert got < 5.0 * LINE_BYTES_S
