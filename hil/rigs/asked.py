"""What a target is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hil.config.scenario import Scenario


@dataclass(frozen=True, slots=True)
class Asked:
    """A rig that is wanted: `where` is what follows the target's name and a colon, empty without."""

    where: str
    scenario: Scenario
    camera: str
    seed: int
