"""Directions drawn at random: a study asks no law about one direction of the world alone.

A law whose cost has a sign by component owes something to where the axes of the world lie in a task. So each
run of a search and of a verdict has the law's axes turned by an angle drawn for it, equal for all laws.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.control.laws.axes import drawn_axes_rad

if TYPE_CHECKING:
    from hil.config.scenario import Scenario


def in_drawn_axes(scenario: Scenario, name: str) -> Scenario:
    """Return the scenario with the law's axes turned by the angle drawn for `name`."""
    axes = {"axes_rad": drawn_axes_rad(name)}
    return scenario.model_copy(update={"control": scenario.control.model_copy(update=axes)})
