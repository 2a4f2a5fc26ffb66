"""Faults of the host itself: its process does not run, runs too seldom, or its clock steps.

The world's time goes on through all of them; times are s, of the world's clock unless said.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hil.config.events import Fault
    from sim_twin.camera_timing import Span


class HostFaults:
    """When the host's process runs, and what its clock says."""

    def __init__(self, faults: Sequence[Fault]) -> None:
        self._faults = [fault for fault in faults if fault.kind.startswith("host_")]
        self._spans: list[tuple[Fault, Span]] = []

    @property
    def any(self) -> bool:
        """True where the host has any."""
        return bool(self._faults)

    def begin(self, span: Callable[[Fault], Span]) -> None:
        """Let the faults' times be those that `span` gives."""
        self._spans = [(fault, span(fault)) for fault in self._faults]

    def step_s(self, t_s: float) -> float:
        """Return by how much the host's clock is ahead of the world's."""
        return sum(
            fault.step_s
            for fault, (start_s, end_s) in self._spans
            if fault.kind == "host_clock_step" and start_s <= t_s < end_s
        )

    def world_s(self, until_s: float, t_s: float) -> float:
        """Return the world's time at which the host's clock reaches `until_s`, seen from `t_s`.

        Where the clock steps before that, it is the time of the step: who waits looks again then.
        """
        if not self._spans:
            return until_s
        steps = [
            edge_s
            for fault, span in self._spans
            if fault.kind == "host_clock_step"
            for edge_s in span
            if edge_s > t_s
        ]
        return min([until_s - self.step_s(t_s), *steps])

    def runs_at_s(self, t_s: float) -> float:
        """Return when the process next runs, at `t_s` or later."""
        for fault, (start_s, end_s) in self._spans:
            if not start_s <= t_s < end_s:
                continue
            if fault.kind == "host_stopped":
                t_s = end_s
            elif fault.kind == "host_overloaded":
                begin_s = start_s if math.isfinite(start_s) else 0.0
                t_s = begin_s + math.ceil((t_s - begin_s) / fault.late_s - 1e-9) * fault.late_s
        return t_s
