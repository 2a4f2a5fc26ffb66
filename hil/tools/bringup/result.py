"""What bring-up says: one line a check, the faults by name, and what was measured."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

Side = Literal["left", "right"]
State = Literal["ok", "fail", "note", "skipped"]
# (left, right), None for a side that was left out.
Pair = tuple[float | None, float | None]
SIDES: tuple[Side, Side] = ("left", "right")


def other(side: Side) -> Side:
    """Return the side across."""
    return "right" if side == "left" else "left"


@dataclass(frozen=True, slots=True)
class Check:
    """One line: what was checked, how it came out with its figures, and what to do about it.

    `fault` is the fault's name when there is one ("swapped_phases", "link_latency", ...).
    """

    name: str
    state: State
    text: str
    remedy: str = ""
    fault: str = ""


@dataclass(slots=True)
class Measured:
    """What bring-up measured; None where it did not come to it. Tuples are (left, right).

    Dead duties and speeds are magnitudes; backward ones were measured backward.
    """

    battery_v: float | None = None
    counts_per_turn: Pair | None = None
    turns: float = 0.0
    dead_duty_forward: Pair | None = None
    dead_duty_backward: Pair | None = None
    top_speed_forward_rad_s: Pair | None = None
    top_speed_backward_rad_s: Pair | None = None
    top_speed_battery_v: float | None = None
    round_trip_median_s: float | None = None
    round_trip_p99_s: float | None = None


@dataclass(slots=True)
class Report:
    """Every check in the order it was made, and the measurements."""

    checks: list[Check] = field(default_factory=list)
    measured: Measured = field(default_factory=Measured)

    @property
    def passed(self) -> bool:
        """True when nothing failed and nothing was left out because of a failure."""
        return not any(check.state == "fail" for check in self.checks)

    @property
    def faults(self) -> list[tuple[str, str]]:
        """Return (check, fault) of every fault found."""
        return [(check.name, check.fault) for check in self.checks if check.fault]

    def to_json(self) -> dict[str, Any]:
        """Return what `--json` says."""
        measured = {
            name: value
            for name in Measured.__slots__
            if (value := getattr(self.measured, name)) is not None
        }
        return {
            "passed": self.passed,
            "checks": [
                {name: getattr(check, name) for name in Check.__slots__} for check in self.checks
            ],
            "measured": measured,
        }
