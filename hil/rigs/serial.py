"""The target `serial:DEV[@BAUD]`: a real board on a port, a real camera, the wall clock."""

from __future__ import annotations

import contextlib
import errno
import math
import os
import re
import select
import time

import serial

from hil.config.link import UART_BAUD
from hil.core.errors import BadInput, RigFault
from hil.core.rig import PORT_BYTES, ByteStream, Frame, LineBacklog, Truth
from hil.rigs.frames import FrameSource
from hil.rigs.key_file import key_of_environment
from hil.rigs.signed import SignedStream
from hil.wire.signing import Key

try:
    from termios import error as termios_error
except ImportError:  # Windows has none
    termios_error = OSError  # type: ignore[misc,assignment]

# Where select cannot wait for a port (Windows), it is looked at this often.
_POLL_S = 0.001


def parse_target(text: str) -> tuple[str, int]:
    """Return device and baud rate of `serial:DEV[@BAUD]`; raises BadInput."""
    device, at, baud_text = text.removeprefix("serial:").rpartition("@")
    if not at:
        device, baud_text = baud_text, str(UART_BAUD)
    if not device:
        raise BadInput(
            f"target {text!r}: names no port; for example serial:/dev/ttyUSB0@{UART_BAUD}"
        )
    if not baud_text.isdigit() or not 1_200 <= int(baud_text) <= 2_000_000:
        raise BadInput(f"target {text!r}: baud rate {baud_text!r} is not in 1200 to 2000000 bit/s")
    return device, int(baud_text)


class SerialStream:
    """Bytes to and from a serial port (or a pseudo-terminal); never blocks for long."""

    def __init__(self, device: str, baud: int) -> None:
        self.device = device
        self._backlog = LineBacklog(baud)
        try:
            self.port = serial.Serial(device, baud, timeout=0, write_timeout=0.2, exclusive=True)
        except (serial.SerialException, OSError, ValueError) as error:
            raise RigFault(f"port {device}: {_reason(error)}") from None

    def read(self) -> bytes:
        """Return every byte that has arrived by now; raises RigFault when the port is gone."""
        try:
            return bytes(self.port.read(4096))
        except (serial.SerialException, OSError, TypeError) as error:
            raise RigFault(f"port {self.device}: {_reason(error)}") from None

    def write(self, data: bytes) -> None:
        """Send the bytes; raises RigFault when the port is gone, full, or takes none for 0.2 s."""
        try:
            self._backlog.write(time.monotonic(), len(data))
            self.port.write(data)
        except RigFault as error:
            raise RigFault(f"port {self.device}: {error}") from None
        except (serial.SerialException, OSError) as error:
            raise RigFault(f"port {self.device}: {_reason(error)}") from None

    def room_bytes(self) -> int:
        """Return how many bytes `write` takes now."""
        return max(PORT_BYTES - math.ceil(self._backlog.waiting_bytes(time.monotonic())), 0)

    def discard_unsent(self) -> None:
        """Forget what has been written and not sent yet."""
        self._backlog.clear()
        with contextlib.suppress(serial.SerialException, OSError, termios_error):
            self.port.reset_output_buffer()

    def discard_received(self) -> None:
        """Forget what has arrived and was not read."""
        with contextlib.suppress(serial.SerialException, OSError, termios_error):
            self.port.reset_input_buffer()

    def close(self) -> None:
        """Release the port; safe to call twice."""
        self.port.close()


_REASONS = {
    errno.ENOENT: "no such port; `hil doctor` lists the ports",
    errno.EACCES: "no permission; add yourself to the group dialout and log in again",
    errno.EPERM: "no permission; add yourself to the group dialout and log in again",
    errno.EBUSY: "in use by another program; close it first",
    errno.EAGAIN: "in use by another program; close it first",
    errno.EISDIR: "not a serial port; `hil doctor` lists the ports",
    errno.ENOTTY: "not a serial port; `hil doctor` lists the ports",
    errno.EIO: "gone while in use; was it unplugged or switched off?",
    errno.ENXIO: "gone while in use; was it unplugged or switched off?",
}


def _reason(error: Exception) -> str:
    """Return one line that says what is wrong with a port and what to try."""
    if isinstance(error, serial.SerialTimeoutException):
        return "takes no bytes for 0.2 s; is the board powered and the link up?"
    text = " ".join(str(error).split())
    number = getattr(error, "errno", None)
    if number is None:  # pyserial often has it in the text only
        found = re.search(r"(?:Errno |\()(\d+)", text)
        number = int(found.group(1)) if found else None
    if "disconnected" in text or isinstance(error, TypeError):
        number = errno.EIO
    return _REASONS.get(number, text) if number is not None else text


class SerialRig:
    """A robot on a serial port and its camera, in real time; nobody knows its true pose.

    `key` is the board's; without one it is that of the environment. Where there is none, or not `signed`,
    bytes pass as they are.
    """

    def __init__(
        self,
        device: str,
        baud: int,
        camera: FrameSource | None,
        key: Key | None = None,
        *,
        signed: bool = True,
    ) -> None:
        key = (key or key_of_environment()) if signed else None
        self._port = SerialStream(device, baud)
        self.stream: ByteStream = SignedStream(self._port, key) if key else self._port
        self._camera = camera

    def watch_by(self, camera: FrameSource) -> None:
        """Take the camera; what the board said while it was opened is dropped, for it is not of now."""
        self._camera = camera
        self._port.discard_received()

    def now_s(self) -> float:
        """Return the monotonic clock of this machine."""
        return time.monotonic()

    def wait(self, until_s: float) -> None:
        """Return at `until_s`, or earlier as soon as bytes or a frame have arrived."""
        remaining_s = until_s - time.monotonic()
        if remaining_s <= 0.0:
            return
        if os.name == "posix":
            sources = [self._port.port.fileno()]
            if self._camera is not None:
                sources.append(self._camera.fileno())
            select.select(sources, [], [], remaining_s)
            return
        while time.monotonic() < until_s and not self._port.port.in_waiting:
            time.sleep(_POLL_S)

    def poll_frame(self) -> Frame | None:
        """Return the oldest frame waiting; None when there is none, or no camera."""
        return self._camera.poll() if self._camera is not None else None

    def begin(self, t_start_s: float) -> None:
        """Do nothing: nobody disturbs a real robot on a schedule."""

    def truth(self) -> Truth | None:
        """Return None: a camera's word is all there is."""
        return None

    def close(self) -> None:
        """Release port and camera; safe to call twice."""
        self._port.close()
        if self._camera is not None:
            self._camera.close()
