"""The board's end of the wire: handshake, set-points, parameters, time, texts, losses."""

from __future__ import annotations

import math

import pytest

from hil.board import _firmware
from hil.wire import dialect, identity
from hil.wire.framing import FrameWriter
from tests.firmware.bench import BoardBench, Motor

ACCEPTED = dialect.MAV_RESULT_ACCEPTED
REJECTED = dialect.MAV_RESULT_TEMPORARILY_REJECTED
DENIED = dialect.MAV_RESULT_DENIED
INFO = dialect.MAVLINK_MSG_ID_BOARD_INFO


def armed() -> BoardBench:
    bench = BoardBench()
    assert bench.arm() == ACCEPTED
    return bench


# ---- identity and arming ----


def test_board_info_tells_who_the_board_is():
    """Hashes, PWM range, tick and build id, as the host computes or the binding states them."""
    bench = BoardBench()
    assert bench.command(dialect.MAV_CMD_REQUEST_MESSAGE, float(INFO)) == ACCEPTED
    info = bench.of(INFO)[0]
    defaults = {entry.name: entry.default for entry in _firmware.parameter_table()}
    assert info.dialect_hash == identity.dialect_hash()
    assert info.parameter_hash == identity.parameter_hash(defaults) == bench.board.parameter_hash
    assert (info.pwm_top_counts, info.tick_us) == (400, 4000)
    assert info.build_id == _firmware.BUILD_ID
    assert len(info.build_id) == 8


@pytest.mark.parametrize("bit", [0, 7, 15, 16, 31])
def test_one_wrong_bit_of_a_hash_bars_arming(bit):
    """Every half of both hashes counts; the refusal has its own text."""
    bench = BoardBench()
    assert bench.arm(dialect_hash=identity.dialect_hash() ^ 1 << bit) == REJECTED
    assert bench.arm(parameter_hash=bench.board.parameter_hash ^ 1 << bit) == REJECTED
    assert bench.board.state == dialect.HIL_STATE_DISARMED
    texts = bench.texts()
    assert "not armed: dialect hashes differ" in texts
    assert "not armed: parameter hashes differ" in texts


def test_a_parameter_changed_behind_the_hosts_back_bars_arming():
    """The hash is over values in force: the hash of before the change no longer arms."""
    bench = BoardBench()
    before = bench.board.parameter_hash
    bench.set_param("ISM_K0", 0.2)
    assert bench.arm(parameter_hash=before) == REJECTED
    assert bench.arm() == ACCEPTED


def test_turning_wheels_bar_arming():
    """A wheel at 2 rad/s: refused; at rest: armed."""
    bench = BoardBench()
    for k in range(100):
        bench.counts[0] = round(k * 2.0 * 0.004 / (2 * math.pi) * 1920)
        bench.tick()
    assert bench.arm() == REJECTED
    assert "not armed: wheels are turning" in bench.texts()
    assert bench.arm() == ACCEPTED


def test_a_board_that_has_not_ticked_does_not_arm():
    """Before the first encoder reading there is nothing to steer by."""
    bench = BoardBench()
    bench.board = _firmware.Board()
    assert bench.arm() == REJECTED
    assert "not armed: no encoder reading yet" in bench.texts()


def test_arming_again_while_armed_restarts_nothing():
    """A repeated command (its ACK was lost) neither stops the wheels nor resets the time-out."""
    bench = armed()
    for _ in range(20):
        bench.setpoint(5.0)
        bench.tick()
    pwm = bench.pwm
    assert bench.arm() == ACCEPTED
    bench.tick()
    assert bench.pwm[0] == pytest.approx(pwm[0], abs=8)
    assert bench.board.wheel(0).setpoint_rad_s == 5.0


@pytest.mark.parametrize("value", [0.5, 2.0, math.nan, math.inf])
def test_arm_values_other_than_0_and_1_are_denied(value):
    """Neither armed nor disarmed by a value without a meaning."""
    for bench in (BoardBench(), armed()):
        state = bench.board.state
        assert bench.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, value) == DENIED
        assert bench.board.state == state


