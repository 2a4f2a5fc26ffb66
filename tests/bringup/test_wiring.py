"""What moved, against what was driven and what was seen: the rows the twin does not plant."""

from __future__ import annotations

import pytest

from hil.tools.bringup.result import Check
from hil.tools.bringup.wiring import Moved, Seen, judge


def faults(checks: list[Check]) -> list[tuple[str, str]]:
    """Return (check, fault) of the checks that failed."""
    return [(check.name, check.fault) for check in checks if check.state == "fail"]


@pytest.mark.parametrize(
    ("moved", "seen", "expected"),
    [
        # Two faults on one side hide each other from the counts, not from the eye.
        (
            Moved(1500, 0),
            Seen("left", forward=False),
            [("left motor", "motor_reversed"), ("left encoder", "swapped_phases")],
        ),
        (Moved(1500, 1400), Seen("left"), [("left motor", "both_sides_move")]),
        (
            Moved(300, 0),
            Seen(None),
            [("left motor", "motor_stuck"), ("left encoder", "encoder_noise")],
        ),
        # Exchanged and reversed: the wheels across turn backward, their own encoder is right.
        (Moved(0, -1500), Seen("right", forward=False), [("left motor", "motors_exchanged")]),
        (Moved(39, 0, 39), Seen("left"), [("left encoder", "dead_channel")]),
        (Moved(40, 0), Seen("left"), []),
        (Moved(1, 0, 1), Seen("left"), [("left encoder", "dead_encoder")]),
    ],
)
def test_every_row_has_its_name(moved: Moved, seen: Seen, expected: list[tuple[str, str]]):
    """Driving left forward: counts moved and wheels seen give the faults by name."""
    assert faults(judge("left", moved, seen)) == expected
