"""What a law from outside may not do to a run: raise, return nonsense, ask for too much, take the clock.

Whatever it does becomes a RigFault that names file, line and what happened; the session then stops the
robot first and closes the record. The time a step may take is watched by the interval timer of the
system, which interrupts Python code and sleeps, not a call that stays inside a C library: for that one
the board's own time-out (250 ms without a set-point) stops the robot.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from hil.core.errors import HilError, RigFault
from hil.core.registry import in_one_line, place_of
from hil.core.time_limit import TooLongError, time_limit
from hil.core.types import OuterCommand
from hil.core.wording import past

if TYPE_CHECKING:
    from hil.config.control import OuterLimits
    from hil.core.registry import Entry
    from hil.core.types import Estimate, OuterLaw, ReferenceState

Result = TypeVar("Result")

# Longest that one call of the law may take, s: the board gives up on the host after 0.25 s.
STEP_MAX_S = 0.2
# Set-points this far over a limit are a fault; less is rounding.
_EXCESS = 1.0 + 1e-9


class GuardedLaw:
    """An outer law whose misbehaviour ends the run, and nothing else."""

    def __init__(self, entry: Entry, make: Callable[[], OuterLaw], limits: OuterLimits) -> None:
        self._entry = entry
        self._limits = limits
        self._law = self._call("making it", make)

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Start anew from this estimate; raises RigFault."""
        self._call("reset", lambda: self._law.reset(reference, estimate))

    def step(self, reference: ReferenceState, estimate: Estimate, dt_s: float) -> OuterCommand:
        """Return the law's command; raises RigFault when it is none that may be sent."""
        command = self._call("step", lambda: self._law.step(reference, estimate, dt_s))
        if not isinstance(command, OuterCommand):
            raise self._fault(f"step returned {type(command).__name__}, an OuterCommand is needed")
        self._check("eta1_m_s", command.eta1_m_s, self._limits.eta1_max_m_s, "m/s")
        self._check(
            "theta_dot_rad_s", command.theta_dot_rad_s, self._limits.theta_dot_max_rad_s, "rad/s"
        )
        self._check_trace(command.trace)
        if type(command.eta1_m_s) is float and type(command.theta_dot_rad_s) is float:
            return command
        # As 64 bits from here on, whatever the law calculates in: what follows is then the same everywhere.
        return OuterCommand(float(command.eta1_m_s), float(command.theta_dot_rad_s), command.trace)

    def _check_trace(self, trace: object) -> None:
        """Refuse a trace that the record could not hold; NaN stands for "does not exist"."""
        if not isinstance(trace, Mapping):
            raise self._fault(f"step returned a trace that is {type(trace).__name__}, not a dict")
        for name, value in trace.items():
            if not isinstance(value, int | float | np.number | np.bool_):
                raise self._fault(f"step returned trace[{name!r}] = {value!r}, not a number")

    def _check(self, name: str, value: float, limit: float, unit: str) -> None:
        try:
            finite = math.isfinite(value)
        except TypeError:
            raise self._fault(f"step returned {name} = {value!r}, a number is needed") from None
        if not finite:
            raise self._fault(f"step returned {name} = {value}")
        if abs(value) > limit * _EXCESS:
            raise self._fault(
                f"step asked for {name} = {past(value, math.copysign(limit, value), '.6g')} {unit}, "
                f"the limit is {limit:g} {unit}"
            )

    def _call(self, what: str, function: Callable[[], Result]) -> Result:
        try:
            with time_limit(STEP_MAX_S):
                return function()
        except HilError:
            raise
        except TooLongError as error:
            raise self._fault(f"{what} took longer than {STEP_MAX_S:g} s", error) from None
        except (KeyboardInterrupt, SystemExit):
            raise
        except BaseException as error:
            raise self._fault(f"{what} raised {in_one_line(error)}", error) from None

    def _fault(self, said: str, error: BaseException | None = None) -> RigFault:
        return RigFault(f"law {self._entry.name} ({place_of(self._entry, error)}): {said}")
