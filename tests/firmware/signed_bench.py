"""A bench for a board with a signing key, whose host is pymavlink: signatures by another hand than ours."""

from __future__ import annotations

from typing import Any

from hil.board import _firmware
from hil.wire import dialect
from tests.firmware.bench import UINT32, BoardBench

KEY = bytes(range(1, 33))
OTHER_KEY = bytes(range(101, 133))
# In 2026; a minute in units of 10 us.
STAMP, MINUTE = 36_000_000_000_000, 6_000_000
STORING_TICKS = 100
SETPOINT = dialect.MAVLink_wheel_setpoint_message(5.0, 5.0, 1000)
ORDERS = {
    "set-point": SETPOINT,
    "arming": None,  # of the bench
    "parameter": dialect.MAVLink_param_set_message(1, 1, b"PWM_MAX", 0.5, 9),
    "stop": dialect.MAVLink_command_long_message(1, 1, 185, 0, 1, 0, 0, 0, 0, 0, 0),
    "identity": dialect.MAVLink_command_long_message(1, 1, 512, 0, 24102, 0, 0, 0, 0, 0, 0),
    "time": dialect.MAVLink_timesync_message(0, 1),
}


class Peer:
    """pymavlink's own signing: one sender, by default the host."""

    def __init__(self, key: bytes = KEY, link_id: int = 0, stamp: int = STAMP) -> None:
        self.mav = dialect.MAVLink(None, 255, 190)
        self.mav.robust_parsing = True
        signing = self.mav.signing
        signing.secret_key, signing.link_id, signing.timestamp = key, link_id, stamp
        signing.sign_outgoing = True

    @property
    def stamp(self) -> int:
        """The stamp of its next frame."""
        return int(self.mav.signing.timestamp)

    def encode(self, message: Any) -> bytes:
        """Return the frame, signed."""
        return bytes(message.pack(self.mav))

    def heard(self, data: bytes) -> list[Any]:
        """Return the messages whose signatures are good."""
        found = self.mav.parse_buffer(bytearray(data)) or []
        return [m for m in found if m.get_type() != "BAD_DATA"]


class SignedBench(BoardBench):
    """A board that was given the key and has run for a while; what it says is checked by the peer."""

    def __init__(self, eeprom: bytes | None = None, peer: Peer | None = None) -> None:
        self.peer = peer or Peer()
        super().__init__()
        self.board = _firmware.Board(_firmware.stored_key(KEY, STAMP) if eeprom is None else eeprom)
        self.tick(30)

    def send(self, message: Any) -> None:
        """Send one message to the board, signed."""
        self.receive(self.peer.encode(message))

    def collect(self) -> None:
        """Take what the board has for the serial port."""
        while data := self.board.transmit():
            self.sent_bytes += len(data)
            self.messages += self.peer.heard(data)

    def set_key(self, key: bytes, *, usb: bool, stamp: int = STAMP) -> None:
        """Send SETUP_SIGNING, unsigned, over one of the ports; the board has time to store it."""
        message = dialect.MAVLink_setup_signing_message(1, 1, list(key), stamp)
        self.board.wired = usb
        self.board.receive(message.pack(dialect.MAVLink(None, 255, 190)), self.t_us & UINT32)
        self.tick(STORING_TICKS)
        self.board.wired = False
