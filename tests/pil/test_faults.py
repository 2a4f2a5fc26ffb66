"""What can go wrong with the board ends at rest and in a named state."""

import pytest

from hil.board import _firmware
from hil.config.events import Fault
from hil.core.errors import RigFault
from hil.wire import dialect, handshake
from tests.pil.memory import constants, symbols
from tests.pil.rigs import PilDrive, needs_toolchain

pytestmark = needs_toolchain

SPEED_RAD_S = 6.0


def moving(*faults):
    """Return a drive that has run at 6 rad/s for a second; faults count from then."""
    drive = PilDrive(faults=faults)
    drive.arm()
    drive.run(1.0, SPEED_RAD_S, SPEED_RAD_S)
    assert drive.twin.truth().eta1_m_s > 0.2
    drive.twin.begin(drive.twin.now_s())
    return drive


def assert_at_rest(drive):
    """Bridge off and the robot standing."""
    assert drive.duties == (0.0, 0.0)
    assert abs(drive.twin.truth().eta1_m_s) < 0.001


def test_reset_in_mid_motion_ends_disarmed_and_is_named():
    """Reset for 50 ms under way: the board comes back disarmed, says so, and refuses set-points."""
    drive = moving(Fault(kind="board_reset", start_s=0.2, end_s=0.25))
    drive.run(0.22, SPEED_RAD_S, SPEED_RAD_S)
    assert drive.duties == (0.0, 0.0), "the bridge is off while the board is in reset"
    drive.run(2.0, SPEED_RAD_S, SPEED_RAD_S)
    assert_at_rest(drive)
    assert drive.link.state_name == "DISARMED"
    assert "restarted while armed: watchdog, reset or supply" in drive.texts
    assert "set-point refused: not armed" in drive.texts


def test_reset_at_rest_is_no_restart_while_armed():
    """The mark of having been armed is not left behind by a disarmed board (negative control)."""
    drive = moving(Fault(kind="board_reset", start_s=1.0, end_s=1.05))
    handshake.finish(drive.link, drive.twin, handshake.disarm(drive.link))
    drive.wait(2.5)
    assert drive.link.state_name == "DISARMED"
    assert not [text for text in drive.texts if text.startswith("restarted")]


def test_power_cut_in_mid_motion_leaves_the_robot_at_rest():
    """A board that stays dead: no bytes, bridge off, robot at rest."""
    drive = moving(Fault(kind="board_reset", start_s=0.2))
    drive.run(0.3, SPEED_RAD_S, SPEED_RAD_S)
    frames = drive.link.counters.frames
    drive.run(2.0, SPEED_RAD_S, SPEED_RAD_S)
    assert_at_rest(drive)
    assert drive.link.counters.frames == frames


def test_hung_host_stops_the_wheels_within_a_quarter_second():
    """No set-point for 250 ms: bridge off, SAFE (SETPOINT_TIMEOUT), and only arming leaves it."""
    drive = moving()
    drive.run(1 / 30, SPEED_RAD_S, SPEED_RAD_S)  # the last set-point is a thirtieth old afterwards
    drive.wait(0.200)
    assert drive.duties != (0.0, 0.0)
    drive.wait(0.255 - 0.200 - 1 / 30)
    assert drive.duties == (0.0, 0.0)
    drive.run(2.0, SPEED_RAD_S, SPEED_RAD_S)
    assert_at_rest(drive)
    assert drive.link.state_name == "SAFE (SETPOINT_TIMEOUT)"
    drive.arm()
    drive.run(1.0, SPEED_RAD_S, SPEED_RAD_S)
    assert drive.twin.truth().eta1_m_s > 0.2


def test_cut_link_stops_the_wheels():
    """Nothing passes either way for 2 s: SAFE (SETPOINT_TIMEOUT) when the host hears of it again."""
    drive = moving(Fault(kind="link_cut", start_s=0.2, end_s=2.2))
    drive.run(0.2 + 0.255, SPEED_RAD_S, SPEED_RAD_S)
    assert drive.duties == (0.0, 0.0)
    drive.run(2.5, SPEED_RAD_S, SPEED_RAD_S)
    assert_at_rest(drive)
    assert drive.link.state_name == "SAFE (SETPOINT_TIMEOUT)"


def test_hung_program_is_reset_by_the_watchdog():
    """A program caught in an endless loop: within 64 ms the watchdog resets the board."""
    drive = moving()
    drive.board.jump(symbols(drive.twin.build.elf)["__stop_program"])
    drive.wait(0.050)
    assert drive.duties != (0.0, 0.0), "the timers hold the duty while the program hangs"
    drive.wait(0.020)
    assert drive.duties == (0.0, 0.0)
    assert drive.board.usage()["watchdog_resets"] == 1
    drive.run(2.0, SPEED_RAD_S, SPEED_RAD_S)
    assert_at_rest(drive)
    assert drive.link.state_name == "DISARMED"
    assert "restarted while armed: watchdog, reset or supply" in drive.texts


