"""Gains that change while a law runs, around any law."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hil.core.types import Estimate, OuterCommand, OuterLaw, ReferenceState


class RetunedLaw:
    """An outer law whose gains may be others from a tick on.

    A law that has `retune(gains)` goes on with them from where it is. Any other is made anew and starts
    there, as at the beginning of a run.
    """

    def __init__(self, gains: Any, make: Callable[[Any], OuterLaw]) -> None:
        self._gains = gains
        self._make = make
        self._law = make(gains)

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Start anew."""
        self._law.reset(reference, estimate)

    def step(self, reference: ReferenceState, estimate: Estimate, dt_s: float) -> OuterCommand:
        """Return the law's command."""
        return self._law.step(reference, estimate, dt_s)

    def gain(self, name: str) -> float:
        """Return a gain as it is now."""
        return float(getattr(self._gains, name))

    def change(
        self, name: str, value: float, reference: ReferenceState, estimate: Estimate
    ) -> None:
        """Change one gain; raises ValidationError, AttributeError."""
        self._gains = type(self._gains).model_validate(self._gains.model_dump() | {name: value})
        retune = getattr(self._law, "retune", None)
        if retune is not None:
            retune(self._gains)
            return
        self._law = self._make(self._gains)
        self._law.reset(reference, estimate)
