"""The host's link against the compiled board: real bytes both ways, on virtual time."""

import math
import random
from itertools import pairwise
from statistics import mean

import pytest

from hil.board import _firmware
from hil.core.errors import RigFault
from hil.wire import dialect, handshake, identity
from hil.wire.framing import BOARD_SYSTEM, HOST_SYSTEM
from hil.wire.link import BoardLink
from tests.wire.board_rig import TICK_S, BoardRig

DEFAULTS = {entry.name: entry.default for entry in _firmware.parameter_table()}


def connected(rig: BoardRig, parameters=None) -> BoardLink:
    link = BoardLink(rig.stream)
    handshake.finish(link, rig, handshake.connect(link, parameters or {}))
    return link


def armed(rig: BoardRig) -> BoardLink:
    link = connected(rig, DEFAULTS)
    handshake.finish(link, rig, handshake.arm(link, *identity.board_hashes(link.parameters)))
    return link


def drive(link: BoardLink, rig: BoardRig, duration_s: float, speeds=(3.0, 2.0), period_s=1 / 30):
    """Send set-points for a while; return the wheel reports."""
    reports, end_s = [], rig.now_s() + duration_s
    due_s = rig.now_s()
    while rig.now_s() < end_s:
        if rig.now_s() >= due_s:
            due_s += period_s
            link.send_setpoint(rig.now_s(), *speeds)
        rig.wait(due_s)
        reports += link.poll(rig.now_s())
    return reports


def test_both_sides_compute_the_same_hashes():
    """The host's hashes, from its own declaration and values, are those of the compiled core."""
    assert identity.dialect_hash() == _firmware.dialect_hash()
    assert identity.parameter_hash(DEFAULTS) == _firmware.parameter_hash({})
    changed = DEFAULTS | {"FF_GAIN": 0.1, "HOLD_SP": -0.0}
    assert identity.parameter_hash(changed) == _firmware.parameter_hash(changed)


def test_a_board_with_the_wanted_parameters_is_taken_at_its_hash():
    """With equal hashes nothing is fetched: connected within 1.2 s, a heartbeat and an answer."""
    rig = BoardRig()
    link = connected(rig, DEFAULTS)
    assert rig.now_s() < 1.2
    assert link.parameters == pytest.approx(DEFAULTS)
    assert link.info.pwm_top_counts == 400
    assert link.info.tick_us == 4000
    assert link.state_name == "DISARMED"


def test_parameters_are_read_set_and_checked():
    """One differing value: all are read, that one is set, and the new hash is the host's own."""
    rig = BoardRig()
    wanted = DEFAULTS | {"PID_KP": 0.2}
    link = connected(rig, wanted)
    assert rig.board.parameters["PID_KP"] == pytest.approx(0.2)
    assert link.info.parameter_hash == identity.parameter_hash(wanted)
    assert len(link.parameters) == len(DEFAULTS)


def test_a_value_the_board_will_not_take_ends_the_bring_up():
    """A parameter beyond its range: one line with name, both values and the board's reason."""
    with pytest.raises(RigFault, match=r"SP_TIMEOUT stays at 250 instead of 9000: .*range"):
        connected(BoardRig(), {"SP_TIMEOUT": 9000.0})


def test_a_parameter_the_board_does_not_have_ends_the_bring_up():
    """A name from another version of the firmware is refused with what to look at."""
    with pytest.raises(RigFault, match=r"no parameter 'NO_SUCH'.*version"):
        connected(BoardRig(), {"NO_SUCH": 1.0})


def test_armed_wheels_follow_and_report():
    """Set-points of 3 and 2 rad/s are held within 20 % on average, counts rise, times fit."""
    rig = BoardRig()
    link = armed(rig)
    reports = drive(link, rig, 1.5)
    last = reports[-1]
    assert link.armed
    assert mean(r.sample.omega_left_rad_s for r in reports[-25:]) == pytest.approx(3.0, rel=0.2)
    assert mean(r.sample.omega_right_rad_s for r in reports[-25:]) == pytest.approx(2.0, rel=0.2)
    assert last.sample.counts_left > last.sample.counts_right > 200
    assert last.wire.pwm_left_counts > 40
    times = [report.sample.t_host_s for report in reports]
    assert times == sorted(times)
    assert last.sample.t_host_s == pytest.approx(last.t_arrival_s, abs=2 * TICK_S)
    assert len(reports) == pytest.approx(75, abs=2)  # 50 Hz


