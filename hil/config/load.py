"""Reads scenario files: built-in or TOML, with a base file, a robot file and `--set` overrides.

Every refusal is one BadInput line that names file, key, value with its unit, and the limit.
"""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from hil.config.scenario import Scenario
from hil.errors import BadInput

Tree = dict[str, Any]
Model = TypeVar("Model", bound=BaseModel)

# Longest first, so that m_s2 is not read as s2.
UNITS = {
    "rad_s2": "rad/s^2", "m_s3": "m/s^3", "m_s2": "m/s^2", "rad_s": "rad/s", "m_s": "m/s",
    "kg_m2": "kg m^2", "n_m_s": "N m s", "n_m": "N m", "bit_s": "bit/s", "baud": "bit/s",
    "ratio": "(ratio)", "rad": "rad", "deg": "deg", "kg": "kg", "mm": "mm", "px": "px", "hz": "Hz",
    "ohm": "ohm", "mv": "mV", "ms": "ms", "us": "us", "m": "m", "s": "s", "v": "V", "a": "A",
    "h": "H", "n": "N",
}  # fmt: skip


def unit_of(key: str) -> str:
    """Return the unit a key's name ends in ("" when it names none)."""
    for suffix in sorted(UNITS, key=len, reverse=True):
        if key.endswith(f"_{suffix}"):
            return UNITS[suffix]
    return ""


def builtin_names(kind: str) -> list[str]:
    """Return the names of the built-in files of one kind: "scenarios", "robots" or "decks"."""
    folder = files("hil") / "data" / kind
    return sorted(item.name[:-5] for item in folder.iterdir() if item.name.endswith(".toml"))


def load_scenario(name_or_path: str, overrides: Sequence[str] = ()) -> Scenario:
    """Return the scenario with every value resolved.

    `name_or_path` is a built-in name or a TOML file; `overrides` are KEY=VALUE texts with dotted
    names. Raises BadInput.
    """
    tree = read_tree(name_or_path, "scenarios")
    scenario = build(Scenario, tree, name_or_path)
    if not overrides:
        return scenario
    full = scenario.model_dump(mode="json")
    for text in overrides:
        set_value(full, text)
    return build(Scenario, full, "--set")


def read_tree(name_or_path: str, kind: str) -> Tree:
    """Return a file's tables laid over those of its `base`, with the robot file filled in."""
    text, where, folder = _read_text(name_or_path, kind)
    try:
        tree = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise BadInput(f"{where}: not valid TOML: {error}") from None
    base = tree.pop("base", None)
    if base is not None:
        tree = merge(read_tree(_beside(folder, str(base)), kind), tree)
    if isinstance(tree.get("robot"), Mapping) and "file" in tree["robot"]:
        own = dict(tree["robot"])
        robot_tree = read_tree(_beside(folder, str(own.pop("file"))), "robots")
        tree["robot"] = merge(robot_tree, own)
    return tree


def _beside(folder: Path | None, name: str) -> str:
    """Return the path of a file named beside another, or the built-in name as it is."""
    if folder is not None and name.endswith(".toml"):
        return str(folder / name)
    return name


def _read_text(name_or_path: str, kind: str) -> tuple[str, str, Path | None]:
    """Return text, name for messages, and folder (None for a built-in file)."""
    if name_or_path in builtin_names(kind):
        item = files("hil") / "data" / kind / f"{name_or_path}.toml"
        return item.read_text(encoding="utf-8"), item.name, None
    path = Path(name_or_path)
    one = kind.removesuffix("s")
    if not path.is_file():
        names = builtin_names(kind)
        near = difflib.get_close_matches(name_or_path, names, n=2)
        hint = f"did you mean {' or '.join(near)}?" if near else f"built in: {', '.join(names)}"
        raise BadInput(f"{one} {name_or_path!r}: no such file and no built-in {one}; {hint}")
    try:
        return path.read_text(encoding="utf-8"), str(path), path.parent
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"{path}: cannot be read: {error}") from None


def merge(below: Tree, above: Tree) -> Tree:
    """Return `below` with the keys of `above` laid over it; tables merge, lists replace.

    A table that changes its `kind` replaces the one below: its other keys belong to that kind.
    """
    result = dict(below)
    for key, value in above.items():
        old = result.get(key)
        if isinstance(old, dict) and isinstance(value, dict) and not _changes_kind(old, value):
            result[key] = merge(old, value)
        else:
            result[key] = value
    return result


def _changes_kind(old: Tree, new: Tree) -> bool:
    return "kind" in new and new["kind"] != old.get("kind")


