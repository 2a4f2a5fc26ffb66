"""JSON Schemas of the project's TOML files, made from the sections, so that editors complete and check them.

A file may lie on another one (`base`, `file`), which gives what it leaves out: so nothing is required but in
the entries of lists. What depends on several values (and on other files) only the commands check.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pydantic import BaseModel

from hil.config.base import OpenSection
from hil.config.fields import sections_in
from hil.config.gains import Gains

Tree = dict[str, Any]
DIALECT = "https://json-schema.org/draft/2020-12/schema"
_FILE_BELOW = {
    "type": "string",
    "description": "built-in name or TOML file that this table lies on",
}
_TABLE_IN_TABLE = {
    "type": "object",
    "not": {"anyOf": [{"required": ["first"]}, {"required": ["kind"]}]},
}
_LEFT_OUT = ("title", "source", "unit")


def schema_of(
    model: type[BaseModel],
    title: str,
    lies_on_file: Sequence[str] = (),
    *,
    dotted: Sequence[str] = (),
    based: bool = True,
) -> Tree:
    """Return the schema of a file.

    `lies_on_file` names the tables (by section) that take a key `file`, `dotted` those at the top whose
    dotted keys may be tables in tables; `based` allows a key `base`.
    """
    tree = _whole(model)
    definitions: Tree = tree.pop("$defs", {})
    for section in _open_sections(model):
        definitions |= _variants(section)
    for name in lies_on_file:
        definitions[name]["properties"]["file"] = _FILE_BELOW
    for name in dotted:
        field = tree["properties"][name]
        field["additionalProperties"] = {"anyOf": [field["additionalProperties"], _TABLE_IN_TABLE]}
    if based:
        tree["properties"] = {"base": _FILE_BELOW} | tree["properties"]
    listed = set(_listed(tree)) | set(_listed(definitions))
    for name, definition in definitions.items():
        if name not in listed:
            definition.pop("required", None)
    tree.pop("required", None)
    whole: Tree = {"$schema": DIALECT, "title": title} | _tidy(tree)
    return whole | {"$defs": _tidy(definitions)} if definitions else whole


def _whole(model: type[BaseModel]) -> Tree:
    """Return a model's schema; of an open section, that of the one model it has."""
    if issubclass(model, OpenSection):
        (model,) = model.models()
    tree: Tree = model.model_json_schema()
    if issubclass(model, Gains):
        tree["additionalProperties"] = {"type": "object"}  # gains of a law from a file
    return tree


def _open_sections(model: type[BaseModel]) -> Iterator[type[OpenSection]]:
    for field in model.model_fields.values():
        for section in sections_in(field.annotation):
            if issubclass(section, OpenSection):
                yield section
            yield from _open_sections(section)


def _variants(section: type[OpenSection]) -> Tree:
    """Return definitions for every model that an open section may take, and for itself."""
    models = section.models()
    if len(models) == 1:
        tree = _whole(section)
        inside: Tree = tree.pop("$defs", {})
        return inside | {section.__name__: tree}
    found: Tree = {}
    for model in models:
        tree = model.model_json_schema()
        found |= tree.pop("$defs", {}) | {model.__name__: tree}
    choices: list[Tree] = [{"$ref": f"#/$defs/{model.__name__}"} for model in models]
    own = {
        "kind": {"type": "string", "pattern": r"\.py(:\w+)?$", "description": "a file of one's own"}
    }
    choices.append({"type": "object", "properties": own, "required": ["kind"]})
    return found | {section.__name__: {"anyOf": choices}}


def _listed(node: Any) -> Iterator[str]:
    """Yield the names of definitions that stand in lists."""
    if isinstance(node, Mapping):
        items = node.get("items")
        if isinstance(items, Mapping) and "$ref" in items:
            yield str(items["$ref"]).rpartition("/")[2]
        for child in node.values():
            yield from _listed(child)
    elif isinstance(node, list):
        for child in node:
            yield from _listed(child)


def _tidy(node: Any) -> Any:
    """Return a schema without what only pydantic reads; a number's unit goes into its description."""
    if isinstance(node, list):
        return [_tidy(child) for child in node]
    if not isinstance(node, Mapping):
        return node
    tidy = {
        key: _tidy(value)
        for key, value in node.items()
        if not (key in _LEFT_OUT and isinstance(value, str)) and not _not_json(value)
    }
    unit = node.get("unit")
    if isinstance(unit, str) and unit:
        tidy["description"] = f"{node.get('description', '')} [{unit.strip('()')}]".strip()
    return tidy


def _not_json(value: Any) -> bool:
    return isinstance(value, float) and not math.isfinite(value)
