"""Time stamps of signed frames on the board: nothing is new twice, over restarts and to the end of clocks."""

from __future__ import annotations

import pytest

from hil.board import _firmware
from hil.wire import dialect
from tests.firmware.signed_bench import (
    KEY,
    MINUTE,
    ORDERS,
    STAMP,
    STORING_TICKS,
    Peer,
    SignedBench,
)

ACCEPTED = dialect.MAV_RESULT_ACCEPTED


def stamps_refused(bench: SignedBench, frames: list[bytes]) -> bool:
    """Return whether none of the frames is acted on."""
    state = bench.board.state
    for frame in frames:
        bench.receive(frame)
        bench.tick()
    return bench.board.state == state


def test_nothing_that_was_acted_on_is_new_after_a_restart():
    """Power gone at each tick of three minutes' driving: no stop that was heard before stops again."""
    bench = SignedBench()
    heard = []
    for second in range(180):
        frame = bench.peer.encode(ORDERS["stop"])
        bench.receive(frame)
        heard.append(frame)
        bench.tick(250)
        if second % 20 == 7:
            woken = SignedBench(bench.board.eeprom, Peer(stamp=bench.peer.stamp))
            assert woken.arm() == ACCEPTED
            assert stamps_refused(woken, heard[-40:])
            assert woken.arm() == ACCEPTED


def test_a_host_far_ahead_is_heard_once_its_stamp_is_stored():
    """A day ahead: its first frame is not acted on, and after the power was gone it is still not new."""
    bench = SignedBench()
    bench.peer.mav.signing.timestamp = STAMP + 24 * 60 * MINUTE
    frame = bench.peer.encode(ORDERS["parameter"])
    bench.receive(frame)
    assert bench.board.parameters["PWM_MAX"] == 1.0
    bench.tick(40)
    bench.set_param("PWM_MAX", 0.6)
    assert bench.board.parameters["PWM_MAX"] == pytest.approx(0.6)
    assert bench.board.stamp >= STAMP + 24 * 60 * MINUTE
    woken = SignedBench(bench.board.eeprom, Peer(stamp=bench.peer.stamp))
    woken.receive(frame)
    assert woken.board.parameters["PWM_MAX"] == 1.0


def test_a_host_behind_takes_over_the_stamp_of_the_board():
    """Its clock is years behind: having heard the board it is new, as the standard has it."""
    bench = SignedBench(peer=Peer(stamp=1000))
    assert bench.peer.stamp >= STAMP
    assert bench.arm() == ACCEPTED


def test_the_storage_of_stamps_wears_evenly_and_slowly():
    """Ten minutes: a stamp every half minute at the most, each in a place of its own."""
    bench = SignedBench()
    before = bench.board.eeprom
    bench.tick(250 * 600)
    after = bench.board.eeprom
    changed = [
        slot for slot in range(256)
        if before[1024 + 10 * slot : 1034 + 10 * slot] != after[1024 + 10 * slot : 1034 + 10 * slot]
    ]  # fmt: skip
    assert 15 <= len(changed) <= 22
    assert before[:1024] == after[:1024]


def test_a_fifth_sender_waits_until_one_of_four_is_a_minute_old():
    """Places for senders are few; one is given away when nothing of it could be new any more."""
    bench = SignedBench()
    bench.tick(STORING_TICKS)
    ask = ORDERS["identity"]

    def answered(link_id: int) -> bool:
        bench.messages.clear()
        bench.receive(Peer(link_id=link_id, stamp=bench.board.stamp).encode(ask))
        bench.collect()
        return bool(bench.of(dialect.MAVLINK_MSG_ID_BOARD_INFO))

    assert [answered(link) for link in range(5)] == [True] * 4 + [False]
    for _ in range(70):
        bench.tick(250)
        bench.receive(Peer(link_id=1, stamp=bench.board.stamp).encode(ask))
    assert answered(4)


def set_limit(value: float):
    """Return the order that gives PWM_MAX this value."""
    return dialect.MAVLink_param_set_message(1, 1, b"PWM_MAX", value, 9)


def test_stamp_zero_is_nobodys():
    """A board that met no clock takes stamp 1 of a new sender, once; never 0, which stands for "nobody"."""
    bench = SignedBench(_firmware.stored_key(KEY, 0), Peer(stamp=1))
    for stamp, acted_on in ((0, False), (1, True)):
        frame = Peer(link_id=5, stamp=stamp).encode(set_limit(0.5))
        bench.receive(frame)
        assert (bench.board.parameters["PWM_MAX"] == 0.5) == acted_on
        bench.set_param("PWM_MAX", 0.75)
        bench.receive(frame)
        assert bench.board.parameters["PWM_MAX"] == 0.75


# A year before 48 bits are at their end.
STAMP_MOST = 2**48 - 1 - 365 * 24 * 60 * MINUTE


@pytest.mark.parametrize("stamp", [STAMP_MOST + 1, 2**48 - 1])
def test_a_sender_past_all_clocks_cannot_shut_the_others_out(stamp):
    """Its frames are refused and move no stamp, now and after a restart."""
    bench = SignedBench()
    bench.receive(Peer(link_id=7, stamp=stamp).encode(set_limit(0.5)))
    bench.tick(STORING_TICKS)
    assert bench.board.stamp < STAMP + 3 * MINUTE
    assert bench.board.parameters["PWM_MAX"] == 1.0
    assert "frame refused: its time stamp is not newer" in bench.texts()
    for board in (bench, SignedBench(bench.board.eeprom)):
        board.set_param("PWM_MAX", 0.25)
        assert board.board.parameters["PWM_MAX"] == 0.25


def test_the_last_stamp_of_all_clocks_is_a_stamp_as_any_other():
    """Up to there a sender is heard, once its stamp is stored."""
    bench = SignedBench(peer=Peer(stamp=STAMP_MOST - MINUTE))
    bench.set_param("PWM_MAX", 0.5)
    bench.tick(40)
    bench.set_param("PWM_MAX", 0.5)
    assert bench.board.parameters["PWM_MAX"] == 0.5


@pytest.mark.parametrize("begin", [STAMP_MOST + 1, 2**48 - 1, 2**48, 2**64 - 1])
def test_a_key_that_begins_past_all_clocks_wears_nothing_out(begin):
    """SETUP_SIGNING has 64 bits for it: the key is set, stamps go on, one is stored per half minute."""
    bench = SignedBench(b"", Peer(stamp=1))
    bench.set_key(KEY, usb=True, stamp=begin)
    assert bench.board.signs
    before = bench.board.eeprom
    bench.tick(250 * 20)
    assert bench.board.eeprom == before
    assert bench.board.stamp < STAMP_MOST
    assert bench.arm() == ACCEPTED
