"""What hosts do too often, twice or wrongly: arming, floods of parameters, signed frames, long runs."""

from __future__ import annotations

import math

import pytest
from fastcrc.crc16 import mcrf4xx

from hil.board import _firmware
from hil.wire import dialect, identity
from hil.wire.framing import FrameWriter
from tests.firmware.bench import BoardBench, Motor

ACCEPTED = dialect.MAV_RESULT_ACCEPTED
REJECTED = dialect.MAV_RESULT_TEMPORARILY_REJECTED


def armed() -> BoardBench:
    bench = BoardBench()
    assert bench.arm() == ACCEPTED
    return bench


# ---- arming while armed ----


@pytest.mark.parametrize("wrong", ["dialect", "parameter"])
def test_arming_while_armed_is_accepted_with_the_same_hashes_only(wrong):
    """Another program's arming is refused by name and the wheels go on; a true repeat is accepted."""
    bench, wheels = armed(), (Motor(), Motor())
    bench.run(wheels, 100, setpoint=5.0)
    pwm = bench.pwm
    other = {
        "dialect": {"dialect_hash": identity.dialect_hash() ^ 1},
        "parameter": {"parameter_hash": bench.board.parameter_hash ^ 1 << 20},
    }[wrong]
    assert bench.arm(**other) == REJECTED
    bench.run(wheels, 100, setpoint=5.0)
    assert bench.board.state == dialect.HIL_STATE_ARMED
    assert bench.pwm[0] == pytest.approx(pwm[0], abs=40)
    texts = [m.text for m in bench.of(dialect.MAVLINK_MSG_ID_STATUSTEXT)]
    assert f"not armed: {wrong} hashes differ" in texts
    assert bench.arm() == ACCEPTED


def test_a_live_change_makes_the_old_hash_foreign_while_armed():
    """After a gain changed in motion a repeat must carry the hash of what is in force."""
    bench = armed()
    before = bench.board.parameter_hash
    bench.set_param("ISM_K0", 0.2)
    assert bench.arm(parameter_hash=before) == REJECTED
    assert bench.arm() == ACCEPTED


# ---- parameters in a stream ----


def speeds_under(stream, ticks=1500) -> list[float]:
    """Drive at 5 rad/s with `stream(bench, tick)` called every tick; return the later wheel speeds."""
    bench, wheels = armed(), (Motor(), Motor())
    bench.run(wheels, 250, setpoint=5.0)
    speeds = []
    for tick in range(ticks):
        if tick % 8 == 0:
            bench.setpoint(5.0)
        stream(bench, tick)
        bench.run(wheels, 1)
        speeds.append(wheels[0].omega_rad_s)
    assert bench.board.state == dialect.HIL_STATE_ARMED
    return speeds


@pytest.mark.parametrize("name", ["PID_KD", "LAW", "ISM_EPSMIN", "ENC_COUNTS", "STALL_MS"])
def test_a_parameter_set_to_the_value_in_force_changes_nothing(name):
    """At 125 a second, live or fixed: the wheel's speeds are those without a stream, to the bit."""
    value = _firmware.Board().parameters[name]

    def stream(bench: BoardBench, tick: int) -> None:
        if tick % 2 == 0:
            bench.set_param(name, value)

    assert speeds_under(stream) == speeds_under(lambda *_: None)


def test_a_fixed_parameter_that_is_so_already_is_no_refusal():
    """Writing all parameters while armed, as a ground station does, is answered without a text."""
    bench = armed()
    bench.setpoint(0.0)
    bench.set_param("PWM_MAX", 1.0)
    bench.set_param("ISM_GAM0", 8.0)
    assert "parameter refused: fixed while armed" not in bench.texts()


def test_a_stream_of_changes_does_not_make_the_wheels_swing():
    """A gain that goes up and down 125 times a second: the law starts anew ten times a second at most."""

    def stream(bench: BoardBench, tick: int) -> None:
        if tick % 2 == 0:
            bench.set_param("PID_KD", 0.00003 + 0.00001 * (tick % 4))

    calm, stirred = speeds_under(lambda *_: None), speeds_under(stream)
    assert max(stirred) < max(calm) + 1.5
    assert min(stirred) > min(calm) - 1.5


def test_changes_take_effect_within_a_tenth_of_a_second_and_before_arming():
    """Live: at most 25 ticks later. Disarmed: arming right behind the change has it in force."""
    bench, wheels = armed(), (Motor(), Motor())
    bench.run(wheels, 100, setpoint=5.0)
    for law in (1.0, 0.0):
        bench.set_param("LAW", law)
        bench.messages.clear()
        bench.run(wheels, 26, setpoint=5.0)
        bench.run(wheels, 5, setpoint=5.0)
        state = bench.of(dialect.MAVLINK_MSG_ID_WHEEL_STATE)[-1]
        assert bool(state.flags & dialect.HIL_WHEEL_FLAG_PID) == bool(law)
    limited = BoardBench()
    limited.set_param("PWM_MAX", 0.1)
    assert limited.arm() == ACCEPTED
    for _ in range(50):
        limited.setpoint(15.0)
        limited.tick()
    assert limited.pwm == (40, 40)


