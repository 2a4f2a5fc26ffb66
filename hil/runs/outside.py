"""Whose fault an exception is: that of a file or package from outside, or the harness's own."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Sequence
from pathlib import Path

from hil.core.errors import RigFault
from hil.core.registry import BUILT_IN, Entry, in_one_line


def fault_of(error: BaseException, used: Sequence[tuple[str, Entry]]) -> RigFault | None:
    """Return the fault that names what came from outside and raised, None when nothing of it did.

    `used` are the things in use with their kinds; file and line are those the error passed last.
    """
    frames = traceback.extract_tb(error.__traceback__)
    for kind, entry in used:
        file = _file_of(entry)
        lines = [frame.lineno for frame in frames if file and frame.filename == file]
        if entry.origin != BUILT_IN and lines:
            place = f"{Path(file).name}, line {lines[-1]}"
            return RigFault(f"{kind} {entry.name} ({place}): raised {in_one_line(error)}")
    return None


def _file_of(entry: Entry) -> str:
    if entry.source is not None:
        return str(entry.source.path)
    module = sys.modules.get(getattr(entry.factory, "__module__", ""))
    return str(getattr(module, "__file__", "") or "")