def test_unknown_commands_are_answered_unsupported_and_other_systems_ignored():
    """A command for somebody else has no answer at all."""
    bench = BoardBench()
    assert bench.command(22, 1.0) == dialect.MAV_RESULT_UNSUPPORTED
    bench.messages.clear()
    bench.send(dialect.MAVLink_command_long_message(7, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    bench.send(dialect.MAVLink_command_long_message(1, 99, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    bench.collect()
    assert bench.messages == []


# ---- set-points ----


@pytest.mark.parametrize(
    ("left", "right", "taken"),
    [
        (20.0, -20.0, True),
        (20.001, 0.0, False),
        (0.0, -20.001, False),
        (math.nan, 0.0, False),
        (0.0, math.inf, False),
        (0.0, 0.0, True),
    ],
)
def test_set_points_are_checked_before_they_count(left, right, taken):
    """W_MAX is 20 rad/s; a refused set-point neither moves nor feeds the time-out."""
    bench = armed()
    bench.tick(50)
    bench.setpoint(left, right)
    bench.tick(14)  # 200 ms + 56 ms since arming
    assert (bench.board.state == dialect.HIL_STATE_ARMED) == taken
    assert bench.board.refused_setpoints == (not taken)


@pytest.mark.parametrize(
    ("last", "new", "taken"),
    [(10, 11, True), (10, 10, False), (10, 9, False), (10, 500, True), (65_535, 0, True),
     (0, 65_535, False), (10, 10 + 32_767, True), (10, 10 + 32_768, False)],
)  # fmt: skip
def test_replayed_set_points_are_refused(last, new, taken):
    """A set-point counts only when its seq is newer, in 16-bit circular order."""
    bench = armed()
    bench.setpoint(1.0, seq=last)
    bench.setpoint(2.0, seq=new)
    bench.tick()
    assert bench.board.wheel(0).setpoint_rad_s == (2.0 if taken else 1.0)


def test_a_new_arming_accepts_any_sequence():
    """A host that starts over begins at its own seq."""
    bench = armed()
    bench.setpoint(1.0, seq=30_000)
    bench.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0.0)
    assert bench.arm() == ACCEPTED
    bench.setpoint(2.0, seq=3)
    bench.tick()
    assert bench.board.wheel(0).setpoint_rad_s == 2.0


def test_wheel_state_reports_what_the_wheels_do():
    """Counts, speeds, PWM and the echo of the set-point with its arrival time."""
    bench, wheels = armed(), (Motor(), Motor())
    bench.run(wheels, 200, setpoint=3.0)
    sent_us = bench.t_us
    bench.setpoint(3.0, 2.0)
    bench.messages.clear()
    bench.run(wheels, 5)
    state = bench.of(dialect.MAVLINK_MSG_ID_WHEEL_STATE)[0]
    assert (state.setpoint_seq, state.t_setpoint_us) == (bench.seq, sent_us)
    assert state.omega_left_rad_s == pytest.approx(3.0, abs=0.4)
    assert abs(state.left_counts - wheels[0].counts) < 20
    assert state.pwm_left_counts > 0
    assert (state.state, state.reason, state.flags) == (dialect.HIL_STATE_ARMED, 0, 0)
    assert sent_us <= state.t_mcu_us <= bench.t_us


# ---- parameters ----


def test_the_list_is_complete_and_paced():
    """Every parameter once, in order, at most one in 100 ms, and wheel state keeps its 50 Hz."""
    bench = BoardBench()
    table = _firmware.parameter_table()
    bench.messages.clear()
    bench.send(dialect.MAVLink_param_request_list_message(1, 1))
    bench.tick(25 * (len(table) + 1))
    values = bench.of(dialect.MAVLINK_MSG_ID_PARAM_VALUE)
    assert [(m.param_id, m.param_index, m.param_count) for m in values] == [
        (entry.name, i, len(table)) for i, entry in enumerate(table)
    ]
    assert all(
        math.isclose(m.param_value, e.default, rel_tol=1e-6)
        for m, e in zip(values, table, strict=True)
    )
    states = bench.of(dialect.MAVLINK_MSG_ID_WHEEL_STATE)
    assert len(states) == 5 * (len(table) + 1)
    assert bench.board.dropped_frames == 0


@pytest.mark.parametrize("entry", _firmware.parameter_table(), ids=lambda entry: entry.name)
def test_every_parameter_keeps_to_its_bounds(entry):
    """Both bounds are accepted, the next float beyond each is refused and the value stays."""
    bench = BoardBench()
    beyond = 1e-3 * max(1.0, abs(entry.maximum), abs(entry.minimum))
    for value in (entry.minimum, entry.maximum):
        bench.set_param(entry.name, value)
        assert bench.board.parameters[entry.name] == pytest.approx(value, rel=1e-6)
    for value in (entry.minimum - beyond, entry.maximum + beyond, math.nan, math.inf):
        bench.set_param(entry.name, value)
        assert bench.board.parameters[entry.name] == pytest.approx(entry.maximum, rel=1e-6)
    assert bench.board.parameter_hash == identity.parameter_hash(bench.board.parameters)
    assert entry.minimum <= entry.default <= entry.maximum


def test_refused_parameters_are_answered_with_the_value_in_force_and_a_text():
    """Unknown name, wrong type, not finite, out of range: each its own text."""
    bench = BoardBench()
    bench.messages.clear()
    bench.set_param("PWM_MAX", 2.0)
    bench.set_param("PWM_MAX", math.nan)
    bench.send(dialect.MAVLink_param_set_message(1, 1, b"PWM_MAX", 0.5, 6))
    bench.set_param("NO_SUCH", 1.0)
    bench.collect()
    assert [m.param_value for m in bench.of(dialect.MAVLINK_MSG_ID_PARAM_VALUE)] == [1.0] * 3
    texts = bench.texts()
    for text in (
        "out of its range",
        "not a finite number",
        "type is not REAL32",
        "unknown name or index",
    ):
        assert f"parameter refused: {text}" in texts


def test_structure_is_fixed_while_armed_and_gains_are_live():
    """PARAM of params.def is refused while armed, LIVE_PARAM is taken."""
    bench = armed()
    for entry in _firmware.parameter_table():
        bench.setpoint(0.0)
        bench.set_param(entry.name, entry.maximum)
        taken = bench.board.parameters[entry.name] == pytest.approx(entry.maximum, rel=1e-6)
        assert taken == (entry.live or entry.default == entry.maximum), entry.name


def test_one_parameter_by_name_and_by_index():
    """PARAM_REQUEST_READ: index -1 goes by name; an unknown one has a text and no answer."""
    bench = BoardBench()
    bench.messages.clear()
    bench.send(dialect.MAVLink_param_request_read_message(1, 1, b"LAW", -1))
    bench.send(dialect.MAVLink_param_request_read_message(1, 1, b"", 0))
    bench.send(dialect.MAVLink_param_request_read_message(1, 1, b"", 200))
    bench.collect()
    names = [m.param_id for m in bench.of(dialect.MAVLINK_MSG_ID_PARAM_VALUE)]
    assert names == ["LAW", "ENC_COUNTS"]


def test_a_law_changed_in_motion_does_not_jolt():
    """PARAM_SET LAW while driving under load: no PWM change beyond what noise makes."""
    bench, wheels = armed(), (Motor(), Motor())
    bench.run(wheels, 400, setpoint=5.0)
    for law in (1.0, 0.0):
        before = bench.pwm
        bench.set_param("LAW", law)
        bench.setpoint(5.0)
        bench.run(wheels, 1)
        assert max(abs(a - b) for a, b in zip(before, bench.pwm, strict=True)) <= 12
        bench.run(wheels, 400, setpoint=5.0)


# ---- time, losses, texts ----


def test_timesync_answers_with_the_time_of_arrival():
    """tc1 is the board's clock at reception in ns, ts1 comes back; an answer is not answered."""
    bench = BoardBench(t_us=2**32 - 4000 + 123)
    bench.messages.clear()
    arrival_us = bench.t_us & 0xFFFF_FFFF
    bench.send(dialect.MAVLink_timesync_message(0, 987_654_321_012))
    bench.send(dialect.MAVLink_timesync_message(5, 1))
    bench.collect()
    answers = bench.of(dialect.MAVLINK_MSG_ID_TIMESYNC)
    assert [(m.tc1, m.ts1) for m in answers] == [(arrival_us * 1000, 987_654_321_012)]


def test_losses_and_damage_are_counted_and_reported():
    """Of ten frames one is missing and one damaged: lost 2, bad 1, in SYS_STATUS as well."""
    bench = BoardBench()
    writer = FrameWriter()
    frames = [writer.encode(dialect.MAVLink_timesync_message(0, 1 + k)) for k in range(10)]
    del frames[3]
    frames[5] = frames[5][:-1] + bytes([frames[5][-1] ^ 1])
    for frame in frames:
        bench.receive(frame)
    board = bench.board
    assert (board.received_frames, board.lost_frames, board.bad_frames) == (8, 2, 1)
    bench.messages.clear()
    bench.tick(251)
    status = bench.of(dialect.MAVLINK_MSG_ID_SYS_STATUS)[0]
    assert (status.errors_comm, status.errors_count2, status.drop_rate_comm) == (1, 2, 2000)
    assert status.voltage_battery == 12_000


def test_late_ticks_are_counted():
    """A tick half a period late is an overrun, one a little late is not."""
    bench = BoardBench()
    for late_us, overruns in ((1999, 0), (2001, 1), (50_000, 2)):
        bench.t_us += late_us
        bench.tick()
        assert bench.board.overruns == overruns


def test_a_full_buffer_drops_whole_frames_and_counts_them():
    """Nobody drains the port: what comes out later is whole frames, the rest is counted."""
    bench = BoardBench()
    for k in range(200):
        bench.t_us += 4000
        bench.board.tick(bench.t_us, k, k)
    dropped = bench.board.dropped_frames
    assert dropped > 30
    bench.messages.clear()
    bench.collect()
    assert len(bench.messages) >= 3
    bench.tick(250)
    assert bench.of(dialect.MAVLINK_MSG_ID_SYS_STATUS)[-1].errors_count3 == dropped


def test_a_heartbeat_a_second_shows_state_and_reason():
    """1 Hz; armed shows in base_mode, state and reason in custom_mode."""
    bench = armed()
    bench.messages.clear()
    bench.tick(750)
    beats = bench.of(dialect.MAVLINK_MSG_ID_HEARTBEAT)
    assert len(beats) == 3
    safe = dialect.HIL_STATE_SAFE | dialect.HIL_REASON_SETPOINT_TIMEOUT << 8
    assert beats[-1].custom_mode == safe
    assert beats[-1].system_status == dialect.MAV_STATE_CRITICAL
    assert not beats[-1].base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED


def test_a_text_is_not_repeated_within_a_second():
    """A hundred refusals a second make one text of their kind a second."""
    bench = BoardBench()
    bench.tick(250)
    bench.messages.clear()
    for _ in range(500):
        bench.set_param("NO_SUCH", 1.0)
        bench.tick()
    texts = bench.of(dialect.MAVLINK_MSG_ID_STATUSTEXT)
    assert 2 <= len(texts) <= 3
