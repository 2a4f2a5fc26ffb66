"""MAVLink 2 signing on the board: what is signed with its key and new is acted on, and nothing else."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.board import _firmware
from hil.wire import dialect
from tests.firmware.bench import UINT32, BoardBench
from tests.firmware.signed_bench import (
    KEY,
    MINUTE,
    ORDERS,
    OTHER_KEY,
    SETPOINT,
    STAMP,
    STORING_TICKS,
    Peer,
    SignedBench,
)

ACCEPTED = dialect.MAV_RESULT_ACCEPTED
# FIPS 180-4's examples, and the lengths at which padding takes another block.
NIST = {
    b"abc": "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",
    b"": "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855",
    b"abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq":
        "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1",
}  # fmt: skip


@pytest.mark.parametrize("text", NIST)
def test_the_digests_of_the_standard(text):
    """The examples that come with SHA-256."""
    assert _firmware.sha256(text).hex() == NIST[text]


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.binary(max_size=300))
def test_any_digest(text):
    """Of bytes drawn at random, over one to five blocks."""
    assert _firmware.sha256(text) == hashlib.sha256(text).digest()


def state_of(bench: BoardBench) -> tuple:
    """Return what an order could change."""
    board = bench.board
    wheels = [(board.wheel(side).setpoint_rad_s, board.wheel(side).pwm) for side in (0, 1)]
    return board.state, board.reason, board.parameters, wheels, board.signs, board.eeprom[:640]


def unsigned(_: SignedBench, message) -> bytes:
    """Return the frame as a host without the key sends it."""
    return bytes(message.pack(dialect.MAVLink(None, 255, 190)))


def flipped(bench: SignedBench, message) -> bytes:
    """Return the frame with another bit in its signature."""
    frame = bytearray(bench.peer.encode(message))
    frame[-3] ^= 0x10
    return bytes(frame)


def other_key(bench: SignedBench, message) -> bytes:
    """Return it signed, and new, but with another key."""
    return Peer(OTHER_KEY, stamp=bench.peer.stamp + 10).encode(message)


def older(bench: SignedBench, message) -> bytes:
    """Return it with a time stamp before the last one of this sender."""
    frame = Peer(stamp=bench.peer.stamp - 10).encode(message)
    bench.send(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    return frame


def other_link(bench: SignedBench, message) -> bytes:
    """Return it from another link of the sender, more than a minute behind."""
    return Peer(link_id=3, stamp=bench.peer.stamp - MINUTE - 1000).encode(message)


def zeros(bench: SignedBench, message) -> bytes:
    """Return it with a signature of zeros."""
    return bench.peer.encode(message)[:-6] + bytes(6)


def moved(bench: SignedBench, message) -> bytes:
    """Return it with the signature of another frame."""
    other = bench.peer.encode(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    return bench.peer.encode(message)[:-13] + other[-13:]


FORGED: list[Callable] = [unsigned, flipped, other_key, older, other_link, zeros, moved]


@pytest.mark.parametrize("forge", FORGED, ids=lambda forge: forge.__name__)
@pytest.mark.parametrize("armed", [False, True], ids=["disarmed", "armed"])
def test_what_is_not_signed_with_the_key_and_new_changes_nothing(forge, armed):
    """Set-points, arming, parameters, stops and questions: no answer, no wheel moves; signed, all do."""
    bench = SignedBench()
    if armed:
        assert bench.arm() == ACCEPTED
    for name, order in ORDERS.items():
        message = order or arming(bench)
        bench.messages.clear()
        before = state_of(bench)
        bench.receive(forge(bench, message))
        bench.collect()
        assert state_of(bench) == before, name
        assert {m.get_type() for m in bench.messages} <= {"WHEEL_STATE"}, name
    bench.receive(forge(bench, SETPOINT))
    said = bench.texts()
    assert any(text.startswith("frame refused: ") for text in said)
    assert bench.command(dialect.MAV_CMD_REQUEST_MESSAGE, 24102.0) == ACCEPTED


def arming(bench: BoardBench):
    """Return the command that arms this board."""
    halves = [
        float(half)
        for value in (_firmware.dialect_hash(), bench.board.parameter_hash)
        for half in divmod(value, 1 << 16)
    ]
    return dialect.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, *halves, 0)


def test_a_signed_session_drives():
    """Negative control of all the others: arming, set-points and parameters act when they are signed."""
    bench = SignedBench()
    assert bench.arm() == ACCEPTED
    bench.setpoint(5.0)
    bench.tick(5)
    assert min(bench.pwm) > 0
    bench.set_param("FF_GAIN", 0.02)
    assert bench.board.parameters["FF_GAIN"] == pytest.approx(0.02)


def test_every_frame_of_the_board_is_signed_and_counts_up():
    """Pymavlink finds each good; nothing goes out that is not signed."""
    bench = SignedBench()
    stamps = []
    for _ in range(300):
        bench.board.tick(bench.t_us & UINT32, 0, 0)
        bench.t_us += _firmware.TICK_US
        data = bench.board.transmit()
        while data:
            size = 12 + data[1] + 13
            assert data[2] == 1
            stamps.append(int.from_bytes(data[size - 12 : size - 6], "little"))
            assert len(bench.peer.heard(data[:size])) == 1
            data = data[size:]
    assert len(stamps) > 60
    assert all(a < b for a, b in itertools.pairwise(stamps))


def test_a_frame_sent_again_is_refused():
    """The same bytes, at once and after others: acted on once."""
    bench = SignedBench()
    assert bench.arm() == ACCEPTED
    stop = bench.peer.encode(ORDERS["stop"])
    bench.receive(stop)
    assert bench.board.state == dialect.HIL_STATE_SAFE
    bench.collect()
    assert bench.arm() == ACCEPTED
    bench.receive(stop)
    assert bench.board.state == dialect.HIL_STATE_ARMED


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.lists(st.tuples(st.sampled_from(FORGED), st.sampled_from(sorted(ORDERS)),
                          st.integers(0, 3)), max_size=25))  # fmt: skip
def test_no_sequence_of_forgeries_moves_a_wheel(steps):
    """Any order of forged frames, replays of good ones between them: the signed set-point stays in force."""
    bench = SignedBench()
    assert bench.arm() == ACCEPTED
    bench.setpoint(2.0)
    heard = [bench.peer.encode(dialect.MAVLink_wheel_setpoint_message(2.0, 2.0, 2))]
    bench.receive(heard[0])
    bench.tick()
    for forge, name, ticks in steps:
        bench.receive(forge(bench, ORDERS[name] or arming(bench)))
        bench.receive(heard[0])
        bench.tick(ticks)
        assert bench.board.wheel(0).setpoint_rad_s == bench.board.wheel(1).setpoint_rad_s == 2.0
        assert bench.board.state == dialect.HIL_STATE_ARMED
        assert bench.board.signs


# ---- the key ----


def test_the_key_is_set_over_usb_only():
    """Over Bluetooth nothing changes, and the board says why; over USB it signs from then on."""
    bench = SignedBench(b"")
    assert not bench.board.signs
    before = state_of(bench)
    bench.set_key(KEY, usb=False)
    assert state_of(bench) == before
    plain = BoardBench()
    plain.board.receive(
        dialect.MAVLink_setup_signing_message(1, 1, list(KEY), 0).pack(dialect.MAVLink(None)), 0
    )
    assert "key refused: it is set over the USB port only" in plain.texts()
    bench.set_key(KEY, usb=True)
    assert bench.board.signs
    assert _firmware.Board(bench.board.eeprom).signs
    assert "signing key stored" in bench.texts()
    assert bench.arm() == ACCEPTED


@pytest.mark.parametrize("key", [OTHER_KEY, bytes(32)], ids=["another key", "no key"])
def test_a_board_with_a_key_takes_another_over_usb_only(key):
    """Nor is it switched off over Bluetooth, signed or not."""
    bench = SignedBench()
    bench.set_key(key, usb=False)
    bench.send(dialect.MAVLink_setup_signing_message(1, 1, list(key), STAMP))
    bench.tick(STORING_TICKS)
    assert bench.arm() == ACCEPTED
    bench.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0.0)
    bench.set_key(key, usb=True)
    assert bench.board.signs == any(key)
    assert KEY not in bench.board.eeprom


def test_no_key_is_set_on_an_armed_board():
    """The wheels would be left to a host that cannot speak to it any more."""
    bench = SignedBench()
    assert bench.arm() == ACCEPTED
    bench.set_key(OTHER_KEY, usb=True)
    assert bench.board.signs
    assert KEY in bench.board.eeprom


def test_the_same_key_again_writes_nothing():
    """A host that repeats itself wears nothing out and starts nothing anew."""
    bench = SignedBench()
    bench.tick(STORING_TICKS)
    before = bench.board.eeprom
    bench.set_key(KEY, usb=True)
    assert bench.board.eeprom == before


@pytest.mark.parametrize("new", [OTHER_KEY, bytes(32)], ids=["another key", "no key"])
def test_a_key_cut_short_in_storage_never_lets_unsigned_frames_in(new):
    """Power gone after each byte: the old key or the new one; none only where that was stored whole."""
    bench = SignedBench()
    bench.tick(STORING_TICKS)
    message = dialect.MAVLink_setup_signing_message(1, 1, list(new), STAMP)
    bench.board.wired = True
    bench.board.receive(message.pack(dialect.MAVLink(None, 255, 190)), bench.t_us & UINT32)
    whole = 0
    for _ in range(STORING_TICKS):
        bench.tick()
        woken = _firmware.Board(bench.board.eeprom)
        if woken.signs:
            assert whole == 0 or any(new)
        else:
            whole += 1
            assert not any(new)
    assert (whole > 0) == (not any(new))


def test_a_first_key_cut_short_locks_the_board():
    """Half a key is no key, and not none: everything is refused but a key over USB, and it says so."""
    bench = SignedBench(b"")
    message = dialect.MAVLink_setup_signing_message(1, 1, list(KEY), STAMP)
    bench.board.wired = True
    bench.board.receive(message.pack(dialect.MAVLink(None, 255, 190)), bench.t_us & UINT32)
    bench.tick(20)
    woken = BoardBench()
    woken.board = _firmware.Board(bench.board.eeprom)
    woken.setpoint(1.0)
    woken.set_param("PWM_MAX", 0.5)
    assert woken.board.parameters["PWM_MAX"] == 1.0
    assert "stored key damaged: all refused; set it over USB" in woken.texts()
    locked = SignedBench(bench.board.eeprom)
    locked.set_key(KEY, usb=True)
    assert locked.board.signs


def test_a_key_cut_short_after_one_was_erased_locks_the_board_too():
    """That no key was there before is known of a record of its own: half a new one is no leave to all."""
    bench = SignedBench()
    bench.set_key(bytes(32), usb=True)
    assert not bench.board.signs
    message = dialect.MAVLink_setup_signing_message(1, 1, list(OTHER_KEY), STAMP)
    bench.board.wired = True
    bench.board.receive(message.pack(dialect.MAVLink(None, 255, 190)), bench.t_us & UINT32)
    bench.tick(20)
    woken = BoardBench()
    woken.board = _firmware.Board(bench.board.eeprom)
    woken.set_param("PWM_MAX", 0.5)
    assert woken.board.parameters["PWM_MAX"] == 1.0
    assert "stored key damaged: all refused; set it over USB" in woken.texts()
    locked = SignedBench(bench.board.eeprom)
    locked.set_key(bytes(32), usb=True)
    opened = BoardBench()
    opened.board = _firmware.Board(locked.board.eeprom)
    opened.set_param("PWM_MAX", 0.5)
    assert opened.board.parameters["PWM_MAX"] == 0.5


def test_without_a_key_a_signed_frame_is_refused_in_words():
    """A host with a key meets a board without: it is told, and nothing is acted on."""
    bench = BoardBench()
    bench.receive(Peer().encode(ORDERS["parameter"]))
    assert bench.board.parameters["PWM_MAX"] == 1.0
    assert "frame refused: signed, and the board has no key" in bench.texts()
