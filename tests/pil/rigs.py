"""A rig with the firmware's ELF in it, driven without an outer loop."""

from __future__ import annotations

from typing import Any

from hil.config.camera import CameraConfig
from hil.config.events import Fault
from hil.config.link import LinkConfig
from hil.types import Pose
from hil.wire.link import BoardLink, WheelReport
from sim_twin.pil import Pil
from sim_twin.twin import Twin, TwinSetup
from tests.twin.rigs import Drive, robot

# Nothing behind the serial port: for tests of the board, not of the radio.
WIRE = LinkConfig(latency_s=0.0, latency_jitter_s=0.0)


class PilDrive(Drive):
    """The twin's test drive on the processor in the loop, or beside it on the twin."""

    def __init__(
        self, *, link: LinkConfig = WIRE, faults: tuple[Fault, ...] = (), on: type[Twin] = Pil,
        **board: Any,
    ) -> None:  # fmt: skip
        setup = TwinSetup(robot(), link, CameraConfig(), Pose(0.0, 0.0, 0.0), 1, (), faults)
        self.twin = on(setup, **board)
        self.link = BoardLink(self.twin.stream)
        self.reports: list[WheelReport] = []

    @property
    def board(self) -> Any:
        """The simulated board."""
        return self.twin.board  # type: ignore[attr-defined]