def test_disarming_stops_the_wheels():
    """After disarm the PWM is 0 and the state is DISARMED."""
    rig = BoardRig()
    link = armed(rig)
    drive(link, rig, 0.5)
    assert rig.pwm != (0, 0)
    handshake.finish(link, rig, handshake.disarm(link))
    drive(link, rig, 0.1)
    assert rig.pwm == (0, 0)
    assert link.state_name == "DISARMED"


@pytest.mark.parametrize("which", ["dialect", "parameter"])
def test_arming_with_a_wrong_hash_is_refused(which):
    """One bit of either hash wrong: refused, the reason named, no PWM even with set-points."""
    rig = BoardRig()
    link = connected(rig, DEFAULTS)
    hashes = list(identity.board_hashes(link.parameters))
    hashes[which == "parameter"] ^= 1
    with pytest.raises(RigFault, match=f"refuses to arm .* not armed: {which} hashes differ"):
        handshake.finish(link, rig, handshake.arm(link, *hashes))
    drive(link, rig, 0.3)
    assert rig.pwm == (0, 0)
    assert not link.armed


def test_a_board_of_another_dialect_is_turned_away(monkeypatch):
    """The host sees the other dialect before it touches a parameter."""
    monkeypatch.setattr(identity, "dialect_hash", lambda: 0x12345678)
    with pytest.raises(RigFault, match=r"speaks dialect [0-9a-f]{8}, this host 12345678"):
        connected(BoardRig())


def test_a_board_without_power_ends_the_bring_up():
    """No heartbeat: one line after 6 s."""
    rig = BoardRig()
    rig.powered = False
    with pytest.raises(RigFault, match="no heartbeat within 6 s"):
        connected(rig)
    assert rig.now_s() == pytest.approx(6.0, abs=0.1)


def test_a_board_that_falls_silent_ends_the_request():
    """Answers cut off after the heartbeat: repeated, then one line after 3 s."""
    rig = BoardRig()
    link = BoardLink(rig.stream)
    while not link.heartbeats:
        rig.wait(rig.now_s() + TICK_S)
        link.poll(rig.now_s())
    rig.up = lambda _: b""
    with pytest.raises(RigFault, match="no answer to the request for its identity within 5 s"):
        handshake.finish(link, rig, handshake.connect(link, {}))


def test_silence_stops_the_wheels_within_250_ms():
    """Without set-points the PWM is 0 within 250 ms of the last one, and stays 0 when they return."""
    rig = BoardRig()
    link = armed(rig)
    drive(link, rig, 1.0)
    link.send_setpoint(rig.now_s(), 3.0, 2.0)
    last_s = rig.now_s()
    while rig.pwm != (0, 0):
        rig.wait(rig.now_s() + TICK_S)
        link.poll(rig.now_s())
    assert 0.2 < rig.now_s() - last_s <= 0.25 + 1e-9
    drive(link, rig, 0.5)
    assert rig.pwm == (0, 0)
    assert link.state_name == "SAFE (SETPOINT_TIMEOUT)"


def test_only_a_new_arming_leaves_safe():
    """After a stop command the board arms again when asked anew, and drives."""
    rig = BoardRig()
    link = armed(rig)
    drive(link, rig, 0.3)
    link.stop_now(rig.now_s())
    drive(link, rig, 1.0)
    assert (link.state_name, rig.pwm) == ("SAFE (STOP_COMMAND)", (0, 0))
    handshake.finish(link, rig, handshake.arm(link, *identity.board_hashes(link.parameters)))
    drive(link, rig, 0.5)
    assert link.armed
    assert rig.pwm != (0, 0)


def test_a_reset_in_mid_motion_ends_at_rest():
    """A board that restarts is disarmed, its PWM 0, and its clock is tied anew."""
    rig = BoardRig(start_us=123_456_789)
    link = armed(rig)
    drive(link, rig, 1.0)
    rig.reset()
    reports = drive(link, rig, 1.5)
    assert not link.armed
    assert rig.pwm == (0, 0)
    assert link.clock.restarts == 1
    last = reports[-1]
    assert last.sample.t_host_s == pytest.approx(last.t_arrival_s, abs=2 * TICK_S)


