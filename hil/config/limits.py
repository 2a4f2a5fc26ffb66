"""Limits that must fit together: of the host's loop, the robot's geometry and the board's parameters.

The board's bounds come from its own table (firmware_arduino/src/core/params.def, compiled in), so
none is stated twice. What cannot fit is refused before anything moves; what the host can ask beyond
the board's bound on wheel speed is scaled to it (`hil.control.laws.within`).
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from functools import cache

from hil.board._firmware import ENCODER_COUNTS_1_S, Parameter, parameter_table
from hil.core.errors import BadInput


@cache
def board_table() -> Mapping[str, Parameter]:
    """Return every parameter of the board by its name, in the board's order."""
    return {entry.name: entry for entry in parameter_table()}


def board_defaults() -> dict[str, float]:
    """Return every parameter of the board with the default its firmware has."""
    return {name: entry.default for name, entry in board_table().items()}


def check_board(values: Mapping[str, float]) -> None:
    """Raise BadInput for a board parameter that does not exist or lies outside its bounds."""
    table = board_table()
    for name, value in values.items():
        entry = table.get(name)
        if entry is None:
            near = difflib.get_close_matches(name, table, n=3, cutoff=0.5) or list(table)
            raise BadInput(f"board.{name}: no such parameter of the board; near: {', '.join(near)}")
        if not entry.minimum <= value <= entry.maximum:
            raise BadInput(
                f"board.{name} = {value:g} {entry.unit}: allowed are {entry.minimum:g} to "
                f"{entry.maximum:g} {entry.unit}".rstrip()
            )


def wheel_speed_max_rad_s(board: Mapping[str, float]) -> float:
    """Return the largest wheel speed that the board accepts as a set-point."""
    return board.get("W_MAX", board_table()["W_MAX"].default)


def check_edges(values: Mapping[str, float]) -> None:
    """Raise BadInput when the encoders may give more counts than the board can count.

    `values` are a board's parameters, whole; the board refuses to arm with such a set too.
    """
    counts_1_s = values["ENC_COUNTS"] * values["OVER_W"] / math.tau
    if counts_1_s > ENCODER_COUNTS_1_S:
        raise BadInput(
            f"ENC_COUNTS = {values['ENC_COUNTS']:g} counts/turn at OVER_W = {values['OVER_W']:g} rad/s "
            f"makes {counts_1_s:.0f} counts/s: the board counts up to {ENCODER_COUNTS_1_S:.0f} counts/s; "
            "lower OVER_W (and W_MAX), or take an encoder with fewer counts a turn"
        )
