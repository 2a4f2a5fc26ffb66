"""What a law from outside may not do to a run: raise, return nonsense, ask for too much, take the clock.

Whatever it does becomes a RigFault that names file, line and what happened; the session then stops the
robot first and closes the record. The time a step may take is watched by the interval timer of the
system, which interrupts Python code and sleeps, not a call that stays inside a C library: for that one
the board's own time-out (250 ms without a set-point) stops the robot.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

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
EXCESS = 1.0 + 1e-9


class GuardedLaw:
    """An outer law whose misbehaviour ends the run, and nothing else."""

    def __init__(self, entry: Entry, make: Callable[[], OuterLaw], limits: OuterLimits) -> None:
        self._entry = entry
        self.limits = limits
        self._most = limits.eta1_max_m_s * EXCESS, limits.theta_dot_max_rad_s * EXCESS
        self._law = self.call("making it", make)

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Start anew from this estimate; raises RigFault."""
        self.call("reset", lambda: self._law.reset(reference, estimate))

    def step(self, reference: ReferenceState, estimate: Estimate, dt_s: float) -> OuterCommand:
        """Return the law's command; raises RigFault when it is none that may be sent."""
        command = self.call("step", lambda: self._law.step(reference, estimate, dt_s))
        if not isinstance(command, OuterCommand):
            raise self.fault(f"step returned {type(command).__name__}, an OuterCommand is needed")
        eta1, turn = command.eta1_m_s, command.theta_dot_rad_s
        plain = type(eta1) is float and type(turn) is float
        if not (plain and abs(eta1) <= self._most[0] and abs(turn) <= self._most[1]):
            self._check_speeds(eta1, turn, "step")
        self._check_trace(command.trace)
        if plain:
            return command
        # As 64 bits from here on, whatever the law calculates in: what follows is then the same everywhere.
        return OuterCommand(float(eta1), float(turn), command.trace)

    @property
    def own(self) -> object:
        """The law itself, as its factory gave it."""
        return self._law

    @property
    def makes_batches(self) -> bool:
        """Say whether the law's class can step several runs at once (hil.core.batch)."""
        return callable(getattr(type(self._law), "batch", None))

    @property
    def batch_key(self) -> tuple[int, Callable[..., object]]:
        """Return what laws that are stepped together have equal."""
        made: Callable[..., object] = type(self._law)
        return id(self._entry), made

    def batch_of(self, laws: Sequence[GuardedLaw]) -> Any:
        """Return what steps the runs of several laws, this one among them."""
        made: Any = type(self._law)
        return made.batch([law._law for law in laws])

    def refused(self, eta1_m_s: float, theta_dot_rad_s: float, said: str) -> RigFault | None:
        """Return why these speeds that `said` returned may not be sent, None where they may."""
        try:
            self._check_speeds(eta1_m_s, theta_dot_rad_s, said)
        except RigFault as fault:
            return fault
        return None

    def _check_speeds(self, eta1_m_s: float, theta_dot_rad_s: float, said: str) -> None:
        limits = self.limits
        self._check(said, "eta1_m_s", eta1_m_s, limits.eta1_max_m_s, "m/s")
        self._check(said, "theta_dot_rad_s", theta_dot_rad_s, limits.theta_dot_max_rad_s, "rad/s")

    def _check_trace(self, trace: object) -> None:
        """Refuse a trace that the record could not hold; NaN stands for "does not exist"."""
        if not isinstance(trace, Mapping):
            raise self.fault(f"step returned a trace that is {type(trace).__name__}, not a dict")
        for name, value in trace.items():
            if type(value) is not float and not isinstance(
                value, int | float | np.number | np.bool_
            ):
                raise self.fault(f"step returned trace[{name!r}] = {value!r}, not a number")

    def _check(self, said: str, name: str, value: float, limit: float, unit: str) -> None:
        try:
            finite = math.isfinite(value)
        except TypeError:
            raise self.fault(f"{said} returned {name} = {value!r}, a number is needed") from None
        if not finite:
            raise self.fault(f"{said} returned {name} = {value}")
        if abs(value) > limit * EXCESS:
            raise self.fault(
                f"{said} asked for {name} = {past(value, math.copysign(limit, value), '.6g')} {unit}, "
                f"the limit is {limit:g} {unit}"
            )

    def call(self, what: str, function: Callable[[], Result], runs: int = 1) -> Result:
        """Return what a call of the law for so many runs gives; raises RigFault where it raises or hangs."""
        try:
            with time_limit(STEP_MAX_S * runs):
                return function()
        except HilError:
            raise
        except TooLongError as error:
            limit_s = STEP_MAX_S * runs
            raise self.fault(f"{what} took longer than {limit_s:g} s", error) from None
        except (KeyboardInterrupt, SystemExit):
            raise
        except BaseException as error:
            raise self.fault(f"{what} raised {in_one_line(error)}", error) from None

    def fault(self, said: str, error: BaseException | None = None) -> RigFault:
        """Return the fault that names the law, its file and its line."""
        return RigFault(f"law {self._entry.name} ({place_of(self._entry, error)}): {said}")
