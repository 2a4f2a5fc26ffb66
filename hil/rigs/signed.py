"""A byte stream to a board with a signing key: what is sent is signed, what comes is checked.

It stands right at the port, below the tape: a record holds what was found good, without signatures, and its
replay needs no key.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from hil.core.errors import RigFault
from hil.core.rig import PORT_BYTES, ByteStream, PortStream, RigAround, discard_unsent
from hil.wire.signing import FrameChecker, FrameSigner, Key, stamp_at

if TYPE_CHECKING:
    from collections.abc import Callable

    from hil.core.rig import Rig

# A board that has said this many frames, a second's, and none of them good, will say none.
_DOUBT_FRAMES = 50


def _stamp_now() -> int:
    return stamp_at(time.time_ns())


class SignedStream:
    """Signs and checks the frames of a byte stream; `stamp_now` is the clock of the time stamps.

    `read` raises RigFault where the board has another key, or none. Once a good frame was heard, those
    that are not are left out and counted (`counts`), and can end nothing.
    """

    def __init__(
        self, stream: ByteStream, key: Key, stamp_now: Callable[[], int] = _stamp_now
    ) -> None:
        self._stream = stream
        self._key = key
        self._stamp_now = stamp_now
        self._signer = FrameSigner(key)
        self._signer.stamp = stamp_now()
        self._checker = FrameChecker(key, self._signer)
        self.counts = self._checker.counts

    def read(self) -> bytes:
        """Return the good frames that have arrived by now, without their signatures."""
        data = self._stream.read()
        if not data:
            return b""
        good = self._checker.feed(data)
        if not self.counts.good and self.counts.refused >= _DOUBT_FRAMES:
            raise RigFault(self._what_is_wrong())
        return good

    def write(self, data: bytes) -> None:
        """Send one frame, signed."""
        self._stream.write(self._signer.sign(data, self._stamp_now()))

    def room_bytes(self) -> int:
        """Return how many bytes `write` takes now."""
        inner = self._stream
        return inner.room_bytes() if isinstance(inner, PortStream) else PORT_BYTES

    def discard_unsent(self) -> None:
        """Let the stream forget what it still holds."""
        discard_unsent(self._stream)

    def _what_is_wrong(self) -> str:
        name = self._key.name
        if self.counts.unsigned:
            said = f" (it says: {self._checker.said})" if self._checker.said else ""
            return (
                f"board: does not sign, so it has no key, and this host has {name}{said}; set it on the "
                f"board over USB (hil firmware key set {name} --on PORT), or leave the key out"
            )
        if self.counts.old:
            return (
                f"board: its time stamps are {name}'s, but old; is this machine's clock ahead, "
                "or is this a recording?"
            )
        return (
            f"board: signs with another key than {name}; name the file of the one that was set on it, or "
            f"set this one over USB (hil firmware key set {name} --on PORT)"
        )


class SignedRig(RigAround):
    """A rig whose board has a key; otherwise it is the rig itself."""

    def __init__(self, rig: Rig, key: Key) -> None:
        super().__init__(rig)
        self.stream = SignedStream(rig.stream, key)
