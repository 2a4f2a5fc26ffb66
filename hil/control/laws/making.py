"""An outer law made ready for a run: guarded where it comes from outside, and at rest at its goal."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from hil.control.laws.axes import TurnedAxes
from hil.control.laws.guard import GuardedLaw
from hil.control.laws.hold import HoldAtGoal
from hil.control.laws.retuned import RetunedLaw
from hil.core.registries import OUTER_LAWS
from hil.core.registry import BUILT_IN

if TYPE_CHECKING:
    from hil.config.control import OuterLimits
    from hil.config.gains import Gains
    from hil.config.scenario import Scenario
    from hil.core.registry import Entry
    from hil.core.types import OuterLaw


def make_law(outer: str, scenario: Scenario) -> OuterLaw:
    """Return the outer law of a run; raises as `make_outer_law`."""
    return law_and_gains(outer, scenario, live=False)[0]


def law_and_gains(
    outer: str, scenario: Scenario, *, live: bool
) -> tuple[OuterLaw, RetunedLaw | None]:
    """Return the outer law of a run, and what changes its gains where they are `live`; raises as above."""
    control, d0_m = scenario.control, scenario.robot.d0_m
    return _ready(OUTER_LAWS.get(outer), control.active_gains, control.limits, d0_m, live=live)


def own_law(law: OuterLaw) -> object:
    """Return what a law's factory gave, without what was put around it; two runs may have been given one."""
    inner: object = law
    while isinstance(inner, HoldAtGoal | TurnedAxes):
        inner = inner._law
    return inner.own if isinstance(inner, GuardedLaw) else inner


def make_outer_law(name: str, gains: Gains, limits: OuterLimits, d0_m: float) -> OuterLaw:
    """Return the outer law `name` with its part of `gains`; `d0_m` is as believed (2.31).

    Raises BadInput when there is no such law, RigFault for one from outside that fails while it is made.
    """
    return _ready(OUTER_LAWS.get(name), gains, limits, d0_m, live=False)[0]


def _ready(
    entry: Entry, gains: Gains, limits: OuterLimits, d0_m: float, *, live: bool
) -> tuple[OuterLaw, RetunedLaw | None]:
    own = gains.of(entry)
    make = partial(_bare, entry=entry, limits=limits, d0_m=d0_m)
    retuned = RetunedLaw(own, make) if live else None
    law = retuned or make(own)
    rests = entry.origin == BUILT_IN or bool(entry.extra.get("hold", True))
    return HoldAtGoal(law, limits) if rests else law, retuned


def _bare(own: Any, entry: Entry, limits: OuterLimits, d0_m: float) -> OuterLaw:
    """Return the law with gains of its own kind, guarded where it comes from outside."""
    if entry.origin == BUILT_IN:
        law: OuterLaw = entry.factory(own, limits, d0_m)
        return law
    return GuardedLaw(entry, lambda: entry.factory(own, limits, d0_m), limits)
