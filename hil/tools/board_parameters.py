"""Reads, sets, stores and compares the parameters of a board on a port."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from hil.config.limits import check_board, check_edges
from hil.core.errors import BadInput
from hil.core.files import read_toml, replace_file
from hil.rigs.serial import SerialRig, parse_target
from hil.wire import handshake
from hil.wire.link import BoardLink


@dataclass(frozen=True, slots=True)
class Difference:
    """A parameter that is not as the file says; None stands for missing."""

    name: str
    board: float | None
    file: float | None


class Board:
    """A board that has been brought up; `parameters` are its own account of itself."""

    def __init__(self, rig: SerialRig) -> None:
        self._rig = rig
        self._link = BoardLink(rig.stream)
        handshake.finish(self._link, rig, handshake.connect(self._link, {}))

    @property
    def parameters(self) -> dict[str, float]:
        """Return name and value of every parameter, in the board's order."""
        return dict(self._link.parameters)

    def set(self, values: Mapping[str, float]) -> None:
        """Set parameters; raises BadInput before anything is sent, RigFault when refused."""
        check_board(values)
        check_edges(self.parameters | dict(values))
        for name, value in values.items():
            handshake.finish(
                self._link, self._rig, handshake.set_parameter(self._link, name, value)
            )

    def store(self) -> None:
        """Keep the parameters in force in the EEPROM; returns when the last byte is written."""
        handshake.finish(self._link, self._rig, handshake.store(self._link))


@contextmanager
def open_board(target: str) -> Iterator[Board]:
    """Open the board on `serial:DEV[@BAUD]`, or DEV alone; raises RigFault when it is silent."""
    rig = SerialRig(*parse_target(target), None)
    try:
        yield Board(rig)
    finally:
        rig.close()


def write_file(path: Path, parameters: Mapping[str, float]) -> None:
    """Write parameters as the [board] table of a scenario file."""
    lines = ["[board]", *(f"{name} = {value!r}" for name, value in parameters.items())]
    replace_file(path, ("\n".join(lines) + "\n").encode())


def read_file(path: Path) -> dict[str, float]:
    """Return the [board] table of a file; raises BadInput."""
    table = read_toml(path, "parameter file").get("board")
    if not isinstance(table, dict) or not all(
        isinstance(value, int | float) for value in table.values()
    ):
        raise BadInput(f"{path}: has no table [board] of NAME = number")
    try:
        values = {name: float(value) for name, value in table.items()}
    except OverflowError:  # TOML's integers have no end
        raise BadInput(f"{path}: [board] has a number beyond what any parameter takes") from None
    check_board(values)
    return values


def compare(board: Mapping[str, float], file: Mapping[str, float]) -> list[Difference]:
    """Return what differs by more than the rounding of a 32-bit float."""
    return [
        Difference(name, board.get(name), file.get(name))
        for name in dict.fromkeys([*board, *file])
        if name not in board
        or name not in file
        or abs(board[name] - file[name]) > 1e-6 * max(1.0, abs(file[name]))
    ]
