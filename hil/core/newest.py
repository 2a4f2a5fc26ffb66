"""What follows from one object, kept while runs of that object follow each other."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TypeVar

Given = TypeVar("Given")
Found = TypeVar("Found")


def of_newest(function: Callable[[Given], Found]) -> Callable[[Given], Found]:
    """Return the function, asked anew only for another object than the call before.

    The object is one that nobody changes, as sections of the configuration are. What the function raises is
    not kept.
    """
    kept: list[tuple[Given, Found]] = []

    @functools.wraps(function)
    def give(given: Given) -> Found:
        for known, found in kept:
            if known is given:
                return found
        found = function(given)
        kept[:] = [(given, found)]
        return found

    return give
