"""The twin served in real time: its link on a pseudo-terminal, its camera on a Unix socket.

Any program meets the pseudo-terminal as it would meet the board's port (radio included), and
whoever opens the socket gets every camera frame from then on, in the form of
`hil.rigs.frames.encode_frame`. The twin's own virtual clock is only told to follow this
machine's.
"""

from __future__ import annotations

import contextlib
import os
import selectors
import socket
import time
import tty
from collections import deque
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from hil.core.errors import BadInput
from hil.core.rig import PORT_BYTES, PortStream
from hil.rigs.frames import encode_frame
from hil.tools.serve_names import PortName, bind_socket, release_socket
from hil.wire import dialect
from hil.wire.framing import FrameReader
from hil.wire.signing import FrameCutter

if TYPE_CHECKING:
    from hil.core.rig import Frame, Rig

# The twin's events are looked for this often; bytes and frames are late by no more.
_STEP_S = 0.001
# A server that was held up by more than this does not make up for it: the host's bytes carry no times, and
# those that waited would all come at the start of the time that was missed. A frame drawn late is not it.
_SLIP_S = 0.1
# Frames kept for a client that reads slowly; beyond that the oldest are dropped, as by a camera.
_BACKLOG_FRAMES = 4


class PseudoTerminal:
    """The board's port: a raw pseudo-terminal with a stable name."""

    def __init__(self, link: Path) -> None:
        self._master, self._slave = os.openpty()  # the slave stays open, or a hang-up ends it all
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        try:
            self._name = PortName(link, os.ttyname(self._slave))
        except BadInput:
            self._close_ends()
            raise

    def fileno(self) -> int:
        """Return the descriptor that is readable when the host has sent bytes."""
        return self._master

    def read(self, limit: int) -> bytes:
        """Return up to `limit` bytes of what the host has sent, b"" if nothing."""
        try:
            return os.read(self._master, limit)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> None:
        """Hand bytes to the host; what nobody reads is lost, as on the air."""
        with contextlib.suppress(BlockingIOError):
            os.write(self._master, data)

    def close(self) -> None:
        """Remove the name and close both ends."""
        self._name.release()
        self._close_ends()

    def _close_ends(self) -> None:
        os.close(self._master)
        os.close(self._slave)


class FrameServer:
    """The camera: a listening Unix socket, and what is still to be sent to each client."""

    def __init__(self, path: Path, selector: selectors.BaseSelector) -> None:
        self._path = path
        self._selector = selector
        self._clients: dict[socket.socket, deque[memoryview]] = {}
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._identity = bind_socket(self._listener, path)
        except BadInput:
            self._listener.close()
            raise
        self._listener.listen()
        self._listener.setblocking(False)
        selector.register(self._listener, selectors.EVENT_READ, self._accept)

    @property
    def wanted(self) -> bool:
        """True while somebody looks at the camera."""
        return bool(self._clients)

    def _accept(self) -> None:
        client, _ = self._listener.accept()
        client.setblocking(False)
        self._clients[client] = deque()

    def send(self, frame: bytes) -> None:
        """Queue one frame for every client; a client that lags keeps the newest frames only."""
        for queue in self._clients.values():
            # The head may be half sent and must stay.
            while len(queue) > _BACKLOG_FRAMES:
                del queue[1]
            queue.append(memoryview(frame))

    def flush(self) -> None:
        """Send what the sockets take now; forget clients that have gone."""
        for client, queue in list(self._clients.items()):
            try:
                while queue:
                    sent = client.send(queue[0])
                    if sent < len(queue[0]):
                        queue[0] = queue[0][sent:]
                    else:
                        queue.popleft()
            except BlockingIOError:
                continue
            except OSError:
                client.close()
                del self._clients[client]

    def close(self) -> None:
        """Close every socket and remove the path."""
        self._selector.unregister(self._listener)
        for client in (*self._clients, self._listener):
            client.close()
        release_socket(self._path, self._identity)


