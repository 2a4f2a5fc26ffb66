"""What an operator orders while a run is on: arming by hand, values of board and law, steps of the goal.

The session asks for orders while it holds at rest before arming, and once a tick; the tape keeps each where
it was taken, so that an exact replay takes it there again. Nothing here reads a clock or waits.

A value of the law counts from the tick on at which it was taken; one of the board goes out as a PARAM_SET,
and counts once the board has answered. A step moves the goal at once, to see what the values make of it.
Each is one line of the record's events, kind "tuning".
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from hil.config.fields import settings
from hil.config.limits import board_table
from hil.control.laws.stages import StartGains
from hil.core.errors import BadInput, RigFault
from hil.core.registries import OUTER_LAWS
from hil.core.text import visible
from hil.rigs.replay import HELD
from hil.wire import handshake

if TYPE_CHECKING:
    from hil.config.scenario import SafetyConfig
    from hil.control.laws.retuned import RetunedLaw
    from hil.control.references import Reference
    from hil.core.registry import Entry
    from hil.core.types import Estimate, ReferenceState, Vec2
    from hil.record.timeline import Timeline
    from hil.runs.parts import Parts
    from hil.runs.spec import RunSpec
    from hil.wire.link import BoardLink, Procedure

Order = Mapping[str, Any]
ARM: Order = {"arm": True}
EVENT = "tuning"
BOARD, LAW = "board.", "law."
# Robot found and shown, nobody arms: the run ends after so long.
ARMED_WITHIN_S = 600.0
# A goal moved by hand keeps this far from the fence; one step is at most so long.
ROOM_M = 0.15
STEP_MAX_M = 1.0
# The most that a parameter of the board can be sent as.
_FLOAT32_MAX = 3.4028234663852886e38
# They choose what runs and are no numbers to turn; the manifest names the wheel law.
_SWITCHES = frozenset({"LAW", "ST_SCHEME", "ST_VAR", "ISM_FORM"})


@dataclass(frozen=True, slots=True)
class Tunable:
    """A value that may be changed while the robot is armed; `key` is board.NAME or law.NAME."""

    key: str
    value: float
    unit: str
    meaning: str
    low: float | None
    high: float | None
    bounds: str


def tunables(spec: RunSpec) -> dict[str, Tunable]:
    """Return what may be changed live in a run: the law's numbers, and the board's live parameters.

    How a law starts is left out: nothing of a run depends on it any more.
    """
    law = OUTER_LAWS.get(spec.outer)
    gains = spec.scenario.control.active_gains.of(law)
    found = [
        Tunable(f"{LAW}{s.key}", float(value), s.unit, s.meaning, s.low, s.high, s.bounds())
        for s in (settings(law.settings) if law.settings is not None else ())
        if s.key not in StartGains.model_fields
        and isinstance(value := getattr(gains, s.key, None), int | float)
        and not isinstance(value, bool)
    ]
    found += [
        Tunable(
            f"{BOARD}{name}", _as_written(spec.scenario.board[name]), entry.unit, entry.doc,
            entry.minimum, entry.maximum, f"{entry.minimum:g} to {entry.maximum:g}",
        )
        for name, entry in board_table().items()
        if entry.live and name not in _SWITCHES
    ]  # fmt: skip
    return {item.key: item for item in found}


def _as_written(value: float) -> float:
    """Return a 32-bit float as somebody would write it: 0.16 and not 0.1599999964."""
    return float(f"{value:.7g}")


def change_of(known: Mapping[str, Tunable], law: Entry, key: str, value: float) -> Order:
    """Return the order that changes a value; raises BadInput for one that may not be, or out of bounds."""
    item = known.get(key)
    if item is None:
        name = key.removeprefix(BOARD)
        why = "fixed while the robot is armed" if name in board_table() else "no such value"
        raise BadInput(f"{visible(key)}: {why}")
    if key.startswith(LAW):
        assert law.settings is not None
        name = key.removeprefix(LAW)
        others = {k.removeprefix(LAW): v.value for k, v in known.items() if k.startswith(LAW)}
        try:
            law.settings.model_validate(others | {name: value})
        except ValidationError as error:
            said = error.errors(include_url=False)[0]["msg"]
            raise BadInput(f"{key} = {value:g} {item.unit}: {said}") from None
    elif not (item.low or 0.0) <= value <= (item.high or 0.0):
        raise BadInput(f"{key} = {value:g} {item.unit}: allowed are {item.bounds} {item.unit}")
    return {"set": key, "value": float(value)}


def step_of(x_m: float, y_m: float) -> Order:
    """Return the order that moves the goal (world); raises BadInput for one too long."""
    if not math.hypot(x_m, y_m) <= STEP_MAX_M:
        raise BadInput(f"step of ({x_m:g}, {y_m:g}) m: at most {STEP_MAX_M:g} m")
    return {"step": [float(x_m), float(y_m)]}


class SteppedReference:
    """A reference whose point can be moved by hand, within the fence less the robot's room."""

    def __init__(self, reference: Reference, safety: SafetyConfig) -> None:
        self._reference = reference
        self._safety = safety
        self._shift: Vec2 = (0.0, 0.0)
        self._t_s = 0.0

    def at(self, t_s: float) -> ReferenceState:
        """Return the desired state `t_s` after the start of the run."""
        state = self._reference.at(t_s)
        self._t_s = t_s
        if self._shift == (0.0, 0.0):
            return state
        x, y = state.z1_m
        return replace(state, z1_m=(x + self._shift[0], y + self._shift[1]))

    def step(self, x_m: float, y_m: float) -> None:
        """Move the point from where it is; raises BadInput where it would come too near to the fence."""
        x, y = self.at(self._t_s).z1_m
        x, y, safety = x + x_m, y + y_m, self._safety
        inside = (
            safety.fence_x_min_m + ROOM_M <= x <= safety.fence_x_max_m - ROOM_M
            and safety.fence_y_min_m + ROOM_M <= y <= safety.fence_y_max_m - ROOM_M
        )
        if not inside:
            raise BadInput(f"step to ({x:.3f}, {y:.3f}) m: not within {ROOM_M:g} m of the fence")
        self._shift = (self._shift[0] + x_m, self._shift[1] + y_m)


