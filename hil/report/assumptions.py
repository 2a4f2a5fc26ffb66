"""The conditions of a run as a table: every resolved number, its unit, and where it comes from.

Meanings are the descriptions that stand beside the bounds of each value; sources are the comments
of the built-in robot, condition and scenario files. Neither is written down a second time here.
"""

from __future__ import annotations

import functools
import re
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from hil.board._firmware import Parameter, parameter_table
from hil.config.base import OpenSection
from hil.config.load import UNITS, unit_of
from hil.config.scenario import Scenario
from hil.core.registries import OUTER_LAWS

_LINE = re.compile(r'^"?(?P<key>[\w.]+)"?\s*=\s*(?P<value>[^#]*?)\s*(?:#\s*(?P<note>.*))?$')
_TABLE = re.compile(r"^\[(?P<table>[\w.]+)\]")
_UNIT_FIRST = re.compile(r"^[^;:,]{1,12}; ")
_DESCRIBED = re.compile(r"^(?P<unit>[^\s,]+)(?: at [^,]*)?, ")
# Kept out of the table: the runs' subject and laws, shown elsewhere, and gain sets not in use.
_ELSEWHERE = (
    "name", "description", "requirements", "control.gains", "control.outer", "board.LAW",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Assumption:
    """One value: dotted key, value and unit as text, what it means and where it comes from."""

    key: str
    value: str
    unit: str
    meaning: str
    source: str


def assumptions(scenario: Mapping[str, Any]) -> list[tuple[str, list[Assumption]]]:
    """Return every value of a resolved scenario, grouped by its top table, in file order."""
    sources = _sources(str(scenario.get("name", "")))
    groups: dict[str, list[Assumption]] = {}
    for key, value in _leaves(scenario):
        if key.startswith(_ELSEWHERE) or value is None:
            continue
        top = key.split(".")[0] if "." in key else "run"
        text = f"{value:g}" if isinstance(value, float) else str(value)
        unit, meaning = _told(top, key, scenario)
        groups.setdefault(top, []).append(
            Assumption(key, text, unit, meaning, sources.get(key, ""))
        )
    return list(groups.items())


def gain_assumptions(outer: str, values: Mapping[str, Any], source: str) -> list[Assumption]:
    """Return the gains of one outer law as a manifest has them."""
    laws = {entry.name: entry for entry in OUTER_LAWS.entries()}
    settings = laws[outer].settings if outer in laws else None
    fields = settings.model_fields if settings is not None else {}
    return [
        Assumption(
            key,
            f"{value:g}" if isinstance(value, float) else str(value),
            *_split(fields[key].description or "" if key in fields else "", ""),
            source,
        )
        for key, value in values.items()
    ]


def _told(top: str, key: str, scenario: Mapping[str, Any]) -> tuple[str, str]:
    """Return unit and meaning of a value."""
    name = key.rsplit(".", maxsplit=1)[-1]
    if top == "mismatch":
        return "(ratio)", "true value / value the host believes"
    if top == "board" and name in _board_parameters():
        parameter = _board_parameters()[name]
        return parameter.unit, parameter.doc
    return _split(_meaning(key, scenario), unit_of(name))


def _split(description: str, unit: str) -> tuple[str, str]:
    """Return unit and meaning of a description, which may begin with its unit: "1/s^3, on delta1"."""
    found = _DESCRIBED.match(description)
    if found and (found["unit"] in UNITS.values() or set("/^") & set(found["unit"])):
        return found["unit"], description[found.end() :]
    return unit, description


@functools.cache
def _board_parameters() -> dict[str, Parameter]:
    return {parameter.name: parameter for parameter in parameter_table()}


def _leaves(tree: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield (dotted key, value); a list of plain values is one value, an empty table none."""
    if isinstance(tree, Mapping):
        for key, value in tree.items():
            yield from _leaves(value, f"{prefix}.{key}" if prefix else str(key))
    elif isinstance(tree, Sequence) and any(isinstance(item, Mapping) for item in tree):
        for index, item in enumerate(tree):
            yield from _leaves(item, f"{prefix}.{index}")
    elif not (isinstance(tree, Sequence) and not isinstance(tree, str) and not tree):
        yield prefix, tree


def _meaning(key: str, scenario: Mapping[str, Any]) -> str:
    """Return the description of the value's field in the scenario's model, "" if it has none."""
    model: type[BaseModel] | None = Scenario
    node: Any = scenario
    parts = key.split(".")
    for depth, part in enumerate(parts):
        if part.isdigit():
            node = node[int(part)]
            continue
        field = model.model_fields.get(part) if model is not None else None
        if field is None:
            return ""
        if depth == len(parts) - 1:
            return field.description or ""
        node = node[part]
        sections = _sections_in(field.annotation)
        model = next((one for one in sections if _is_kind(one, node)), None)
        if model is not None and issubclass(model, OpenSection):
            model = model.model_for(node)
    return ""


def _is_kind(section: type[BaseModel], node: Any) -> bool:
    """Say whether a table belongs to a section: of a union, the one of its `kind`."""
    kind = node.get("kind") if isinstance(node, Mapping) else None
    field = section.model_fields.get("kind")
    return kind is None or field is None or field.default in {kind, PydanticUndefined}


def _sections_in(annotation: Any) -> list[type[BaseModel]]:
    """Return the section classes in an annotation, looking through unions and lists."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    found: list[type[BaseModel]] = []
    for argument in typing.get_args(annotation):
        found += _sections_in(argument)
    return found


def _sources(scenario_name: str) -> dict[str, str]:
    """Return the comment beside each value of the built-in files, by dotted scenario key."""
    data = files("hil") / "data"
    found: dict[str, str] = {}
    for folder, prefix in (("robots", "robot."), ("labs", ""), ("scenarios", "")):
        for item in sorted((data / folder).iterdir(), key=lambda path: path.name):
            wanted = folder != "scenarios" or item.name == f"{scenario_name}.toml"
            if wanted and item.name.endswith(".toml"):
                found |= _comments(item.read_text(encoding="utf-8"), prefix)
    return found


def _comments(text: str, prefix: str) -> dict[str, str]:
    table, found = "", {}
    for line in text.splitlines():
        if header := _TABLE.match(line):
            table = f"{header['table']}."
        elif (entry := _LINE.match(line)) and entry["note"]:
            # A comment begins with the unit, which the table of the report shows by itself.
            found[f"{prefix}{table}{entry['key']}"] = _UNIT_FIRST.sub("", entry["note"])
    return found
