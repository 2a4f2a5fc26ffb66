"""A run of a law with a part of it switched off."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil.config.control import ControlConfig, OuterLimits
from hil.config.load import with_overrides
from hil.control.laws.hold import HoldAtGoal
from hil.control.laws.parts import (
    WithoutFeedForward,
    has_block,
    leave_out,
)
from hil.core.errors import BadInput
from hil.core.registries import ESTIMATORS, OUTER_LAWS

if TYPE_CHECKING:
    from hil.config.scenario import Scenario
    from hil.core.registry import Entry
    from hil.runs.execute import InMemory

# A gain at zero is the part off: part -> gain.
_BY_GAIN = {
    "alpha": "alpha_m_s3",
    "psi": "sigma_m_s2",
    "integral": "ki_s4",
    "start": "zeta_start_m_s2",
}
# Gains that go to zero with it: what (2.9) adds to alpha is of the same term.
_BESIDE = {"alpha": ("gamma0_m_s3", "gamma1_s3", "gamma2_s2")}
_BY_BLOCK = ("kappa", "gamma")
_BY_LIMIT: Mapping[str, Mapping[str, float | None]] = {
    "restrictions": {"approach_speed_m_s": None, "approach_accel_m_s2": None},
    "lead": {"lead_s": 0.0},
    "hold": {"hold_enter_m": 0.0},
    "turn-first": {"turn_missing_rad_s": None},
}
# Off as things ship: here the part is switched on, and what is below 0 helps.
_BY_ESTIMATOR = {"observed-z3": "observed-acceleration"}
MEANING = {
    "alpha": "gain of the sliding term at 0",
    "psi": "averaged sub-gradient Psi at 0 (sigma = 0)",
    "integral": "gain of the integral at 0",
    "kappa": "kappa left out of the command",
    "gamma": "gamma at 0: s does not start at 0",
    "start": "zeta starts at 0 at standstill",
    "feed-forward": "derivatives of the reference taken as 0",
    "restrictions": "no bound on what position and velocity error ask for",
    "lead": "set-points without their lead",
    "hold": "no rest at the goal",
    "turn-first": "speed is not given up for a turn that is missing",
    "observed-z3": "z3 observed, not from the law's own zeta: switched on",
}


def parts_of(law: str) -> list[str]:
    """Return the parts of a law that can be switched off; those of all laws last."""
    entry = OUTER_LAWS.get(law)
    fields = entry.settings.model_fields if entry.settings is not None else {}
    own = [part for part, gain in _BY_GAIN.items() if gain in fields and _may_be_zero(entry, gain)]
    blocks = list(_BY_BLOCK) if _stands_on_block(entry) else []
    limits = [
        part for part, table in _BY_LIMIT.items() if set(table) <= set(OuterLimits.model_fields)
    ]
    on = [part for part, name in _BY_ESTIMATOR.items() if name in ESTIMATORS.names()]
    return [*own, *blocks, "feed-forward", *limits, *on]


def _may_be_zero(entry: Entry, gain: str) -> bool:
    assert entry.settings is not None
    bounds = entry.settings.model_fields[gain].metadata
    return not any(getattr(bound, "gt", None) is not None for bound in bounds)


def _stands_on_block(entry: Entry) -> bool:
    control = ControlConfig()
    gains = control.active_gains.of(entry)
    try:
        return has_block(entry.factory(gains, control.limits, 0.03))
    except Exception:  # a law from outside may need anything: it has no block of ours
        return False


def opened_without(scenario: Scenario, outer: str, seed: int, without: str = "") -> InMemory:
    """Return the run, to be made, of a law with a part of it off.

    Raises BadInput for a part that the law does not have.
    """
    from hil.runs.execute import InMemory, RunSpec  # noqa: PLC0415

    if without and without not in parts_of(outer):
        raise BadInput(
            f"law {outer}: has no part {without!r} to switch off; it has {', '.join(parts_of(outer))}"
        )
    scenario = _changed(scenario, outer, without)
    spec = RunSpec(
        scenario=scenario,
        target="twin",
        camera="pose",
        outer=outer,
        inner="asg-ism",
        seed=seed,
        out=Path(),
        command="hil ablate",
    )
    return InMemory(spec, law=_law_without(scenario, outer, without))


def _changed(scenario: Scenario, outer: str, without: str) -> Scenario:
    control = scenario.control
    if without in _BY_LIMIT:
        limits = control.limits.model_copy(update=dict(_BY_LIMIT[without]))
        return scenario.model_copy(
            update={"control": control.model_copy(update={"limits": limits})}
        )
    if without in _BY_ESTIMATOR:
        return with_overrides(scenario, [f"control.estimator={_BY_ESTIMATOR[without]}"])
    if without in _BY_GAIN:
        name = control.gain_set
        entry = OUTER_LAWS.get(outer)
        fields = entry.settings.model_fields if entry.settings is not None else {}
        off = [_BY_GAIN[without], *(gain for gain in _BESIDE.get(without, ()) if gain in fields)]
        gains = control.active_gains.with_values(entry, dict.fromkeys(off, 0.0))
        sets = control.gains.model_copy(update={name: gains})
        return scenario.model_copy(update={"control": control.model_copy(update={"gains": sets})})
    return scenario


def _law_without(scenario: Scenario, outer: str, without: str) -> Any:
    """Return the law with a part off, None where the scenario says it all."""
    if without not in _BY_BLOCK and without != "feed-forward":
        return None
    control, entry = scenario.control, OUTER_LAWS.get(outer)
    law = entry.factory(control.active_gains.of(entry), control.limits, scenario.robot.d0_m)
    if without == "feed-forward":
        law = WithoutFeedForward(law)
    else:
        leave_out(law, without)
    return HoldAtGoal(law, control.limits) if entry.extra.get("hold", True) else law