def test_board_time_wraps_in_mid_run():
    """Two seconds before the wrap of the 32-bit counter the run goes on over it unseen."""
    rig = BoardRig(start_us=2**32 - 3_000_000)
    link = armed(rig)
    reports = drive(link, rig, 3.0)
    stamps = [report.wire.t_mcu_us for report in reports]
    assert max(stamps) > 2**32 - 100_000
    assert stamps[-1] < 2_000_000
    times = [report.sample.t_host_s for report in reports]
    assert all(later > earlier for earlier, later in pairwise(times))
    assert link.armed
    assert link.clock.restarts == 0
    trips = [r.round_trip_s for r in reports if not math.isnan(r.round_trip_s)]
    assert max(trips) < 3 * TICK_S


def test_a_bad_line_is_survived():
    """With 1 byte in 500 damaged and 1 chunk in 20 lost both ways the board comes up and drives."""
    rng = random.Random(11)

    def spoil(data: bytes) -> bytes:
        if rng.random() < 0.05:
            return b""
        return bytes(b ^ rng.randrange(1, 256) if rng.random() < 0.002 else b for b in data)

    rig = BoardRig()
    rig.up = rig.down = spoil
    link = connected(rig, DEFAULTS | {"PID_KP": 0.2, "PID_KI": 1.1})
    handshake.finish(link, rig, handshake.arm(link, *identity.board_hashes(link.parameters)))
    reports = drive(link, rig, 5.0)
    assert link.armed
    assert 0.03 < link.loss_ratio < 0.3
    assert all(abs(r.sample.omega_left_rad_s) < 6.0 for r in reports)
    assert mean(r.sample.omega_left_rad_s for r in reports[-50:]) == pytest.approx(3.0, rel=0.2)
    assert link.counters.bad_crc > 0
    assert rig.board.bad_frames > 0
    assert rig.board.lost_frames > 0


def test_the_loss_reported_is_the_loss_made():
    """Exactly one frame in ten from the board taken away: 10 % within 2 %."""
    rig, count = BoardRig(), 0

    def every_tenth(data: bytes) -> bytes:
        nonlocal count
        count += 1 if data else 0
        return b"" if data and count % 10 == 0 else data

    link = armed(rig)
    rig.up = every_tenth
    frames, lost = link.counters.frames, link.counters.lost
    drive(link, rig, 10.0)
    frames, lost = link.counters.frames - frames, link.counters.lost - lost
    assert lost / (frames + lost) == pytest.approx(0.1, abs=0.02)


def test_a_third_of_the_line_is_to_spare():
    """In steady driving both directions stay under two thirds of 57,600 baud (3,840 bytes/s)."""
    rig = BoardRig()
    link = armed(rig)
    drive(link, rig, 2.0)
    up, down = rig.bytes_up, rig.bytes_down
    drive(link, rig, 5.0, speeds=(-3.3, 4.7))
    assert 2_000 < (rig.bytes_up - up) / 5.0 < 3_840
    assert 500 < (rig.bytes_down - down) / 5.0 < 3_840


WAYS = {BOARD_SYSTEM: "rx", HOST_SYSTEM: "tx"}  # a frame names its sender in its sixth byte


def test_every_frame_of_both_ways_reaches_the_tap():
    """The tap's frames decode with the dialect, in order, and count as many as were exchanged."""
    tapped = []
    rig = BoardRig()
    link = BoardLink(rig.stream, lambda t_s, frame: tapped.append((WAYS[frame[5]], t_s, frame)))
    handshake.finish(link, rig, handshake.connect(link, DEFAULTS))
    drive(link, rig, 0.5)
    decoder = dialect.MAVLink(None)
    names = {"rx": set(), "tx": set()}
    for way, _, frame in tapped:
        names[way].add(decoder.decode(bytearray(frame)).get_type())
    assert {"WHEEL_STATE", "HEARTBEAT", "BOARD_INFO", "TIMESYNC"} <= names["rx"]
    assert {"WHEEL_SETPOINT", "HEARTBEAT", "COMMAND_LONG", "TIMESYNC"} <= names["tx"]
    assert sum(way == "rx" for way, _, _ in tapped) == link.counters.frames
    times = [t_s for _, t_s, _ in tapped]
    assert times == sorted(times)
    assert sum(len(frame) for way, _, frame in tapped if way == "tx") == rig.bytes_down


def test_a_session_repeats_bit_for_bit():
    """Two runs of the same exchange give the same reports, clock ties included."""

    def run():
        rig = BoardRig(start_us=77)
        return drive(armed(rig), rig, 2.0)

    assert repr(run()) == repr(run())
