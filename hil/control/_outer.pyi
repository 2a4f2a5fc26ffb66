"""Outer laws and references as native code, written from their Python source when it is built.

Which ones there are and when they stand in for their Python ones: hil/control/translated.py.
"""

from typing import Any

from hil.core.types import Estimate, ReferenceState, Vec2

# Path within the source tree and SHA-256 of each source that was translated.
SOURCES: tuple[tuple[str, str], ...]
# Names in a law's trace.
TRACE_KEYS: tuple[str, ...]
# Names of the laws' classes.
LAWS: tuple[str, ...]

# So many names of its own a law in Python may have.
OWN_TERMS_MOST: int

class OuterLaw:
    """A law, or what stands around one."""

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Start anew."""
    def step(
        self,
        reference: ReferenceState,
        estimate: Estimate,
        dt_s: float,
        own: tuple[str, ...] = ...,
    ) -> tuple[float, float, dict[str, float]]:
        """Return forward speed in m/s, turn rate in rad/s and the trace, NaN for what it does not have.

        `own` are the names that `python_law` was given.
        """

class Reference:
    """A desired motion of the flat output."""

    def at(self, t_s: float) -> tuple[Vec2, Vec2, Vec2, Vec2]:
        """Return z1* and its first three derivatives."""

def law(
    name: str,
    gains: Any,
    limits: Any,
    d0_m: float,
    *,
    without_kappa: bool = False,
    without_gamma: bool = False,
) -> OuterLaw:
    """Return the law of the class `name`; raises KeyError where it is not translated.

    Its sliding block, if it has one, leaves the parts out that are named.
    """

def python_law(law: Any, own: tuple[str, ...]) -> OuterLaw:
    """Return a law in Python as native code asks it, with the names of its trace besides TRACE_KEYS."""

def without_feed_forward(law: OuterLaw) -> OuterLaw: ...
def hold_at_goal(law: OuterLaw, enter_m: float, leave_m: float) -> OuterLaw: ...
def within_wheel_speed(law: OuterLaw, geometry: Any, omega_max_rad_s: float) -> OuterLaw: ...
def turned_axes(law: OuterLaw, angle_rad: float, more: list[tuple[int, int]]) -> OuterLaw:
    """Return the law in its axes; `more` are places of X and Y in its trace besides those of TRACE_KEYS."""

def turn_first(law: OuterLaw, missing_rad_s: float | None) -> OuterLaw: ...
def let_go(law: OuterLaw, geometry: Any, least_rad_s: float | None) -> OuterLaw: ...
def point(state: ReferenceState) -> Reference: ...
def circle(config: Any) -> Reference: ...
def waypoints(path: Any) -> Reference: ...
def stops(path: Any) -> Reference: ...