@dataclass(frozen=True, slots=True)
class OrderSource:
    """Where orders come from; `held` says that the robot is armed by one of them."""

    take: Callable[[], Sequence[Order]]
    held: bool = False


class OperatorOrders:
    """Carries out what a source orders; `law` is None where its gains are not to be touched."""

    def __init__(
        self,
        source: OrderSource,
        link: BoardLink,
        timeline: Timeline,
        goal: SteppedReference,
        law: RetunedLaw | None,
    ) -> None:
        self._take = source.take
        self._held = source.held
        self._held_since_s: float | None = None
        self.holding = False  # the robot was found, and nobody has armed it yet
        self._link = link
        self._timeline = timeline
        self._goal = goal
        self._law = law
        self._for_board: deque[tuple[str, float]] = deque()
        # What was changed so far, in force; a new mapping each time, for whoever looks from beside.
        self.changed: Mapping[str, float] = {}

    def hold(self) -> bool:
        """Return whether nobody has armed yet; raises RigFault when nobody does for too long."""
        if not self._held:
            return False
        now_s = self._link.t_s
        if self._held_since_s is None:
            self._held_since_s, self.holding = now_s, True
            self._note(*HELD)
        if any(order.get("arm") is True for order in self._take()):
            self._held = self.holding = False
            self._note("operator", "armed by hand")
        elif now_s - self._held_since_s > ARMED_WITHIN_S:
            raise RigFault(f"nobody armed the robot within {ARMED_WITHIN_S:g} s of its being found")
        return self._held

    def at_tick(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Take what was ordered since the tick before."""
        for order in self._take():
            key, value = str(order.get("set", "")), order.get("value")
            if "step" in order:
                self._step_goal(*order["step"])
            if not isinstance(value, int | float):
                continue
            if key.startswith(LAW):
                self._change_law(key.removeprefix(LAW), float(value), reference, estimate)
            elif key.startswith(BOARD):
                self._for_board.append((key.removeprefix(BOARD), float(value)))
        if self._for_board and not self._link.busy:
            self._link.begin(self._change_board())

    def _step_goal(self, x_m: float, y_m: float) -> None:
        try:
            self._goal.step(x_m, y_m)
        except BadInput as refused:
            self._note(EVENT, str(refused))
            return
        self._note(EVENT, f"goal stepped by ({x_m:+.3f}, {y_m:+.3f}) m")

    def _change_law(
        self, name: str, value: float, reference: ReferenceState, estimate: Estimate
    ) -> None:
        if self._law is None:
            return
        try:
            before = self._law.gain(name)
            self._law.change(name, value, reference, estimate)
        except (ValidationError, AttributeError, TypeError):
            self._note(EVENT, f"{LAW}{name}: refused {value:g}")
            return
        self._done(f"{LAW}{name}", before, value)

    def _change_board(self) -> Procedure:
        """Set what is waiting, one after the other; a board that refuses keeps what it has."""
        link = self._link
        while self._for_board:
            name, value = self._for_board.popleft()
            before = link.parameters.get(name)
            if not abs(value) <= _FLOAT32_MAX:
                self._note(EVENT, f"{BOARD}{name}: refused {value:g}")
                continue
            try:
                yield from handshake.set_parameter(link, name, value)
            except RigFault as refused:
                if before is not None and link.parameters[name] != link.parameters[name]:
                    link.parameters[name] = before  # not answered: NaN meanwhile
                self._note(EVENT, f"{BOARD}{name}: not changed: {refused}")
                continue
            self._done(f"{BOARD}{name}", before if before is not None else value, value)

    def _done(self, key: str, before: float, value: float) -> None:
        self.changed = {**self.changed, key: value}
        self._note(EVENT, f"{key} {before:.6g} -> {value:.6g}")

    def _note(self, kind: str, text: str) -> None:
        self._timeline.event(self._link.t_s, kind, text)


def with_orders(source: OrderSource, taken: Callable[[Order], None]) -> OrderSource:
    """Return a source that tells `taken` of each order it gives."""

    def take() -> Sequence[Order]:
        orders = source.take()
        for order in orders:
            taken(order)
        return orders

    return replace(source, take=take)


def ordered(
    parts: Parts, source: OrderSource, safety: SafetyConfig, law: RetunedLaw | None
) -> Parts:
    """Return the parts of a session whose operator may order: steps of the goal, values of board and law.

    `law` is None where its gains are not to be touched.
    """
    goal = SteppedReference(parts.reference, safety)
    orders = OperatorOrders(source, parts.link, parts.timeline, goal, law)
    return replace(parts, orders=orders, reference=goal)