@pytest.mark.parametrize("wrong", ["dialect", "parameter"])
def test_wrong_hash_does_not_arm(wrong):
    """A host of another dialect or with other parameters is refused by name, and nothing moves."""
    drive = PilDrive()
    handshake.finish(drive.link, drive.twin, handshake.read_info(drive.link))
    hashes = [drive.link.info.dialect_hash, drive.link.info.parameter_hash]
    hashes[0 if wrong == "dialect" else 1] ^= 1
    arming = handshake.arm(drive.link, *hashes)
    with pytest.raises(RigFault, match=f"not armed: {wrong} hashes differ"):
        handshake.finish(drive.link, drive.twin, arming)
    drive.run(1.0, SPEED_RAD_S, SPEED_RAD_S)
    assert_at_rest(drive)
    assert drive.link.state_name == "DISARMED"


def saved(drive, name="PID_KP", value=0.2):
    """Set a parameter and order the board to store them; returns when it has accepted."""
    for step in (
        handshake.download_parameters(drive.link),
        handshake.set_parameter(drive.link, name, value),
    ):
        handshake.finish(drive.link, drive.twin, step)
    drive.link.send_command(dialect.MAV_CMD_PREFLIGHT_STORAGE, 0, 1.0)


def image_s():
    """Return the time of a whole save: a byte a tick."""
    return constants("core/params.h", "hil::IMAGE_SIZE")[0] * _firmware.TICK_US * 1e-6


def test_stored_parameters_survive_power_down():
    """What was stored is in force after the next power-up, of another board with that EEPROM."""
    first = PilDrive()
    saved(first)
    first.wait(image_s() + 0.1)
    second = PilDrive(eeprom=first.board.eeprom(512))
    handshake.finish(second.link, second.twin, handshake.download_parameters(second.link))
    assert second.link.parameters["PID_KP"] == pytest.approx(0.2)
    assert second.link.parameters["PID_KI"] == first.link.parameters["PID_KI"]
    second.wait(1.0)
    assert not second.texts


@pytest.mark.parametrize("after_s", [0.0, 0.3, 0.8])
def test_stored_means_stored(after_s):
    """The board is reset at any time behind the host's "stored": the new values are in force."""
    drive = PilDrive(
        faults=(Fault(kind="board_reset", start_s=after_s + 0.001, end_s=after_s + 0.01),)
    )
    for step in (
        handshake.download_parameters(drive.link),
        handshake.set_parameter(drive.link, "BATT_LOW", 10.5),
        handshake.store(drive.link),
    ):
        handshake.finish(drive.link, drive.twin, step)
    drive.twin.begin(drive.twin.now_s())
    drive.wait(after_s + 0.3)
    handshake.finish(drive.link, drive.twin, handshake.download_parameters(drive.link))
    assert drive.link.parameters["BATT_LOW"] == 10.5
    drive.wait(1.0)
    assert not drive.texts


@pytest.mark.parametrize("share", [0.1, 0.5, 0.95])
def test_a_reset_in_mid_save_keeps_the_parameters_before(share):
    """A whole save, then one that a reset cuts short: the first one's values, a text, and no "stored"."""
    begin_s = share * image_s()
    drive = PilDrive(faults=(Fault(kind="board_reset", start_s=begin_s, end_s=begin_s + 0.01),))
    saved(drive, value=0.1)
    drive.wait(image_s() + 0.2)
    handshake.finish(drive.link, drive.twin, handshake.set_parameter(drive.link, "PID_KP", 0.3))
    drive.link.texts.clear()
    drive.link.begin(handshake.store(drive.link))
    drive.link.acks.clear()
    while not drive.link.acks:
        drive.wait(0.005)
    drive.twin.begin(drive.twin.now_s())

    def wait_for_the_end() -> None:
        while drive.link.busy:
            drive.wait(0.02)

    with pytest.raises(RigFault, match="was reset before its parameters were stored"):
        wait_for_the_end()
    handshake.finish(drive.link, drive.twin, handshake.download_parameters(drive.link))
    assert drive.link.parameters["PID_KP"] == pytest.approx(0.1)
    assert "last save was cut short, the one before in force" in drive.texts


def test_half_written_eeprom_leaves_the_defaults_and_says_so():
    """Power lost in the middle of a save: the checksum fails, defaults are in force, and it runs."""
    first = PilDrive()
    saved(first)
    first.wait(image_s() / 2)
    second = PilDrive(eeprom=first.board.eeprom(512))
    second.wait(1.0)
    assert "stored parameters damaged, defaults in force" in second.texts
    handshake.finish(second.link, second.twin, handshake.download_parameters(second.link))
    defaults = {entry.name: entry.default for entry in _firmware.parameter_table()}
    assert second.link.parameters == pytest.approx(defaults)
    assert_at_rest(second)
    assert second.link.state_name == "DISARMED"
    second.arm()
    second.run(1.0, SPEED_RAD_S, SPEED_RAD_S)
    assert second.twin.truth().eta1_m_s > 0.2
