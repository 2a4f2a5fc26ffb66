"""Sets and erases the signing key of a board on its USB port.

The key goes from its file to the port: it is in no record, log, message or exception.
"""

from __future__ import annotations

import time

from hil.core.errors import RigFault
from hil.core.rig import ByteStream
from hil.rigs.serial import SerialRig, parse_target
from hil.wire import dialect
from hil.wire.framing import BOARD_COMPONENT, BOARD_SYSTEM
from hil.wire.link import BoardLink
from hil.wire.signing import KEY_BYTES, FrameCutter, Key, flagged, stamp_at

_REPEAT_S = 0.5
# The board's port changes to the USB one after a second; a board that was reset starts within two more, and
# storing takes a third of one.
_MOST_S = 10.0
_STORED, _ERASED, _REFUSED = (
    "signing key stored",
    "signing key erased",
    ("key refused", "command refused"),
)
# What is in force already is not stored again: that it is in force is seen in so many frames.
_SURE_FRAMES = 75


class _BareStream:
    """The board's frames whatever their signatures; counts those that are the key's, and unsigned ones."""

    def __init__(self, stream: ByteStream, key: Key | None) -> None:
        self._stream = stream
        self._key = key
        self._cutter = FrameCutter()
        self.as_wanted = 0

    def read(self) -> bytes:
        """Return the frames that have arrived by now, bared."""
        good = b""
        for frame, block in self._cutter.feed(self._stream.read()):
            good += frame
            wanted = not block
            if self._key is not None:
                signed = flagged(frame, 1) + block[:7]
                wanted = len(block) > 0 and self._key.signature(signed) == block[7:]
            self.as_wanted = self.as_wanted + 1 if wanted else 0
        return good

    def write(self, data: bytes) -> None:
        """Send the bytes as they are."""
        self._stream.write(data)


def set_board_key(target: str, key: Key) -> None:
    """Set a key on the board at `serial:DEV[@BAUD]`, or DEV; returns when it is stored.

    Raises RigFault where the board refuses it or is silent.
    """
    _order(target, key)


def clear_board_key(target: str) -> None:
    """Erase the key of the board; returns when it is gone from its storage. Raises RigFault."""
    _order(target, None)


def _order(target: str, key: Key | None) -> None:
    rig = SerialRig(*parse_target(target), None, signed=False)
    try:
        stream = _BareStream(rig.stream, key)
        link = BoardLink(stream)
        message = dialect.MAVLink_setup_signing_message(
            BOARD_SYSTEM, BOARD_COMPONENT, list(key.secret if key else bytes(KEY_BYTES)),
            stamp_at(time.time_ns()) if key else 0,
        )  # fmt: skip
        end_s, due_s = rig.now_s() + _MOST_S, 0.0
        while rig.now_s() < end_s:
            rig.wait(rig.now_s() + 0.05)
            link.poll(rig.now_s())
            if _is_done(link, stream, _STORED if key else _ERASED):
                return
            if rig.now_s() >= due_s and link.heartbeats > 0:
                link.send(message)
                due_s = rig.now_s() + _REPEAT_S
        raise RigFault(f"board: {_why_not(link)}")
    finally:
        rig.close()


def _is_done(link: BoardLink, stream: _BareStream, text: str) -> bool:
    """Say whether the order is carried out; raises RigFault where it is refused."""
    for said in link.texts:
        if said.text.startswith(_REFUSED):
            raise RigFault(f"board: {said.text}")
    if any(said.text == text for said in link.texts):
        return True
    return stream.as_wanted >= _SURE_FRAMES and link.heartbeats > 1


def _why_not(link: BoardLink) -> str:
    if not link.heartbeats:
        return f"no heartbeat within {_MOST_S:.0f} s; is this its USB port, and is it powered?"
    return f"does not say that its key is as ordered within {_MOST_S:.0f} s; is its firmware this version's?"