def test_every_frame_of_a_burst_is_acted_on():
    """Fifty PARAM_SETs in one piece: all are set, all are hashed; what the ring cannot hold is counted."""
    bench, writer = BoardBench(), FrameWriter()
    table = _firmware.parameter_table()
    kind = dialect.MAV_PARAM_TYPE_REAL32
    wanted = {entry.name: 0.5 * (entry.default + entry.maximum) for entry in table}
    bench.receive(
        b"".join(
            writer.encode(dialect.MAVLink_param_set_message(1, 1, name.encode(), value, kind))
            for name, value in wanted.items()
        )
    )
    assert bench.board.parameters == pytest.approx(wanted)
    assert bench.board.parameter_hash == identity.parameter_hash(bench.board.parameters)
    assert bench.board.received_frames == len(table)


# ---- encoders faster than the board can count ----


@pytest.mark.parametrize(
    ("counts_per_turn", "overspeed", "fits"),
    [(1920.0, 100.0, True), (7124.0, 28.0, True), (7126.0, 28.0, False), (20_000.0, 9.97, True),
     (20_000.0, 9.98, False), (10_000.0, 28.0, False)],
)  # fmt: skip
def test_an_encoder_faster_than_the_tally_bars_arming(counts_per_turn, overspeed, fits):
    """127 counts a tick, 31,750 a second: ENC_COUNTS * OVER_W / 2 pi above that is refused by name."""
    bench = BoardBench()
    bench.set_param("ENC_COUNTS", counts_per_turn)
    bench.set_param("OVER_W", overspeed)
    assert (counts_per_turn * overspeed / math.tau <= 31_750) == fits
    assert (bench.arm() == ACCEPTED) == fits
    said = "not armed: ENC_COUNTS * OVER_W: edges too fast" in bench.texts()
    assert said != fits


# ---- frames that cannot be checked ----


def with_flags(frame: bytes, flags: int) -> bytes:
    """Return the frame with other incompatible flags, its checksum right, and a signature of zeros."""
    extra = dialect.mavlink_map[int.from_bytes(frame[7:10], "little")].crc_extra
    body = frame[1:2] + bytes([flags]) + frame[3:-2]
    crc = mcrf4xx(body + bytes([extra])).to_bytes(2, "little")
    return b"\xfd" + body + crc + (bytes(13) if flags & 1 else b"")


@pytest.mark.parametrize(
    ("flags", "taken"), [(0, True), (1, False), (2, False), (0x80, False), (0x81, False)]
)
def test_frames_whose_flags_are_not_understood_are_not_acted_on(flags, taken):
    """A signature cannot be checked here, so a signed stop is refused like any unknown flag."""
    bench = armed()
    frame = FrameWriter().encode(
        dialect.MAVLink_command_long_message(1, 1, 185, 0, 1, 0, 0, 0, 0, 0, 0)
    )
    bench.messages.clear()
    bench.receive(with_flags(frame, flags))
    bench.collect()
    acks = bench.of(dialect.MAVLINK_MSG_ID_COMMAND_ACK)
    assert (len(acks) == 1) == taken
    assert (bench.board.state == dialect.HIL_STATE_SAFE) == taken
    assert bench.arm() == ACCEPTED  # the link goes on behind it


# ---- counters over a long run ----


@pytest.mark.parametrize("frames", [60_000, 70_000, 140_000])
def test_the_loss_share_is_right_however_many_frames_have_come(frames):
    """Every thousandth frame left out: 0.1 %, before and after the counts pass 16 bits."""
    bench = BoardBench()
    writer = FrameWriter()
    beat = dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
    kept = b"".join(
        frame for number in range(frames) if (frame := writer.encode(beat)) and number % 1000 != 999
    )
    bench.receive(kept)
    bench.messages.clear()
    bench.tick(250)
    status = bench.of(dialect.MAVLINK_MSG_ID_SYS_STATUS)[-1]
    assert status.drop_rate_comm in (9, 10)
    assert status.errors_count2 == (frames - 1) // 1000
    assert bench.board.received_frames == frames - frames // 1000


def test_a_full_counter_stays_full():
    """70,000 refused set-points read 65,535, and not 4,464 (the next wrap of 16 bits)."""
    bench = BoardBench()
    writer = FrameWriter()
    bench.receive(b"".join(writer.encode_setpoint(1.0, 1.0, 1) for _ in range(70_000)))
    bench.messages.clear()
    bench.tick(250)
    assert bench.of(dialect.MAVLINK_MSG_ID_SYS_STATUS)[-1].errors_count4 == 65_535
    assert bench.board.refused_setpoints == 65_535