def set_value(tree: Tree, text: str) -> None:
    """Apply one KEY=VALUE to the full tree in place; an unknown key is a BadInput with near names."""
    key, equals, value_text = text.partition("=")
    key = key.strip()
    if not equals:
        raise BadInput(f"--set {text!r}: needs KEY=VALUE, for example robot.mass_kg=3.1")
    names = dotted_names(tree)
    parent, leaf = _find(tree, key)
    if parent is None:
        near = difflib.get_close_matches(key, names, n=3, cutoff=0.5)
        same_end = [name for name in names if name.split(".")[-1] == key.split(".")[-1]]
        hint = " or ".join(dict.fromkeys([*same_end[:2], *near])) or f"top level: {', '.join(tree)}"
        raise BadInput(f"--set {key}: no such value; near: {hint}")
    parent[leaf] = parse_value(value_text)


def _find(tree: Tree, key: str) -> tuple[Any, Any]:
    """Return (container, index) that `key` names, or (None, None)."""
    node: Any = tree
    parts = key.split(".")
    for depth, part in enumerate(parts):
        index: Any = int(part) if isinstance(node, list) and part.isdigit() else part
        last = depth == len(parts) - 1
        if isinstance(node, dict) and (index in node or (last and node.get("__free__"))):
            pass
        elif not (isinstance(node, list) and isinstance(index, int) and index < len(node)):
            return None, None
        if last:
            return node, index
        node = node[index]
    return None, None


def parse_value(text: str) -> Any:
    """Return a TOML value, or the text itself where it is not one (so names need no quotes)."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text.strip()


def dotted_names(tree: Any, prefix: str = "") -> list[str]:
    """Return the dotted name of every value in the tree."""
    if isinstance(tree, dict):
        items: Any = tree.items()
    elif isinstance(tree, list):
        items = enumerate(tree)
    else:
        return [prefix]
    names: list[str] = []
    for key, value in items:
        names += dotted_names(value, f"{prefix}.{key}" if prefix else str(key))
    return names


def build(model: type[Model], tree: Tree, where: str) -> Model:
    """Return the validated section; the first violation becomes one BadInput line."""
    try:
        return model.model_validate(tree)
    except ValidationError as error:
        raise BadInput(f"{where}: {_explain(error, tree)}") from None


def _explain(error: ValidationError, tree: Tree) -> str:
    """Return key, value with unit, limit and, for an unknown key, near names."""
    first = error.errors(include_url=False)[0]
    path = [str(part) for part in first["loc"]]
    key = ".".join(path)
    if first["type"] == "extra_forbidden":
        siblings = _siblings(tree, path, error)
        near = difflib.get_close_matches(path[-1], siblings, n=3, cutoff=0.5)
        hint = f"near: {', '.join(near)}" if near else f"known here: {', '.join(siblings)}"
        return f"{key}: unknown key; {hint}"
    if first["type"] == "missing":
        return f"{key}: missing; give a value"
    unit = unit_of(path[-1]) if path else ""
    value = first["input"]
    shown = f"{value!r} {unit}".strip() if not isinstance(value, dict | list) else "this table"
    limit = first["msg"].removeprefix("Value error, ")
    limit = limit[:1].lower() + limit[1:]
    if first["type"] in {"greater_than", "greater_than_equal", "less_than", "less_than_equal"}:
        limit = f"{limit} {unit}".strip()
    more = error.error_count() - 1
    rest = f" (and {more} more)" if more else ""
    return f"{key} = {shown}: {limit}{rest}"


def _siblings(tree: Tree, path: list[str], error: ValidationError) -> list[str]:
    """Return the field names that the table holding an unknown key may have."""
    model: Any = Scenario if error.title == "Scenario" else None
    node: Any = tree
    for part in path[:-1]:
        node = node[int(part)] if isinstance(node, list) and part.isdigit() else _get(node, part)
        model = _field_model(model, part, node)
    return sorted(model.model_fields) if model is not None else []


def _get(node: Any, part: str) -> Any:
    return node.get(part, node) if isinstance(node, dict) else node


def _field_model(model: Any, part: str, node: Any) -> Any:
    """Return the section class behind field `part`, looking through lists and unions by kind."""
    if model is None:
        return None
    field = model.model_fields.get(part)
    if field is None:
        return model
    candidates = _models_in(field.annotation)
    kind = node.get("kind") if isinstance(node, dict) else None
    for candidate in candidates:
        default = candidate.model_fields["kind"].default if "kind" in candidate.model_fields else None
        if kind is not None and default == kind:
            return candidate
    return candidates[0] if candidates else None


def _models_in(annotation: Any) -> list[Any]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    found: list[Any] = []
    for argument in getattr(annotation, "__args__", ()):
        found += _models_in(argument)
    return found
