"""What a reader must know of a task before trusting a run's figures."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hil.control.references import make_reference, unfinished

if TYPE_CHECKING:
    from hil.config.scenario import Scenario

_SAMPLES = 200  # instants at which a reference's speed is looked at


def notes(scenario: Scenario) -> list[str]:
    """Return what a reader must know before trusting a run's figures: one line each.

    What the reference asks may lie beyond the run's duration or the loop's limits; the run is then
    possible, and its figures say something else than they seem to.
    """
    reference = make_reference(scenario.reference)
    limits, run_s = scenario.control.limits, scenario.duration_s
    found = []
    if told := unfinished(scenario.reference, run_s):
        found.append(told)
    rates = [reference.at(run_s * k / _SAMPLES).z1_dot_m_s for k in range(_SAMPLES + 1)]
    fastest = max(math.hypot(*rate) for rate in rates)
    most = math.hypot(limits.eta1_max_m_s, scenario.robot.d0_m * limits.theta_dot_max_rad_s)
    if fastest > most:
        found.append(
            f"the reference moves at up to {fastest:.3g} m/s, more than the {most:.3g} m/s that "
            "control.limits allow: it cannot be followed"
        )
    return found
