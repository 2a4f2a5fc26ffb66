"""The conditions of a run as a table: every resolved number, its unit, and where it comes from.

Meanings are the descriptions that stand beside the bounds of each value; sources are the comments
of the built-in robot, condition and scenario files. Neither is written down a second time here.
"""

from __future__ import annotations

import re
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from pydantic import BaseModel

from hil.config.load import unit_of
from hil.config.scenario import Scenario

_LINE = re.compile(r'^"?(?P<key>[\w.]+)"?\s*=\s*(?P<value>[^#]*?)\s*(?:#\s*(?P<note>.*))?$')
_TABLE = re.compile(r"^\[(?P<table>[\w.]+)\]")
# Kept out of the table: the runs' subject, shown elsewhere, and gain sets that are not in use.
_ELSEWHERE = ("name", "description", "requirements", "manoeuvre", "control.gains", "control.outer")


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
        item = Assumption(
            key, text, unit_of(key.split(".")[-1]), _meaning(key), sources.get(key, "")
        )
        groups.setdefault(top, []).append(item)
    return list(groups.items())


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


def _meaning(key: str) -> str:
    """Return the description of the value's field in the scenario's model, "" if it has none."""
    model: type[BaseModel] | None = Scenario
    parts = key.split(".")
    for depth, part in enumerate(parts):
        if part.isdigit():
            continue
        field = model.model_fields.get(part) if model is not None else None
        if field is None:
            return ""
        if depth == len(parts) - 1:
            return field.description or ""
        model = _section_in(field.annotation)
    return ""


def _section_in(annotation: Any) -> type[BaseModel] | None:
    """Return the section class in an annotation; None when there is none or more than one."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    if typing.get_origin(annotation) in {typing.Union, types.UnionType, typing.Annotated, tuple}:
        found = [_section_in(argument) for argument in typing.get_args(annotation)]
        sections = [section for section in found if section is not None]
        return sections[0] if len(sections) == 1 else None
    return None


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
            found[f"{prefix}{table}{entry['key']}"] = entry["note"]
    return found
