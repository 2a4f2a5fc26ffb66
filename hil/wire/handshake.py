"""Procedures that bring the board up: who it is, its parameters, arming with the hash handshake.

Each is a generator that `BoardLink.poll` moves on; it yields whenever it has to wait. A board that
does not answer, or refuses, ends it with one RigFault.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Generator, Mapping

from hil.core.errors import RigFault
from hil.core.rig import Rig
from hil.wire import dialect, identity
from hil.wire.link import BoardLink, Procedure, enum_name
from hil.wire.messages import arming_params, set_parameter_message

# Opening the port of an Arduino resets it; its boot loader holds it for up to 2 s.
_FIRST_HEARTBEAT_S = 6.0
# Frames of a board that signs, a second's.
_SIGNED_MOST = 50
_REPLY_S = 0.5
_TRIES = 10
# A save takes the board 0.86 s, a byte a tick.
_STORED_S = 2.0
_UNDER_WAY = dialect.MAV_RESULT_IN_PROGRESS
# A PARAM_VALUE takes 6.4 ms at 57,600 baud, and half of the line belongs to the wheel states.
_PARAMETER_PACE_S = 0.02
# The board says at most five texts a second.
_TEXT_S = 0.5
_FLOAT = struct.Struct("<f")


def finish(link: BoardLink, rig: Rig, procedure: Procedure) -> None:
    """Carry the procedure out to its end, letting the rig's time pass. Raises RigFault."""
    link.begin(procedure)
    link.poll(rig.now_s())
    while link.busy:
        rig.wait(rig.now_s() + 0.02)
        link.poll(rig.now_s())


def connect(link: BoardLink, parameters: Mapping[str, float]) -> Procedure:
    """Wait for the board, learn who it is, and make its parameters the ones given.

    Afterwards `link.info` and `link.parameters` are the board's own account of itself. A board
    whose parameter hash is that of `parameters` has them all, and they are not fetched.

    Raises RigFault when none answers, or it speaks another dialect.
    """
    if not (yield from _wait(link, lambda: _hears(link), _FIRST_HEARTBEAT_S)):
        raise RigFault(
            f"board: no heartbeat within {_FIRST_HEARTBEAT_S:.0f} s "
            f"({link.counters.skipped_bytes} bytes that were no frame); is it powered, is the "
            "firmware uploaded, is the baud rate right?"
        )
    yield from read_info(link)
    _check_dialect(link)
    if link.info.parameter_hash == identity.parameter_hash(parameters):
        link.parameters = {name: _float32(value) for name, value in parameters.items()}
        return
    yield from download_parameters(link)
    for name, value in parameters.items():
        yield from set_parameter(link, name, value)
    yield from read_info(link)  # with the parameter hash as it now is


def _hears(link: BoardLink) -> bool:
    """Say whether the board was heard; RigFault where it signs what it says and nothing checks that."""
    if link.heartbeats == 0 and link.counters.signed_frames >= _SIGNED_MOST:
        raise RigFault(
            "board: signs what it says, so it has a key, and this host was given none; name its file: "
            "hil run --key FILE, or HIL_KEY=FILE"
        )
    return link.heartbeats > 0


def _check_dialect(link: BoardLink) -> None:
    own = identity.dialect_hash()
    if link.info.dialect_hash != own:
        raise RigFault(
            f"board: speaks dialect {link.info.dialect_hash:08x}, this host {own:08x}; "
            "upload the firmware of this version (hil firmware upload)"
        )


def read_info(link: BoardLink) -> Procedure:
    """Ask for BOARD_INFO."""
    link.info = None
    wanted = float(dialect.MAVLINK_MSG_ID_BOARD_INFO)
    yield from _ask(
        link,
        lambda count: link.send_command(dialect.MAV_CMD_REQUEST_MESSAGE, count, wanted),
        lambda: link.info is not None,
        "the request for its identity",
    )


def download_parameters(link: BoardLink) -> Procedure:
    """Fetch all parameters by index, paced; those lost on the way are asked for again."""
    link.parameters.clear()
    link.parameter_names.clear()
    yield from _ask_parameter(link, 0)
    for index in range(1, link.parameter_count):
        link.request_parameter(index)
        yield from _wait(link, lambda: False, _PARAMETER_PACE_S)
    yield from _wait(link, lambda: len(link.parameter_names) == link.parameter_count, _REPLY_S)
    for index in range(1, link.parameter_count):
        if index not in link.parameter_names:
            yield from _ask_parameter(link, index)


