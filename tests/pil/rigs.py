"""A rig with the firmware's ELF in it, driven without an outer loop."""

from __future__ import annotations

from typing import Any

import pytest

from hil.config.camera import CameraConfig
from hil.config.events import Fault
from hil.config.link import LinkConfig
from hil.core.rig import ByteStream
from hil.core.types import Pose
from hil.wire.link import BoardLink, WheelReport
from sim_twin.pil import Pil, pil_is_missing
from sim_twin.twin import HOST_START_S, TwinSetup
from tests.twin.rigs import Drive, robot

# Nothing behind the serial port: for tests of the board, not of the radio.
WIRE = LinkConfig(latency_s=0.0, latency_jitter_s=0.0)
# The board is up 35 ms after power-up; bytes sent before that are lost, on the robot too.
BOOT_S = 0.1


needs_toolchain = pytest.mark.skipif(bool(pil_is_missing()), reason=pil_is_missing())


class Tap:
    """A byte stream that keeps what the host writes."""

    def __init__(self, stream: ByteStream) -> None:
        self._stream = stream
        self.written = b""

    def read(self) -> bytes:
        """Read through."""
        return self._stream.read()

    def write(self, data: bytes) -> None:
        """Keep and pass on."""
        self.written += data
        self._stream.write(data)


class PilDrive(Drive):
    """The twin's test drive with the processor for a board, powered up and ready to talk."""

    def __init__(
        self,
        *,
        link: LinkConfig = WIRE,
        faults: tuple[Fault, ...] = (),
        board_clock_ppm: float = 0.0,
        **board: Any,
    ) -> None:
        setup = TwinSetup(
            robot(board_clock_ppm=board_clock_ppm),
            link,
            CameraConfig(),
            Pose(0.0, 0.0, 0.0),
            1,
            faults=faults,
        )
        self.twin: Pil = Pil(setup, **board)
        self.board = self.twin.board
        self.link = BoardLink(self.twin.stream)
        self.reports: list[WheelReport] = []
        self._until(HOST_START_S + BOOT_S)

    def wait(self, seconds: float) -> None:
        """Listen for a while without sending set-points."""
        self._until(self.twin.now_s() + seconds)

    @property
    def duties(self) -> tuple[float, float]:
        """Share of the battery voltage on the motors now, left and right."""
        return self.board.duty(0), self.board.duty(1)

    @property
    def texts(self) -> list[str]:
        """What the board has said."""
        return [text.text for text in self.link.texts]
