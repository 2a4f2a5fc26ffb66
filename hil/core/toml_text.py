"""Values as TOML text: what `parse_toml` reads back is what was given."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Mapping, Sequence
from typing import Any

_PLAIN_KEY = re.compile(r"[A-Za-z0-9_-]+")


def toml_value(value: Any) -> str:
    """Return a value as TOML: text, a path, a number, true or false, a list or a table of them.

    Keys of a table whose value is None are left out: TOML has no word for it. Raises TypeError for anything
    else.
    """
    if hasattr(value, "tolist"):  # NumPy's
        value = value.tolist()
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, str):
        # JSON leaves DEL as it is and writes what lies beyond 16 bits in halves; TOML takes neither.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(int(value))
    if isinstance(value, float):
        return repr(float(value)) if math.isfinite(value) else f"{value:+}".replace("+nan", "nan")
    if isinstance(value, Mapping):
        rows = [
            f"{toml_key(key)} = {toml_value(one)}" for key, one in value.items() if one is not None
        ]
        return "{ " + ", ".join(rows) + " }"
    if isinstance(value, Sequence) and not isinstance(value, bytes | bytearray):
        return f"[{', '.join(map(toml_value, value))}]"
    raise TypeError(f"{value!r}: TOML has no {type(value).__name__}")


def toml_key(*parts: str) -> str:
    """Return a dotted key of these parts, quoted where a part is not plain; raises TypeError."""
    for part in parts:
        if not isinstance(part, str):
            raise TypeError(f"{part!r}: a key of a table is text")
    return ".".join(part if _PLAIN_KEY.fullmatch(part) else toml_value(part) for part in parts)
