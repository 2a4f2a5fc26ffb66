"""A twin on blocks, and somebody who looks at its wheels."""

from __future__ import annotations

import math
from typing import Any

from hil.config.camera import CameraConfig
from hil.config.events import Fault
from hil.config.link import LinkConfig
from hil.core.types import Pose
from hil.tools.bringup.procedure import BringUp, Plan
from hil.tools.bringup.result import Check, Report, Side
from hil.tools.bringup.wiring import Seen
from sim_twin import _native
from sim_twin.twin import Twin, TwinSetup
from tests.twin.rigs import robot

WHEELS = [_native.STATES.index(f"wheel_{side}_rad") for side in ("left", "right")]
SPEEDS = [_native.STATES.index(f"omega_{side}_rad_s") for side in ("left", "right")]
# (0.5 m/s + 2.5 rad/s of half the track) over the wheel radius.
NEEDED_RAD_S = (0.5 + 2.5 * 0.1083) / 0.0482


def lifted(*faults: Fault, link: LinkConfig | None = None, seed: int = 1, **changes: Any) -> Twin:
    """Return a twin of the thesis robot on blocks, with faults from power-up on."""
    setup = TwinSetup(
        robot(variant="lifted", **changes),
        link or LinkConfig(),
        CameraConfig(),
        Pose(0.0, 0.0, 0.0),
        seed,
        faults=faults,
    )
    return Twin(setup)


class Onlooker:
    """Sees the twin's wheels as they really turn, and notes whether they stood when asked."""

    def __init__(self, twin: Twin) -> None:
        self._twin = twin
        self._start = self._angles()
        self.spoken_to: list[str] = []
        self.turning_rad_s: list[float] = []

    def _angles(self) -> list[float]:
        state = self._twin._kernel.state()
        return [state[i] for i in WHEELS]

    def note(self, text: str) -> None:
        """Note how fast the wheels turn while a person is being told something."""
        state = self._twin._kernel.state()
        self.spoken_to.append(text)
        self.turning_rad_s.append(max(abs(state[i]) for i in SPEEDS))

    def watch(self, text: str) -> None:
        self.note(text)
        self._start = self._angles()

    def seen(self, driven: Side) -> Seen:
        self.note(driven)
        moved = [b - a for a, b in zip(self._start, self._angles(), strict=True)]
        side = max((0, 1), key=lambda i: abs(moved[i]))
        if abs(moved[side]) < 0.1:
            return Seen(None)
        return Seen(("left", "right")[side], moved[side] > 0.0)

    def turns(self, side: Side, believed: float) -> float:
        del believed
        self.note(side)
        i = ("left", "right").index(side)
        # A chalk mark is read to a twentieth of a turn.
        return round((self._angles()[i] - self._start[i]) / (2 * math.pi) * 20) / 20


def bring_up(twin: Twin, eye: Any = None, *, turns: float = 10.0) -> tuple[Report, list[Check]]:
    """Run the bring-up; return its report and the checks as they were told."""
    told: list[Check] = []
    plan = Plan(robot(), NEEDED_RAD_S, turns)
    onlooker = eye or Onlooker(twin)

    def tell(check: Check) -> None:
        told.append(check)
        if isinstance(onlooker, Onlooker):
            onlooker.note(check.name)

    return BringUp(twin, onlooker, plan, tell).run(), told
