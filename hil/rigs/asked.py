"""What a target is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hil.config.scenario import Scenario
    from hil.wire.signing import Key


@dataclass(frozen=True, slots=True)
class Asked:
    """A rig that is wanted: `where` is what follows the target's name and a colon, empty without.

    `key` is the board's signing key: a real board has it, a simulated one is given it. `usb` is the
    port on which a simulated one is met.
    """

    where: str
    scenario: Scenario
    camera: str
    seed: int
    key: Key | None = None
    usb: bool = False
