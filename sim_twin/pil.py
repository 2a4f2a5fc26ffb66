"""Target `pil`: the twin with the firmware's ELF on a simulated ATmega2560 for a board.

Robot, camera, and what lies behind the serial ports are the twin's; the line between port and
processor is the processor's own UART at its own pace.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hil.board.build import Build, build, find_toolchain
from hil.config.link import UART_BAUD
from hil.core.errors import BadInput
from sim_twin.camera_faults import FrameMaker
from sim_twin.twin import Twin, TwinSetup

if TYPE_CHECKING:
    from sim_twin import _pil

PACKAGES = "libsimavr-dev libelf-dev"


def pil_module() -> type[_pil.Board]:
    """Return the simulated board's class; BadInput where the module was not built."""
    try:
        from sim_twin._pil import Board  # noqa: PLC0415 - optional, and only this target needs it
    except ImportError as error:
        raise BadInput(
            f"target pil: sim_twin._pil cannot be loaded ({error}); Debian: apt install {PACKAGES}, "
            "then set the project up again with .ci/setup"
        ) from None
    return Board


def pil_is_missing() -> str:
    """Return what keeps target `pil` from running here and how to get it, "" when nothing does."""
    try:
        find_toolchain()
        pil_module()
    except BadInput as error:
        return str(error)
    return ""


class Pil(Twin):
    """One simulated rig whose board is the firmware itself; `board` gives access to its insides.

    `eeprom` is what the EEPROM holds at first power-up, the rest of it erased; `uart` is the port
    the host is on, "0" for USB and "1" for Bluetooth.
    """

    def __init__(
        self,
        setup: TwinSetup,
        maker: FrameMaker | None = None,
        *,
        firmware: Path | None = None,
        eeprom: bytes = b"",
        uart: str = "1",
    ) -> None:
        if setup.link.baud != UART_BAUD:
            raise BadInput(
                f"link.baud = {setup.link.baud} bit/s: the board's serial ports run at {UART_BAUD} "
                "bit/s and target pil takes them as they are; leave link.baud at its default"
            )
        self.build: Build | None = None if firmware else build()
        elf = firmware if self.build is None else self.build.elf
        self.board = pil_module()(
            str(elf), uart, setup.robot.board_clock_ppm, eeprom or setup.eeprom
        )
        super().__init__(setup, maker, self.board.handle())

    @property
    def true_counts(self) -> tuple[int, int]:
        """Counts the wheels have really turned since power-up, (left, right)."""
        return self._kernel.true_counts
