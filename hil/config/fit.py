"""Values that are allowed one by one and cannot work together: refused before anything moves."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from hil.board._firmware import ENCODER_COUNTS_1_S
from hil.board.wheel_laws import WHEEL_LAWS
from hil.config.limits import board_defaults, board_table
from hil.config.mismatch import true_robot
from hil.core.errors import BadInput
from hil.core.newest import of_newest

if TYPE_CHECKING:
    from hil.config.scenario import Scenario

# Share of the board's time-out that one period of set-points may take; the rest is for delays that
# vary and for the board's own tick.
_PERIOD_SHARE = 0.8


@of_newest
def check_fit(scenario: Scenario) -> None:
    """Raise BadInput where values that are allowed one by one cannot work together."""
    board = board_defaults() | scenario.board
    _check_counts(scenario, board)
    _check_board_pairs(scenario, board)
    _check_battery(scenario, board)
    true_robot(scenario)  # the mismatch names numbers of the robot and keeps them in their bounds


def board_parameters(scenario: Scenario, inner: str) -> dict[str, float]:
    """Return every board parameter as this run needs it; raises BadInput where the board cannot count."""
    parameters = scenario.board | {
        "ENC_COUNTS": float(scenario.robot.encoder_counts_per_turn),
        "LAW": WHEEL_LAWS[inner],
    }
    _check_counts(scenario, board_defaults() | parameters)
    return parameters


def _check_counts(scenario: Scenario, board: Mapping[str, float]) -> None:
    counts = scenario.robot.encoder_counts_per_turn
    stated, default = board["ENC_COUNTS"], board_table()["ENC_COUNTS"].default
    if stated not in {float(counts), default}:
        raise BadInput(
            f"board.ENC_COUNTS = {stated:g} counts/turn: the robot has "
            f"robot.encoder_counts_per_turn = {counts}, which the board is given; change that one"
        )
    fastest_rad_s = ENCODER_COUNTS_1_S * math.tau / counts
    if board["OVER_W"] > fastest_rad_s:
        raise BadInput(
            f"robot.encoder_counts_per_turn = {counts} counts/turn: the board counts up to "
            f"{ENCODER_COUNTS_1_S:.0f} counts/s, at most {_below(fastest_rad_s):g} rad/s; board.OVER_W = "
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
