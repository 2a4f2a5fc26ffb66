"""Laws and references in native code, for runs that advance without a step back into Python each tick.

Their one source is Python: hil/control/native/outer/translate.py writes it as C++ while the extension modules
are built, operation by operation. What is asked for here is given only where the native code is that of the
objects it stands for: the sources are as they were translated, none of their functions and numbers has been
replaced, and the objects are of these classes themselves with nothing of their own. Every other law runs in
Python: one from elsewhere, a class derived from a built-in one, one whose gains change on the way. Native
code asks it each tick. Where a source was just edited, or a function replaced, all of a run's ticks are
Python's.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from functools import cache
from importlib import import_module
from operator import itemgetter
from pathlib import Path
from types import FunctionType
from typing import Any

from hil.control import AsgIsm as AsgBlock
from hil.control import _outer
from hil.control.laws import axes
from hil.control.laws.axes import TurnedAxes
from hil.control.laws.guard import GuardedLaw
from hil.control.laws.hold import HoldAtGoal
from hil.control.laws.let_go import LetGo
from hil.control.laws.parts import WithoutFeedForward
from hil.control.laws.turn_first import TurnFirst
from hil.control.laws.within import WithinWheelSpeed
from hil.control.references import Circle, Point, Stops, Waypoints
from hil.core import _native as core_native

_ROOT = Path(__file__).parents[2]
# What a module or a class has that native code has taken over.
_CACHED = type(cache(lambda: None))
_TAKEN = (FunctionType, _CACHED, staticmethod, classmethod, property, type, int, float, tuple)


def _owners() -> list[Any]:
    """Return the translated modules and the classes that they define."""
    paths = [path.removesuffix(".py").replace("/", ".") for path, _ in _outer.SOURCES]
    modules = [import_module(path) for path in paths]
    classes = [
        value
        for module in modules
        for value in vars(module).values()
        if isinstance(value, type) and value.__module__ == module.__name__
    ]
    return [*modules, *classes]


def _taken(owner: Any) -> dict[str, Any]:
    """Return the functions, classes and numbers of a module or class by their names."""
    return {
        name: value
        for name, value in vars(owner).items()
        if isinstance(value, _TAKEN) and not name.startswith("__")
    }


# What an owner has, how its parts are read from that (two at least: a tuple), and what they were.
_PARTS = [
    (vars(owner), itemgetter(*taken, "__doc__"), (*taken.values(), owner.__doc__))
    for owner in _owners()
    if (taken := _taken(owner))
]
_FUNCTIONS = [
    function
    for _, _, values in _PARTS
    for value in values
    if isinstance(function := getattr(value, "__wrapped__", value), FunctionType)
]
_CODES = [function.__code__ for function in _FUNCTIONS]
_CLASSES = {owner for owner in _owners() if isinstance(owner, type)}
_LAWS = {kind for kind in _CLASSES if kind.__name__ in _outer.LAWS}
_PLAIN = (float, int, bool, str, type(None), AsgBlock)


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
    """Say whether nobody has replaced a function or a number since."""
    try:
        parts = all(read(owned) == values for owned, read, values in _PARTS)
    except KeyError:  # one is gone
        return False
    return parts and [function.__code__ for function in _FUNCTIONS] == _CODES


def _is_plain(made: object) -> bool:
    """Say whether an object hides nothing of its class."""
    kind = type(made)
    return not any(hasattr(kind, name) for name in vars(made))


StandIn = Callable[[GuardedLaw], _outer.OuterLaw]


def native_forms(
    law: object,
    reference: object,
    own_terms: tuple[str, ...] = (),
    stand_in: StandIn | None = None,
) -> tuple[_outer.OuterLaw, _outer.Reference] | None:
    """Return both for a run, as `native_law` and `native_reference` give them; None where one has none.

    `stand_in` gives what stands for a law that can answer for several runs at once.
    """
    if not (_as_translated() and _is_whole()) or len(own_terms) > _outer.OWN_TERMS_MOST:
        return None
    found = _reference(reference)
    return None if found is None else (_law(law, own_terms, stand_in), found)


def native_law(law: object, own_terms: tuple[str, ...] = ()) -> _outer.OuterLaw | None:
    """Return the native law that does what `law` does from its next reset on; None where there is none.

    A law in Python under what holds for every law is asked from native code, which keeps `own_terms` of
    its trace.
    """
    if not (_as_translated() and _is_whole()) or len(own_terms) > _outer.OWN_TERMS_MOST:
        return None
    return _law(law, own_terms)


def _law(law: Any, own_terms: tuple[str, ...], stand_in: StandIn | None = None) -> _outer.OuterLaw:
    kind = type(law)
    around = _AROUND.get(kind)
    if around is not None and _is_plain(law):
        return around(_law(law._law, own_terms, stand_in), law)
    if kind is TurnedAxes and _is_plain(law) and (more := _own_vectors(own_terms)) is not None:
        return _outer.turned_axes(_law(law._law, own_terms, stand_in), law._angle_rad, more)
    if is_translated(law):
        return _outer.law(kind.__name__, law._gains, law._limits, law._d0, **_block_parts(law))
    if stand_in is not None and kind is GuardedLaw and law.makes_batches:
        return stand_in(law)
    return _outer.python_law(law, own_terms)


def trace_places(own_terms: tuple[str, ...]) -> dict[str, int]:
    """Return where in a trace native code has each name; one that translated laws have is theirs."""
    known = [*_outer.TRACE_KEYS, *own_terms]
    return {key: known.index(key) for key in known}


@cache
def _own_vectors(own_terms: tuple[str, ...]) -> list[tuple[int, int]] | None:
    """Return places of X and Y of vectors that are a law's own.

    None where X or Y of one may be a name that is not kept: such axes are turned in Python.
    """
    places = trace_places(own_terms)
    pairs = axes._pairs(tuple(places))
    paired = [name for pair in pairs for name in pair]
    own = places.keys() - set(_outer.TRACE_KEYS)
    alone = any(axes.is_of_a_vector(name) for name in own - set(paired))
    if alone or len(set(paired)) < len(paired):
        return None
    return [(places[x], places[y]) for x, y in pairs if {x, y} & own]


def is_translated(law: Any) -> bool:
    """Say whether a law is one of those that are written as native code, itself and whole."""
    return type(law) in _LAWS and _is_native(law)


def _is_native(value: Any) -> bool:
    """Say whether an object and all that it has are of classes that native code has, and hide nothing."""
    kind = type(value)
    if kind in _PLAIN:
        return True
    if kind is tuple:
        return all(map(_is_native, value))
    return kind in _CLASSES and _is_plain(value) and all(map(_is_native, vars(value).values()))


def _block_parts(law: Any) -> dict[str, bool]:
    """Return the parts that a law's sliding block leaves out."""
    block = getattr(law, "_block", None)
    return {
        name: True
        for name in ("without_kappa", "without_gamma")
        if block is not None and getattr(block, name)
    }


def _geometry(law: Any) -> Any:
    return law._vehicle.geometry


_AROUND: dict[type, Callable[[_outer.OuterLaw, Any], _outer.OuterLaw]] = {
    HoldAtGoal: lambda inner, law: _outer.hold_at_goal(inner, law._enter, law._leave),
    WithinWheelSpeed: lambda inner, law: _outer.within_wheel_speed(
        inner, _geometry(law), law._omega_max_rad_s
    ),
    TurnFirst: lambda inner, law: _outer.turn_first(inner, law._missing_rad_s),
    WithoutFeedForward: lambda inner, _: _outer.without_feed_forward(inner),
    LetGo: lambda inner, law: _outer.let_go(inner, _geometry(law), law._least_rad_s),
}


_REFERENCES = {Point, Circle, Waypoints, Stops}


def native_reference(reference: Any) -> _outer.Reference | None:
    """Return the native reference that is the same motion; None where there is none."""
    return _reference(reference) if _as_translated() and _is_whole() else None


def _reference(reference: Any) -> _outer.Reference | None:
    kind = type(reference)
    if kind not in _REFERENCES or not _is_plain(reference):
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
