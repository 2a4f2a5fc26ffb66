"""Laws and references in native code, for runs that advance without a step back into Python each tick.

Their one source is Python: hil/control/native/outer/translate.py writes it as C++ while the extension modules
are built, operation by operation. What is asked for here is given only where the native code is that of the
objects it stands for: the sources are as they were translated, none of their functions has been replaced, and
the objects are of these classes themselves with nothing of their own. Every other law runs in Python: one
from elsewhere, a class derived from a built-in one, a block put around its parts. Native code asks it each
tick. Where a source was just edited, or a function replaced, all of a run's ticks are Python's.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from types import FunctionType
from typing import Any

from hil import control
from hil.control import _outer
from hil.control.laws.asg_ism import AsgIsm
from hil.control.laws.chain import Chain
from hil.control.laws.hold import HoldAtGoal
from hil.control.laws.let_go import LetGo
from hil.control.laws.state_feedback import StateFeedback
from hil.control.laws.turn_first import TurnFirst
from hil.control.laws.within import WithinWheelSpeed
from hil.control.references import Circle, Point, Stops, Waypoints
from hil.control.vehicles.vehicle import TwoSided
from hil.core import _native as core_native

_ROOT = Path(__file__).parents[2]


def _functions() -> list[tuple[Any, str, object]]:
    """Return each function and class that the translated modules call, with whose it is and its name."""
    found: list[tuple[Any, str, object]] = []
    for path, _ in _outer.SOURCES:
        module = import_module(path.removesuffix(".py").replace("/", "."))
        for name, value in vars(module).items():
            if isinstance(value, FunctionType | type):
                found.append((module, name, value))
            if isinstance(value, type) and value.__module__ == module.__name__:
                found += [
                    (value, n, v) for n, v in vars(value).items() if isinstance(v, FunctionType)
                ]
    found.append((TwoSided, "wheels", TwoSided.wheels))
    return found


_FUNCTIONS = _functions()


@cache
def _as_translated() -> bool:
    """Say whether the sources are those that were translated, and hypotenuses the interpreter's."""
    try:
        hashes = [
            hashlib.sha256((_ROOT / path).read_bytes()).hexdigest() for path, _ in _outer.SOURCES
        ]
    except OSError:  # an installation without its sources is as it was built
        hashes = [known for _, known in _outer.SOURCES]
    same = all(math.hypot(a, b) == core_native.hypot(a, b) for a, b in _pairs())
    return same and hashes == [known for _, known in _outer.SOURCES]


def _pairs() -> list[tuple[float, float]]:
    """Return pairs of numbers over whose hypotenuses interpreters differ in the last place."""
    values = [math.ldexp(math.sin(k) + 1.5, k % 13 - 9) for k in range(64)]
    return [(a, b) for a in values for b in values[::3]]


def _is_whole() -> bool:
    """Say whether nobody has replaced a function since."""
    return all(vars(owner).get(name) is value for owner, name, value in _FUNCTIONS)


def _is_plain(made: object) -> bool:
    """Say whether an object hides nothing of its class."""
    kind = type(made)
    return not any(hasattr(kind, name) for name in vars(made))


def native_law(law: object, own_terms: tuple[str, ...] = ()) -> _outer.OuterLaw | None:
    """Return the native law that does what `law` does from its next reset on; None where there is none.

    A law in Python under what holds for every law is asked from native code, which keeps `own_terms` of
    its trace.
    """
    if not (_as_translated() and _is_whole()) or len(own_terms) > _outer.OWN_TERMS_MOST:
        return None
    return _law(law, own_terms)


def _law(law: Any, own_terms: tuple[str, ...]) -> _outer.OuterLaw:
    kind = type(law)
    around = _AROUND.get(kind)
    if around is not None and _is_plain(law):
        return around(_law(law._law, own_terms), law)
    if is_translated(law):
        return _outer.law(kind.__name__, law._gains, law._limits, law._d0)
    return _outer.python_law(law, own_terms)


def is_translated(law: Any) -> bool:
    """Say whether a law is one of those that are written as native code, itself and whole."""
    kind = type(law)
    if not (kind is StateFeedback or kind is AsgIsm) or not _is_plain(law):
        return False
    blocks = kind is StateFeedback or type(law._block) is control.AsgIsm
    return blocks and type(law._chain) is Chain and _is_plain(law._chain)


def _geometry(law: Any) -> Any:
    return law._vehicle.geometry


_AROUND: dict[type, Callable[[_outer.OuterLaw, Any], _outer.OuterLaw]] = {
    HoldAtGoal: lambda inner, law: _outer.hold_at_goal(inner, law._enter, law._leave),
    WithinWheelSpeed: lambda inner, law: _outer.within_wheel_speed(
        inner, _geometry(law), law._omega_max_rad_s
    ),
    TurnFirst: lambda inner, law: _outer.turn_first(inner, law._missing_rad_s),
    LetGo: lambda inner, law: _outer.let_go(inner, _geometry(law), law._least_rad_s),
}


def native_reference(reference: Any) -> _outer.Reference | None:
    """Return the native reference that is the same motion; None where there is none."""
    kind = type(reference)
    if not (_as_translated() and _is_whole()) or not _is_plain(reference):
        return None
    if kind is Point:
        return _outer.point(reference._state)
    if kind is Circle:
        return _outer.circle(reference._config)
    if kind is Waypoints:
        return _outer.waypoints(reference)
    if kind is Stops and all(type(leg) is Waypoints and _is_plain(leg) for leg in reference._legs):
        return _outer.stops(reference)
    return None
