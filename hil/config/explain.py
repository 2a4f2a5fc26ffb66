"""Says in one line what a section of a file has that its model refuses: key, value with unit, limit."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ValidationError

from hil.config.fields import told

Tree = dict[str, Any]


def explain(model: type[BaseModel], error: ValidationError, tree: Tree) -> str:
    """Return key, value with unit, and limit of the first violation."""
    first = error.errors(include_url=False)[0]
    key = _key(first["loc"], tree)
    said = first["msg"].removeprefix("Value error, ")
    limit = said[:1].lower() + said[1:]
    if first["type"] == "missing":
        return f"{key}: missing; give a value"
    value = first["input"]
    more = error.error_count() - 1
    rest = f" (and {more} more)" if more else ""
    if isinstance(value, dict | list):
        return f"{key}: {limit}{rest}" if key else f"{limit}{rest}"
    unit = told(model, key, tree).unit
    if first["type"].startswith(("greater_than", "less_than")):
        limit = f"{limit} {unit}".strip()
    return f"{key} = {f'{_short(value)} {unit}'.strip()}: {limit}{rest}"


def _short(value: Any) -> str:
    """Return a value as a message shows it: of a very long one its beginning."""
    try:
        text = repr(value)
    except ValueError:  # an integer of thousands of digits
        return "a number of thousands of digits"
    return clipped(text)


def clipped(text: str) -> str:
    """Return a text as a line holds it: of a long one its beginning."""
    return text if len(text) <= 80 else f"{text[:77]}..."


def _key(loc: tuple[int | str, ...], tree: Tree) -> str:
    """Return the dotted name of a violation, without the union tags that the file does not have."""
    parts: list[str] = []
    node: Any = tree
    for part in loc:
        if isinstance(node, dict) and part not in node and node.get("kind") == part:
            continue
        parts.append(str(part))
        inside = isinstance(node, dict) and part in node
        inside = inside or (isinstance(node, list) and isinstance(part, int) and part < len(node))
        node = node[part] if inside else None
    return ".".join(parts)
