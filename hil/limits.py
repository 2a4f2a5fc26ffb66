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
from typing import TYPE_CHECKING

from hil.board._firmware import TICK_US, Parameter, parameter_table
from hil.core.errors import BadInput

if TYPE_CHECKING:
    from hil.config.scenario import Scenario
    from hil.wire.link import StatusText

# Begin of what the board says of a set-point that it does not take (texts.def); as an error where
# the value is at fault, as a warning where one came late or too early.
_REFUSED = "set-point refused"
_SEVERITY_ERROR = 3  # MAV_SEVERITY_ERROR
# Share of the board's time-out that one period of set-points may take; the rest is for delays that
# vary and for the board's own tick.
_PERIOD_SHARE = 0.8
# The encoder's edges of one tick are tallied in a signed byte (firmware_arduino/src/board/encoders.cpp).
_COUNTS_A_TICK = 127
_SAMPLES = 200  # instants at which a reference's speed is looked at


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


def check_fit(scenario: Scenario) -> None:
    """Raise BadInput where values that are allowed one by one cannot work together."""
    from hil.rigs.opening import true_robot  # noqa: PLC0415 - which stands on the configuration

    board = board_defaults() | scenario.board
    true_robot(scenario)  # the mismatch names numbers of the robot and keeps them in their bounds
    check_board(scenario.board)
    _check_counts(scenario, board)
    _check_board_pairs(scenario, board)
    _check_battery(scenario, board)


def _check_counts(scenario: Scenario, board: Mapping[str, float]) -> None:
    counts = scenario.robot.encoder_counts_per_turn
    stated, default = board["ENC_COUNTS"], board_table()["ENC_COUNTS"].default
    if stated not in {float(counts), default}:
        raise BadInput(
            f"board.ENC_COUNTS = {stated:g} counts/turn: the robot has "
            f"robot.encoder_counts_per_turn = {counts}, which the board is given; change that one"
        )
    fastest_rad_s = _COUNTS_A_TICK / (TICK_US * 1e-6) * 2.0 * math.pi / counts
    if board["OVER_W"] > fastest_rad_s:
        raise BadInput(
            f"robot.encoder_counts_per_turn = {counts} counts/turn: the board counts up to "
            f"{_COUNTS_A_TICK} a tick, at most {_below(fastest_rad_s):g} rad/s; board.OVER_W = "
            f"{board['OVER_W']:g} rad/s is above; set it, and W_MAX with it, to that or less"
        )


def _check_board_pairs(scenario: Scenario, board: Mapping[str, float]) -> None:
    if board["W_MAX"] > board["OVER_W"]:
        raise BadInput(
            f"board.W_MAX = {board['W_MAX']:g} rad/s: must be at most OVER_W = {board['OVER_W']:g} "
            "rad/s, the wheel speed at which the board stops the robot"
        )
    if board["ST_VAR"] >= 1.0 and board["ST_LMIN"] > board["ST_L"]:
        raise BadInput(
            f"board.ST_LMIN = {board['ST_LMIN']:g} rad/s^2: must be at most ST_L = "
            f"{board['ST_L']:g} rad/s^2, between which ST_VAR lets the gain vary"
        )
    rate_hz, timeout_ms = scenario.control.rate_hz, board["SP_TIMEOUT"]
    least_hz = 1e3 / (_PERIOD_SHARE * timeout_ms)
    if rate_hz < least_hz * (1.0 - 1e-9):
        raise BadInput(
            f"control.rate_hz = {rate_hz:g} Hz: a set-point every {1e3 / rate_hz:.0f} ms, and the "
            f"board stops the robot {timeout_ms:g} ms after the last one (board.SP_TIMEOUT); at "
            f"least {-_below(-least_hz):g} Hz is needed"
        )


def _check_battery(scenario: Scenario, board: Mapping[str, float]) -> None:
    battery = scenario.robot.battery
    open_v = battery.empty_v + (battery.full_v - battery.empty_v) * battery.charge_start_ratio
    if open_v < board["BATT_LOW"]:
        raise BadInput(
            f"board.BATT_LOW = {board['BATT_LOW']:g} V: robot.battery has {_below(open_v):g} V at its "
            "charge at the start, and the board does not arm below BATT_LOW; set it to this battery"
        )


def _below(value: float) -> float:
    """Return a limit for a message: 2 decimals, never beyond the limit itself."""
    return math.floor(100.0 * value + 1e-6) / 100.0


def wheel_speed_max_rad_s(scenario: Scenario) -> float:
    """Return the largest wheel speed that the board accepts as a set-point."""
    return scenario.board.get("W_MAX", board_table()["W_MAX"].default)


def refused_set_point(text: StatusText) -> str:
    """Return what the board said when it refused the value of a set-point, "" for other texts."""
    refused = text.severity <= _SEVERITY_ERROR and text.text.startswith(_REFUSED)
    return text.text if refused else ""


def notes(scenario: Scenario) -> list[str]:
    """Return what a reader must know before trusting a run's figures: one line each.

    What the reference asks may lie beyond the run's duration or the loop's limits; the run is then
    possible, and its figures say something else than they seem to.
    """
    from hil.control.references import Waypoints, make_reference  # noqa: PLC0415 - numpy

    reference = make_reference(scenario.reference)
    limits, run_s = scenario.control.limits, scenario.duration_s
    found = []
    if isinstance(reference, Waypoints) and reference.duration_s > run_s:
        found.append(
            f"the reference takes {reference.duration_s:.3g} s and the run ends after {run_s:g} s "
            "(duration_s): errors are those of its beginning"
        )
    rates = [reference.at(run_s * k / _SAMPLES).z1_dot_m_s for k in range(_SAMPLES + 1)]
    fastest = max(math.hypot(*rate) for rate in rates)
    most = math.hypot(limits.eta1_max_m_s, scenario.robot.d0_m * limits.theta_dot_max_rad_s)
    if fastest > most:
        found.append(
            f"the reference moves at up to {fastest:.3g} m/s, more than the {most:.3g} m/s that "
            "control.limits allow: it cannot be followed"
        )
    return found
