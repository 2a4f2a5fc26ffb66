"""What follows from one object, kept while runs of that object follow each other."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar

Given = TypeVar("Given")
Found = TypeVar("Found")

# Tables of an object, each with a copy of what it held.
_Held = list[tuple[Any, Any]]


def of_newest(
    function: Callable[[Given], Found], by: Callable[[Given], object] = lambda _given: None
) -> Callable[[Given], Found]:
    """Return the function, asked anew only for another object than the call before.

    The object is a section of the configuration. Its fields stay; what its tables and lists hold may be
    changed by whoever has it, in a notebook say, and the function is then asked anew. So it is where `by`
    gives another object: what a registry has under a name in the section. What is raised is not kept.
    """
    kept: list[tuple[Given, object, _Held, Found]] = []

    @functools.wraps(function)
    def give(given: Given) -> Found:
        made_by = by(given)
        for known, maker, held, found in kept:
            if known is given and maker is made_by and _hold(held):
                return found
        found = function(given)
        kept[:] = [(given, made_by, _held_by(given), found)]
        return found

    return give


def _hold(held: _Held) -> bool:
    """Say whether the tables hold what they held."""
    return all(table == copy for table, copy in held)


# What was looked through last: several functions are asked of one scenario, and of its robot.
_seen: list[tuple[Any, _Held]] = []
_MOST_SEEN = 2
# Of these nothing can be changed in place: most of what a section holds.
_PLAIN = frozenset((float, int, str, bool, type(None)))


def _held_by(given: Any) -> _Held:
    for known, held in _seen:
        if known is given and _hold(held):
            return held
    held = [(table, table.copy()) for table in _tables(given)]
    _seen[:] = [(given, held), *(one for one in _seen if one[0] is not given)][:_MOST_SEEN]
    return held


def _tables(value: Any) -> list[Any]:
    """Return what can be changed in place: of a section, and in what that holds."""
    found, left = [], [value]
    while left:
        one = left.pop()
        kind = type(one)
        if kind in _PLAIN:
            continue
        if issubclass(kind, dict):
            found.append(one)
            left.extend(one.values())
        elif issubclass(kind, list):
            found.append(one)
            left.extend(one)
        elif issubclass(kind, tuple):
            left.extend(one)
        elif hasattr(kind, "model_config"):
            left.extend(vars(one).values())
    return found
