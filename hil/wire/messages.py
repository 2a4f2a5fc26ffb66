"""What is said to the board, as messages: one place for how parameters and arming are written."""

from __future__ import annotations

from typing import Any

from hil.wire import dialect
from hil.wire.framing import BOARD_COMPONENT, BOARD_SYSTEM


def set_parameter_message(name: str, value: float) -> dialect.MAVLink_message:
    """Return the message that sets a parameter of the board."""
    return dialect.MAVLink_param_set_message(
        BOARD_SYSTEM, BOARD_COMPONENT, name.encode(), value, dialect.MAV_PARAM_TYPE_REAL32
    )


def command_message(command: int, *params: float, confirmation: int = 0) -> dialect.MAVLink_message:
    """Return a COMMAND_LONG to the board; parameters not given are 0."""
    seven = (*params, *(0.0,) * (7 - len(params)))
    return dialect.MAVLink_command_long_message(
        BOARD_SYSTEM, BOARD_COMPONENT, command, confirmation, *seven
    )


def arming_params(dialect_hash: int, parameter_hash: int) -> tuple[float, ...]:
    """Return the parameters of the command that arms: 1, 0, then both hashes in halves of 16 bits.

    A half is exact as a float32; 32 bits are not.
    """
    halves = (
        float(half) for value in (dialect_hash, parameter_hash) for half in divmod(value, 1 << 16)
    )
    return (1.0, 0.0, *halves)


def arming_message(dialect_hash: int, parameter_hash: int) -> dialect.MAVLink_message:
    """Return the message that arms a board that has these hashes."""
    return command_message(
        dialect.MAV_CMD_COMPONENT_ARM_DISARM, *arming_params(dialect_hash, parameter_hash)
    )


def is_arming(command: Any) -> bool:
    """Say whether a COMMAND_LONG asks the board to arm."""
    return bool(command.command == dialect.MAV_CMD_COMPONENT_ARM_DISARM and command.param1 == 1.0)
