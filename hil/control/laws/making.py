"""An outer law made ready for a run: guarded where it comes from outside, at rest at its goal, in its limits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hil.control.laws.axes import in_axes
from hil.control.laws.guard import GuardedLaw
from hil.control.laws.hold import HoldAtGoal
from hil.control.laws.let_go import LetGo
from hil.control.laws.turn_first import TurnFirst
from hil.control.laws.within import WithinWheelSpeed
from hil.core.registries import OUTER_LAWS
from hil.core.registry import BUILT_IN

if TYPE_CHECKING:
    from hil.config.control import ControlConfig, OuterLimits
    from hil.config.gains import Gains
    from hil.control.vehicles.vehicle import Vehicle
    from hil.core.registry import Entry
    from hil.core.types import OuterLaw


def make_outer_law(name: str, gains: Gains, limits: OuterLimits, d0_m: float) -> OuterLaw:
    """Return the outer law `name` with its part of `gains`; `d0_m` is as believed (2.31).

    Raises BadInput when there is no such law, RigFault for one from outside that fails while it is made.
    """
    entry = OUTER_LAWS.get(name)
    law = bare_law(entry, gains.of(entry), limits, d0_m)
    return at_rest(entry, law, limits)


def bare_law(entry: Entry, gains: Any, limits: OuterLimits, d0_m: float) -> OuterLaw:
    """Return the law with these gains, without the rest at the goal; raises as `make_outer_law`."""
    if entry.origin == BUILT_IN:
        law: OuterLaw = entry.factory(gains, limits, d0_m)
        return law
    return GuardedLaw(entry, lambda: entry.factory(gains, limits, d0_m), limits)


def at_rest(entry: Entry, law: OuterLaw, limits: OuterLimits) -> OuterLaw:
    """Return the law with the rest at the goal, if it wants that."""
    rests = entry.origin == BUILT_IN or bool(entry.extra.get("hold", True))
    return HoldAtGoal(law, limits) if rests else law


def limited(
    law: OuterLaw, control: ControlConfig, vehicle: Vehicle, wheel_speed_max_rad_s: float
) -> OuterLaw:
    """Return the law in its axes, under what holds for every law on this vehicle."""
    law = in_axes(law, control.axes_rad)
    law = WithinWheelSpeed(law, vehicle, wheel_speed_max_rad_s)
    law = TurnFirst(law, control.limits.turn_missing_rad_s)
    return LetGo(law, vehicle, control.limits.let_go_rad_s)