def _ask_parameter(link: BoardLink, index: int) -> Procedure:
    yield from _ask(
        link,
        lambda _: link.request_parameter(index),
        lambda: index in link.parameter_names,
        f"the request for parameter {index}",
    )


def set_parameter(link: BoardLink, name: str, value: float) -> Procedure:
    """Set one parameter unless the board has it so; RigFault when the board will not take it."""
    wanted = _float32(value)
    if name not in link.parameters:
        raise RigFault(f"board: has no parameter {name!r}; is its firmware another version?")
    if link.parameters[name] == wanted:
        return
    start_s = link.t_s
    link.parameters[name] = math.nan
    message = set_parameter_message(name, value)
    yield from _ask(
        link,
        lambda _: link.send(message),
        lambda: not math.isnan(link.parameters[name]),
        f"setting parameter {name}",
    )
    if link.parameters[name] != wanted:
        why = yield from _explanation(link, start_s)
        raise RigFault(
            f"board: parameter {name} stays at {link.parameters[name]:g} instead of {value:g}{why}"
        )


def arm(link: BoardLink, dialect_hash: int, parameter_hash: int) -> Procedure:
    """Arm: present both hashes as computed on this side; the board compares them with its own.

    Set-points must follow within the board's time-out, or it goes to SAFE.
    """
    yield from _command(
        link,
        "arm",
        dialect.MAV_CMD_COMPONENT_ARM_DISARM,
        *arming_params(dialect_hash, parameter_hash),
    )


def disarm(link: BoardLink) -> Procedure:
    """Disarm: wheels off, state DISARMED."""
    yield from _command(link, "disarm", dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0.0)


def store(link: BoardLink) -> Procedure:
    """Keep the parameters in force in the board's EEPROM; ends when the last byte is written.

    A board that was reset meanwhile has other parameters in force, and stored: RigFault.

    Raises RigFault when the board does not say that it did.
    """
    yield from read_info(link)
    complete = len(link.parameters) == link.parameter_count > 0
    wanted = identity.parameter_hash(link.parameters) if complete else int(link.info.parameter_hash)
    yield from _command(link, "store", dialect.MAV_CMD_PREFLIGHT_STORAGE, 1.0, reply_s=_STORED_S)
    yield from read_info(link)
    if link.info.parameter_hash != wanted:
        raise RigFault(
            "board: was reset before its parameters were stored, and has others in force now; "
            "set and store them again"
        )


def _wait(
    link: BoardLink, done: Callable[[], bool], timeout_s: float
) -> Generator[float, None, bool]:
    """Wait until `done`, which looks at nothing but what the board said; return whether it came in time."""
    end_s = link.t_s + timeout_s
    while not done():
        if link.t_s >= end_s:
            return False
        yield end_s
    return True


def _ask(
    link: BoardLink,
    send: Callable[[int], None],
    done: Callable[[], bool],
    what: str,
    reply_s: float = _REPLY_S,
) -> Procedure:
    """Send (with the count of tries so far) until `done`; RigFault after the last try."""
    for count in range(_TRIES):
        send(count)
        if (yield from _wait(link, done, reply_s)):
            return
    raise RigFault(
        f"board: no answer to {what} within {_TRIES * reply_s:.0f} s "
        f"({link.loss_ratio:.0%} of its frames lost); check range and power"
    )


def _command(
    link: BoardLink, what: str, command: int, *params: float, reply_s: float = _REPLY_S
) -> Procedure:
    start_s = link.t_s
    link.acks.pop(command, None)
    yield from _ask(
        link,
        lambda count: link.send_command(command, count, *params),
        lambda: link.acks.get(command, _UNDER_WAY) != _UNDER_WAY,
        f"the command to {what}",
        reply_s,
    )
    result = link.acks[command]
    if result != dialect.MAV_RESULT_ACCEPTED:
        why = yield from _explanation(link, start_s)
        raise RigFault(f"board: refuses to {what} ({enum_name('MAV_RESULT', result)}){why}")


def _explanation(link: BoardLink, start_s: float) -> Generator[float, None, str]:
    """Wait for what the board says about a refusal after `start_s`; return it, or nothing."""
    yield from _wait(link, lambda: bool(link.texts) and link.texts[-1].t_host_s > start_s, _TEXT_S)
    return f": {link.texts[-1].text}" if link.texts else ""


def _float32(value: float) -> float:
    """Return the value as the board holds it."""
    (rounded,) = _FLOAT.unpack(_FLOAT.pack(value))
    return float(rounded)
