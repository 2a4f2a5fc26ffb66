"""Parts of a law switched off, to see what each is worth: wrappers around the law itself.

None of this is in a run that is not an ablation.
"""

from __future__ import annotations

from collections.abc import Sequence
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


class WithoutKappa:
    """A sliding block that leaves kappa, the rate of mu (p + eta) + Psi, out of the command."""

    def __init__(self, block: Any) -> None:
        self._block = block

    def __getattr__(self, name: str) -> Any:
        """Return whatever else the block has."""
        return getattr(self._block, name)

    def terms(self, t_s: float, p: Sequence[float], q: Sequence[float]) -> Any:
        """Return the block's terms with kappa zero."""
        s, kappa, *rest = self._block.terms(t_s, p, q)
        return (s, type(kappa)([0.0] * len(kappa)), *rest)


class WithoutGamma:
    """A sliding block that starts with gamma zero: s(0) = delta3(0), so there is a reaching phase."""

    def __init__(self, block: Any) -> None:
        self._block = block

    def __getattr__(self, name: str) -> Any:
        """Return whatever else the block has."""
        return getattr(self._block, name)

    def reset(self, p: Sequence[float], q: Sequence[float]) -> None:
        """Start anew with eta = -p(0) - mu0 q(0) made zero."""
        self._block.reset([0.0] * len(p), [0.0] * len(q))


def has_block(law: object) -> bool:
    """Say whether a law takes kappa and gamma from a sliding block that it keeps over a start."""
    return hasattr(law, "gamma_m_s") and hasattr(getattr(law, "_block", None), "terms")


def replace_block(law: Any, wrapper: type[WithoutKappa | WithoutGamma]) -> None:
    """Put a wrapper around a law's sliding block, in place."""
    law._block = wrapper(law._block)
