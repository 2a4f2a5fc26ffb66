"""What is known of every value of a configuration: unit, bounds, default, meaning and source.

All of it stands on the fields of the sections (`hil.config.base.quantity`) and, for the board's
parameters, in the board's own table. Keys are dotted names as `--set` takes them.
"""

from __future__ import annotations

import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from hil.config.base import OpenSection, Section, extra_of
from hil.config.limits import board_table
from hil.config.own_settings import model_at

# Tables whose keys are not those of a section: the unit and meaning of every value in them.
_RATIO = "(ratio)"


class Told(NamedTuple):
    """What is known of one value; `source` is that of the default and empty for any other value."""

    unit: str = ""
    meaning: str = ""
    source: str = ""


_MISMATCH = Told(_RATIO, "true value / value the host believes")


@dataclass(frozen=True, slots=True)
class Setting:
    """One key that a file or `--set` may name.

    `low` and `high` are bounds in `unit` (None: none); `above` and `below` say that the bound itself
    is not allowed. `default` is None where a value must be given or may be left out (then it is
    `optional`), `kind` names the variant of a table
    that has the key, `choices` the words a name is chosen from. In a key, `*` counts list entries.
    """

    key: str
    unit: str
    meaning: str
    source: str
    default: Any
    low: float | None = None
    high: float | None = None
    above: bool = False
    below: bool = False
    kind: str = ""
    choices: tuple[str, ...] = ()
    optional: bool = False

    def bounds(self) -> str:
        """Return the bounds in words, "" without any: "0.5 to 50", "above 0, up to 5"."""
        low = "" if self.low is None else f"{'above ' if self.above else ''}{self.low:g}"
        high = "" if self.high is None else f"{'below ' if self.below else ''}{self.high:g}"
        if low and high:
            return f"{low} to {high}"
        return low if self.above else f"from {low}" if low else f"up to {high}" if high else ""


def settings(model: type[Section]) -> Iterator[Setting]:
    """Yield every setting of a section and of the sections in it, in the order of the file."""
    yield from _settings(model, "", "")


def _settings(model: type[BaseModel], prefix: str, kind: str) -> Iterator[Setting]:
    for name, field in model.model_fields.items():
        inside = sections_in(field.annotation)
        key = f"{prefix}{name}"
        if key == "board":
            yield from _board_settings()
        elif inside:
            part = f"{key}.*." if _is_list(field.annotation) else f"{key}."
            for section in _variants(inside):
                yield from _settings(section, part, _kind_of(section) or kind)
        else:
            yield _setting(model, name, key, field, kind)


def _variants(sections: Sequence[type[BaseModel]]) -> Iterator[type[BaseModel]]:
    """Yield the sections as they may stand in a file: of an open one, every model it may take."""
    for section in sections:
        if issubclass(section, OpenSection):
            yield from section.models()
        else:
            yield section


def _setting(model: type[BaseModel], name: str, key: str, field: FieldInfo, kind: str) -> Setting:
    unit = model.unit_of(name, {}) if issubclass(model, Section) else ""
    limits = {
        name: getattr(item, name)
        for item in field.metadata
        for name in ("ge", "gt", "le", "lt")
        if getattr(item, name, None) is not None
    }
    default = field.get_default(call_default_factory=True)
    return Setting(
        key=key,
        unit=_RATIO if key == "mismatch" else unit,
        meaning=field.description or ("of this table" if name == "kind" else ""),
        source=str(extra_of(field).get("source", "")),
        default=None if default is PydanticUndefined else default,
        low=limits.get("ge", limits.get("gt")),
        high=limits.get("le", limits.get("lt")),
        above="gt" in limits,
        below="lt" in limits,
        kind=kind,
        choices=_choices(field.annotation),
        optional=not field.is_required(),
    )


def _board_settings() -> Iterator[Setting]:
    for name, entry in board_table().items():
        yield Setting(
            key=f"board.{name}",
            unit=entry.unit,
            meaning=entry.doc,
            source="firmware_arduino/src/core/params.def",
            default=entry.default,
            low=entry.minimum,
            high=entry.maximum,
        )


def _choices(annotation: Any) -> tuple[str, ...]:
    if typing.get_origin(annotation) is Literal:
        return tuple(str(word) for word in typing.get_args(annotation))
    return ()


def _is_list(annotation: Any) -> bool:
    return typing.get_origin(annotation) in {tuple, list}


def _kind_of(section: type[BaseModel]) -> str:
    field = section.model_fields.get("kind")
    return str(field.default) if field and field.default is not PydanticUndefined else ""


def told(model: type[BaseModel], key: str, tree: Any) -> Told:
    """Return what is known of the value that a dotted key names in a tree."""
    parts = key.split(".")
    if issubclass(model, Section) and "board" in model.model_fields and parts[0] == "board":
        entry = board_table().get(".".join(parts[1:]))
        return Told(entry.unit, entry.doc) if entry else Told()
    if issubclass(model, Section) and "mismatch" in model.model_fields and parts[0] == "mismatch":
        return _MISMATCH
    own = model_at(tree, key)
    if own is not None and not key.startswith("reference."):
        table = tree
        for part in parts[:2]:
            table = _child(table, part)
        return told(own[0], own[1], table)
    section: type[BaseModel] | None = model
    field: FieldInfo | None = None
    owner, name, table = section, "", tree
    for part in parts:
        if not part.isdecimal():
            field = section.model_fields.get(part) if section is not None else None
            if field is None:
                return Told()
            owner, name, table = section, part, tree
        tree = _child(tree, part)
        if field is not None:
            inside = sections_in(field.annotation)
            section = next((one for one in inside if _is_kind(one, tree)), None)
            if section is not None and issubclass(section, OpenSection):
                section = section.model_for(tree)
    if field is None or owner is None or not issubclass(owner, Section):
        return Told()
    table = table if isinstance(table, Mapping) else {}
    is_default = name in table and table[name] == field.get_default(call_default_factory=True)
    source = str(extra_of(field).get("source", "")) if is_default else ""
    return Told(owner.unit_of(name, table), field.description or "", source)


def _child(node: Any, part: str) -> Any:
    if isinstance(node, Mapping):
        return node.get(part)
    if isinstance(node, list | tuple) and part.isdecimal() and int(part) < len(node):
        return node[int(part)]
    return None


def _is_kind(section: type[BaseModel], node: Any) -> bool:
    """Say whether a table belongs to a section: of a union, the one of its `kind`."""
    if OpenSection in section.__bases__:  # its model is found by the table itself
        return True
    kind = node.get("kind") if isinstance(node, Mapping) else None
    field = section.model_fields.get("kind")
    return kind is None or field is None or field.default in {kind, PydanticUndefined}


def sections_in(annotation: Any) -> list[type[BaseModel]]:
    """Return the section classes in an annotation, looking through unions and lists."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    found: list[type[BaseModel]] = []
    for argument in typing.get_args(annotation):
        found += sections_in(argument)
    return found
