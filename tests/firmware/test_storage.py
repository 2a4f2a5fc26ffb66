"""Parameters in the EEPROM: two images in turn, and what a save that is cut short leaves."""

from __future__ import annotations

import pytest

from hil.board import _firmware
from hil.wire import dialect, identity
from tests.firmware.bench import BoardBench

ACCEPTED = dialect.MAV_RESULT_ACCEPTED
REJECTED = dialect.MAV_RESULT_TEMPORARILY_REJECTED
IMAGE_TICKS = _firmware.IMAGE_SIZE + 1  # a byte a tick, and the last one has to be done


def order_to_store(bench: BoardBench) -> None:
    """Order a save; the board says that it has begun."""
    result = bench.command(dialect.MAV_CMD_PREFLIGHT_STORAGE, 1.0)
    assert result == dialect.MAV_RESULT_IN_PROGRESS


def save(bench: BoardBench, gain: float, ticks: int = IMAGE_TICKS) -> bytes:
    """Set K0, order a save and let `ticks` pass; return the EEPROM as it is then."""
    bench.set_param("ISM_K0", gain)
    order_to_store(bench)
    bench.tick(ticks)
    return bench.board.eeprom


def acknowledged(bench: BoardBench) -> bool:
    """Whether the order to store has been acknowledged as done since the messages were cleared."""
    return any(m.result == ACCEPTED for m in bench.of(dialect.MAVLINK_MSG_ID_COMMAND_ACK))


def woken(eeprom: bytes) -> BoardBench:
    """Return a bench whose board has powered up with this EEPROM."""
    bench = BoardBench()
    bench.board = _firmware.Board(eeprom)
    bench.tick()
    return bench


def test_parameters_survive_storage():
    """What was stored is in force after a restart, hash included."""
    board = _firmware.Board(save(BoardBench(), 0.25))
    assert board.loaded == _firmware.ImageResult.LOADED
    assert board.parameters["ISM_K0"] == 0.25
    assert board.parameter_hash == identity.parameter_hash(board.parameters)


def test_storing_is_acknowledged_once_the_last_byte_is_in():
    """No ACCEPTED while bytes are left; whenever there is one, a reset finds the new values."""
    bench = BoardBench()
    bench.set_param("ISM_K0", 0.25)
    order_to_store(bench)
    for _ in range(IMAGE_TICKS + 5):
        bench.tick()
        in_force = _firmware.Board(bench.board.eeprom).parameters["ISM_K0"]
        assert not acknowledged(bench) or in_force == 0.25
    assert acknowledged(bench)


def test_a_repeated_order_to_store_is_acknowledged_once_and_for_the_last_values():
    """Asked again in mid-save with other values: ACCEPTED comes when those are stored, not before."""
    bench = BoardBench()
    save(bench, 0.25, IMAGE_TICKS // 2)
    bench.set_param("ISM_K0", 0.35)
    order_to_store(bench)
    for _ in range(2 * IMAGE_TICKS):
        bench.tick()
        in_force = _firmware.Board(bench.board.eeprom).parameters["ISM_K0"]
        assert not acknowledged(bench) or in_force == pytest.approx(0.35)
    assert acknowledged(bench)


@pytest.mark.parametrize("earlier", [1, 2, 3, 300])
def test_a_save_cut_short_anywhere_keeps_the_one_before(earlier):
    """After any number of whole saves (the serial wraps), a cut after each byte: the last whole one."""
    bench = BoardBench()
    for count in range(earlier):
        save(bench, 0.1 + 0.001 * (count % 2))
    kept = bench.board.parameters["ISM_K0"]
    bench.set_param("ISM_K0", 0.45)
    order_to_store(bench)
    for written in range(1, _firmware.IMAGE_SIZE):
        bench.tick()
        board = _firmware.Board(bench.board.eeprom)
        assert board.loaded == _firmware.ImageResult.LOADED
        assert board.parameters["ISM_K0"] == kept, f"cut after {written} bytes"
    bench.tick()
    assert _firmware.Board(bench.board.eeprom).parameters["ISM_K0"] == pytest.approx(0.45)


def test_a_save_cut_short_is_said_at_the_next_start():
    """The parameters before it are in force and the board says so, until a save is whole again."""
    bench = BoardBench()
    save(bench, 0.25)
    cut = woken(save(bench, 0.35, IMAGE_TICKS // 2))
    assert cut.board.parameters["ISM_K0"] == 0.25
    assert "last save was cut short, the one before in force" in cut.texts()
    assert woken(save(cut, 0.35)).texts() == []


def test_any_damage_to_the_only_image_leaves_the_defaults():
    """Every single byte flipped, every truncation: defaults, and a text."""
    image = save(BoardBench(), 0.25)[: _firmware.IMAGE_SIZE]
    defaults = _firmware.Board().parameters
    damaged = [image[:i] + bytes([image[i] ^ 0x10]) + image[i + 1 :] for i in range(len(image))]
    damaged += [image[:n] for n in range(1, len(image), 7)]
    for bad in damaged:
        board = _firmware.Board(bad)
        assert board.loaded == _firmware.ImageResult.DAMAGED
        assert board.parameters == defaults
    assert "stored parameters damaged, defaults in force" in woken(damaged[7]).texts()


def test_blank_storage_is_no_damage():
    """A new EEPROM reads 0xFF throughout: defaults without a complaint."""
    bench = woken(b"")
    assert bench.board.loaded == _firmware.ImageResult.BLANK
    assert bench.texts() == []


def test_defaults_come_back_on_request_and_storage_waits_for_disarming():
    """Storage commands while armed are refused with a text."""
    bench = BoardBench()
    bench.set_param("ISM_K0", 0.25)
    assert bench.command(dialect.MAV_CMD_PREFLIGHT_STORAGE, 2.0) == ACCEPTED
    assert bench.board.parameters == _firmware.Board().parameters
    assert bench.board.parameter_hash == _firmware.parameter_hash({})
    assert bench.arm() == ACCEPTED
    assert bench.command(dialect.MAV_CMD_PREFLIGHT_STORAGE, 1.0) == REJECTED
    bench.tick(10)
    assert bench.board.eeprom == _firmware.Board().eeprom
    assert "command refused: armed" in bench.texts()