@dataclass(slots=True)
class FollowedClock:
    """The twin's time, which follows this machine's and stands still while the server is held up for long.

    `ahead_s` is the twin's time less this machine's, `worst_lag_s` the most the twin was behind,
    `slipped_s` what it was put back for good.
    """

    ahead_s: float
    worst_lag_s: float = 0.0
    slipped_s: float = 0.0

    def follow(self, now_s: float, rig_s: float) -> float:
        """Return the time to which the twin is to move from `rig_s`, at `now_s` on this machine."""
        lag_s = now_s + self.ahead_s - rig_s
        self.worst_lag_s = max(self.worst_lag_s, lag_s)
        if lag_s > _SLIP_S:
            self.ahead_s -= lag_s - _STEP_S
            self.slipped_s += lag_s - _STEP_S
        return now_s + self.ahead_s

    def stamped(self, frame: Frame) -> Frame:
        """Return a frame as a camera stamps it whose clock went on meanwhile.

        Without, frames would look late by what was missed: nothing in their times tells a clock that
        stood still from frames held up, and those keep the dates they have.
        """
        return replace(frame, t_cam_s=frame.t_cam_s + self.slipped_s) if self.slipped_s else frame


class TwinServer:
    """Lets a simulated rig follow this machine's clock and passes its bytes and frames on."""

    def __init__(self, rig: Rig, pty: Path, frames: Path) -> None:
        self._rig = rig
        self._selector = selectors.DefaultSelector()
        self.port = PseudoTerminal(pty)
        try:
            self._camera = FrameServer(frames, self._selector)
        except BadInput:
            self.port.close()
            raise
        self._listening = False
        self._cutter = FrameCutter()
        self._watcher = FrameReader()
        self._armed = False
        self._clock = FollowedClock(rig.now_s() - time.monotonic())

    @property
    def worst_lag_s(self) -> float:
        """The most the twin was behind."""
        return self._clock.worst_lag_s

    @property
    def slipped_s(self) -> float:
        """What the twin's clock was put back for good."""
        return self._clock.slipped_s

    def run(self, until_s: float) -> None:
        """Serve until this machine's monotonic clock shows `until_s`."""
        self._clock.ahead_s = self._rig.now_s() - time.monotonic()
        while (now_s := time.monotonic()) < until_s:
            self._follow(self._clock.follow(now_s, self._rig.now_s()))
            self._listen()
            for key, _ in self._selector.select(_STEP_S):
                key.data()

    def _follow(self, t_s: float) -> None:
        """Let the twin's time pass to `t_s` and hand out what it has sent by then."""
        while self._rig.now_s() < t_s:
            self._rig.wait(t_s)
            if data := self._rig.stream.read():
                self._watch(data)
                self.port.write(data)
            while (frame := self._rig.poll_frame()) is not None:
                if self._camera.wanted:
                    self._camera.send(encode_frame(self._clock.stamped(frame)))
        self._camera.flush()

    def _room_bytes(self) -> int:
        stream = self._rig.stream
        return stream.room_bytes() if isinstance(stream, PortStream) else PORT_BYTES

    def _listen(self) -> None:
        """Listen to the host while the line has room; without, the pseudo-terminal fills and blocks."""
        room = self._room_bytes() > 0
        if room == self._listening:
            return
        self._listening = room
        if room:
            self._selector.register(self.port, selectors.EVENT_READ, self._from_host)
        else:
            self._selector.unregister(self.port)

    def _from_host(self) -> None:
        if data := self.port.read(self._room_bytes()):
            self._rig.stream.write(data)

    def _watch(self, data: bytes) -> None:
        """Let the scenario's timed events begin when the board is armed."""
        bare = b"".join(cut.frame for cut in self._cutter.feed(data))
        for msg_id, message, _ in self._watcher.feed(bare):
            if msg_id == dialect.MAVLINK_MSG_ID_WHEEL_STATE:
                armed = message.state == dialect.HIL_STATE_ARMED
                if armed and not self._armed:
                    self._rig.begin(self._rig.now_s())
                self._armed = armed

    def close(self) -> None:
        """Remove the pseudo-terminal and the socket."""
        self._camera.close()
        self._selector.close()
        self.port.close()
