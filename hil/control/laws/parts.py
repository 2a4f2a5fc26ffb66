"""Parts of a law switched off, to see what each is worth: around the law, or in its sliding block.

None of this is in a run that is not an ablation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hil.core.types import ReferenceState

if TYPE_CHECKING:
    from hil.core.types import Estimate, OuterCommand, OuterLaw

_ZERO = (0.0, 0.0)


class WithoutFeedForward:
    """The law sees where the reference is, not how it moves: its derivatives are zero."""

    def __init__(self, law: OuterLaw) -> None:
        self._law = law

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Start anew."""
        self._law.reset(_at_rest(reference), estimate)

    def step(self, reference: ReferenceState, estimate: Estimate, dt_s: float) -> OuterCommand:
        """Return the law's command for a reference that stands."""
        return self._law.step(_at_rest(reference), estimate, dt_s)


def _at_rest(reference: ReferenceState) -> ReferenceState:
    return ReferenceState(reference.z1_m, _ZERO, _ZERO, _ZERO)


def has_block(law: object) -> bool:
    """Say whether a law takes kappa and gamma from a sliding block that it keeps over a start."""
    return hasattr(law, "gamma_m_s") and hasattr(law, "_block")


def leave_out(law: Any, part: str) -> None:
    """Leave kappa or gamma out of what a law's sliding block says (hil.control.AsgIsm), in place."""
    setattr(law._block, f"without_{part}", True)
