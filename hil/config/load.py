"""Reads scenario files: built-in or TOML, with a base file, a robot file and `--set` overrides.

Every refusal is one BadInput line that names file, key, value with its unit, and the limit.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from hil.config.explain import clipped, explain
from hil.config.gain_file import GAIN_SET, fill_gains, lay_gains
from hil.config.gains import shipped_gains
from hil.config.limits import board_defaults
from hil.config.own_settings import BY_NAME_KEY, PLACES, model_at, renew
from hil.config.path_file import fill_path
from hil.config.robot import RobotConfig
from hil.config.scenario import Scenario
from hil.config.with_robot import lifted, refuse_all_but_gains
from hil.core.errors import BadInput
from hil.core.files import is_file, parse_toml, read_text
from hil.core.registry import is_file_name

# Values that would be laid aside: the command's own option (in a campaign, its list) decides them.
_BY_OPTION = {"board.LAW": "--inner", "control.outer": "--outer"}

# Tables of a scenario that a file of their own may hold.
_PARTS = ("robot", "camera")
_SKID_STEER = "skid-steer"

Tree = dict[str, Any]
Model = TypeVar("Model", bound=BaseModel)


def builtin_names(kind: str) -> list[str]:
    """Return the names of the built-in files of one kind, such as "scenarios" or "robots"."""
    folder = files("hil") / "data" / kind
    if not folder.is_dir():
        return []
    return sorted(item.name[:-5] for item in folder.iterdir() if item.name.endswith(".toml"))


def load_scenario(name_or_path: str, overrides: Sequence[str] = ()) -> Scenario:
    """Return the scenario with every value resolved.

    `name_or_path` is a built-in name or a TOML file; `overrides` are KEY=VALUE texts with dotted
    names. Raises BadInput.
    """
    tree = read_tree(name_or_path, "scenarios")
    _fill_board(tree)
    _lay_over_shipped_gains(tree)
    scenario = build(Scenario, tree, name_or_path)
    return with_overrides(scenario, overrides)


def _lay_over_shipped_gains(tree: Tree) -> None:
    """Put the gains that ship below those that a scenario's file gives, in place."""
    control = tree.setdefault("control", {})
    if isinstance(control, dict) and isinstance(control.get("gains", {}), dict):
        control["gains"] = merge(shipped_gains(), control.get("gains", {}))


def with_overrides(scenario: Scenario, overrides: Sequence[str]) -> Scenario:
    """Return the scenario with KEY=VALUE texts applied; raises BadInput."""
    if not overrides:
        return scenario
    tree = scenario.model_dump(mode="json")
    files_named = [text for text in overrides if _part_of(text) is not None]
    for text in files_named:
        tree = _with_file(tree, text)
    if files_named:  # with every value that a file leaves at its default
        tree = build(Scenario, tree, "--set").model_dump(mode="json")
    # A name first: which settings there are, and what lies below them, depends on it.
    names = {*BY_NAME_KEY, GAIN_SET}
    for text in sorted(overrides, key=lambda text: text.partition("=")[0].strip() not in names):
        if text not in files_named:
            set_value(tree, text)
    _fill_board(tree)
    return build(Scenario, tree, "--set")


def _part_of(text: str) -> str | None:
    """Return the part whose file KEY=VALUE names, None where it names a value."""
    key = text.partition("=")[0].strip()
    return next((part for part in _PARTS if key == f"{part}.file"), None)


def _with_file(tree: Tree, text: str) -> Tree:
    """Return the tree with a robot's or camera's file laid over it, where KEY=VALUE names one."""
    part = _part_of(text)
    if part is None:
        return tree
    value = parse_value(text.partition("=")[2])
    below = _part_tree(str(value), part)
    return merge(tree, lifted(below) | {part: below})


def _part_tree(name_or_path: str, part: str, above: tuple[str, ...] = ()) -> Tree:
    """Return a robot's or camera's file; a robot that does not say its vehicle is a skid-steer."""
    tree = read_tree(name_or_path, f"{part}s", above)
    if part == "robot":
        tree.setdefault("vehicle", {"kind": _SKID_STEER})
        refuse_all_but_gains(tree, name_or_path)
    return tree


def _fill_board(tree: Tree) -> None:
    """Lay the board's table over the defaults, so that a run never depends on what a board had."""
    board = tree.get("board", {})
    if isinstance(board, dict):
        tree["board"] = board_defaults() | board


def read_tree(name_or_path: str, kind: str, above: tuple[str, ...] = ()) -> Tree:
    """Return a file's tables laid over those of its `base`, robot and camera files filled in.

    `above` are the files that lie on this one.

    Raises BadInput for a file that lies on itself, is not there, or is no TOML.
    """
    if name_or_path in above:
        raise BadInput(f"{name_or_path}: lies on itself: {' on '.join((*above, name_or_path))}")
    above = (*above, name_or_path)
    text, where, folder = _read_text(name_or_path, kind)
    tree = parse_toml(text, str(where))
    for part in _PARTS:
        if isinstance(tree.get(part), Mapping) and "file" in tree[part]:
            own = dict(tree[part])
            below = _part_tree(_beside(folder, str(own.pop("file"))), part, above)
            tree = merge(lifted(below), tree)
            tree[part] = merge(below, own)
    _set_files_beside(tree, folder)
    fill_path(tree, folder)
    fill_gains(tree, folder)
    base = tree.pop("base", None)
    if base is not None:
        _refuse_other_kind(where, str(base), kind)
        below = read_tree(_beside(folder, str(base)), _base_kind(str(base), kind), above)
        tree = merge(below, tree)
    return tree


# Values that name a registered thing, or a file that defines one.
_PLUGIN_KEYS = (
    ("control", "outer"), ("control", "estimator"), ("camera", "localiser"), ("reference", "kind"),
    ("vehicle", "kind"),
)  # fmt: skip


# Lists of outer laws (of a campaign, of a deck), and of figures.
_PLUGIN_LISTS = ("outer", "laws", "figures")


def _set_files_beside(tree: Tree, folder: Path | None) -> None:
    """Make the path of a law's file and the like, named relative to the scenario's, whole; in place."""
    if isinstance(tree.get("robot"), dict):
        _set_files_beside(tree["robot"], folder)
    for table, key in _PLUGIN_KEYS:
        node = tree.get(table)
        if folder is not None and isinstance(node, dict) and is_file_name(str(node.get(key, ""))):
            node[key] = str(folder.resolve() / node[key])
    for key in _PLUGIN_LISTS:
        names = tree.get(key)
        if folder is not None and isinstance(names, list):
            tree[key] = [
                str(folder.resolve() / name) if is_file_name(str(name)) else name for name in names
            ]
    for item in tree["requirements"] if isinstance(tree.get("requirements"), list) else ():
        if folder is not None and isinstance(item, dict) and is_file_name(str(item.get("metric"))):
            item["metric"] = str(folder.resolve() / item["metric"])
    if folder is not None and is_file_name(str(tree.get("plant", ""))):  # of a robot
        tree["plant"] = str(folder.resolve() / tree["plant"])


def _refuse_other_kind(where: str, base: str, kind: str) -> None:
    """Raise BadInput for a scenario's file where another kind is wanted; what it lies on tells."""
    if kind in {"scenarios", "labs"} or base in builtin_names(kind):
        return
    if base in {*builtin_names("scenarios"), *builtin_names("labs")}:
        hint = f"; name it in a deck: scenarios = [{where!r}]" if kind == "decks" else ""
        raise BadInput(f"{where}: is a scenario (base = {base!r}), a {_one(kind)} is needed{hint}")


def _one(kind: str) -> str:
    """Return the name of one of a kind of files."""
    return "box" if kind == "boxes" else kind.removesuffix("s")


def _base_kind(base: str, kind: str) -> str:
    """Return the kind of the file below: a scenario or lab lies on either."""
    if kind not in {"scenarios", "labs"}:
        return kind
    return "scenarios" if base in builtin_names("scenarios") else "labs"


def load_robot(name_or_path: str) -> RobotConfig:
    """Return a robot by its built-in name or file; raises BadInput."""
    tree = read_tree(name_or_path, "robots")
    lifted(tree)
    return build(RobotConfig, tree, name_or_path)


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
    one = _one(kind)
    if not is_file(path):
        names = builtin_names(kind)
        near = difflib.get_close_matches(name_or_path, names, n=2)
        known = f"; built in: {', '.join(names)}" if names else ""
        hint = f"; did you mean {' or '.join(near)}?" if near else known
        none = f" and no built-in {one}" if names else f"; give the path of a {one} file"
        raise BadInput(f"{one} {name_or_path!r}: no such file{none}{hint}")
    try:
        return read_text(path), str(path), path.parent
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"{path}: cannot be read: {error}") from None


def merge(below: Tree, above: Tree) -> Tree:
    """Return `below` with the keys of `above` laid over it; tables merge, lists replace.

    A table that changes its `kind` replaces the one below: its other keys belong to that kind. So
    does a robot of another kind of vehicle.
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
    if isinstance(new.get("vehicle"), dict) and "mass_kg" in old:
        below = old.get("vehicle", {})
        before = below.get("kind", _SKID_STEER) if isinstance(below, dict) else _SKID_STEER
        return bool(new["vehicle"].get("kind", before) != before)
    return "kind" in new and new["kind"] != old.get("kind")


def set_value(tree: Tree, text: str) -> None:
    """Apply one KEY=VALUE to the full tree in place; an unknown key is a BadInput with near names."""
    key, equals, value_text = text.partition("=")
    key = key.strip()
    if not equals:
        raise BadInput(
            f"--set {clipped(repr(text))}: needs KEY=VALUE, for example robot.mass_kg=3.1"
        )
    put_value(tree, key, parse_value(value_text))


def put_value(tree: Tree, key: str, value: Any) -> None:
    """Put a value where the dotted name says, in place; an unknown one is a BadInput."""
    if key in _BY_OPTION:
        raise BadInput(f"--set {key}: an option decides it; use {_BY_OPTION[key]} (or its list)")
    if key == GAIN_SET and lay_gains(tree, value):
        return
    place = BY_NAME_KEY.get(key)
    if place is not None and place.registry.get(str(value)).name != _find_value(tree, key):
        renew(tree, place, value)
    parent, leaf = _find(tree, key)
    if parent is None:
        parent, leaf = _setting_without_default(tree, key)
    if parent is None:
        names = [*dotted_names(tree), *_own_names(tree)]
        near = difflib.get_close_matches(key, names, n=3, cutoff=0.5)
        same_end = [
            name for name in names if name.split(".")[-1] == key.rsplit(".", maxsplit=1)[-1]
        ]
        hint = " or ".join(dict.fromkeys([*same_end[:2], *near])) or f"top level: {', '.join(tree)}"
        raise BadInput(f"--set {clipped(key)}: no such value; near: {hint}")
    parent[leaf] = value


def _find(tree: Tree, key: str) -> tuple[Any, Any]:
    """Return (container, index) that `key` names, or (None, None)."""
    node: Any = tree
    parts = key.split(".")
    for depth, part in enumerate(parts):
        rest = ".".join(parts[depth:])
        if isinstance(node, dict) and rest in node:  # a key may have dots itself (mismatch)
            return node, rest
        index: Any = int(part) if isinstance(node, list) and _is_index(part) else part
        last = depth == len(parts) - 1
        if isinstance(node, dict) and index in node:
            pass
        elif not (isinstance(node, list) and isinstance(index, int) and index < len(node)):
            return None, None
        if last:
            return node, index
        node = node[index]
    return None, None


def _find_value(tree: Tree, key: str) -> Any:
    parent, leaf = _find(tree, key)
    return None if parent is None else parent[leaf]


def _setting_without_default(tree: Tree, key: str) -> tuple[Any, Any]:
    """Return (table, key) of an own setting that has no value yet, or (None, None)."""
    own = model_at(tree, key)
    if own is None or own[1] not in own[0].model_fields:
        return None, None
    return _find_value(tree, key[: -len(own[1]) - 1]), own[1]


def _own_names(tree: Tree) -> list[str]:
    """Return the dotted name of every own setting of what the tree names, with a value or not."""
    names = []
    for place in PLACES:
        model = place.registry.get(str(_find_value(tree, place.name_key))).settings
        names += [f"{place.settings_key}.{name}" for name in (model.model_fields if model else ())]
    return names


def _is_index(part: str) -> bool:
    """Say whether a part of a dotted name counts into a list: a few plain digits."""
    return part.isascii() and part.isdecimal() and len(part) <= 9


def parse_value(text: str) -> Any:
    """Return a TOML value, or the text itself where it is not one (so names need no quotes)."""
    try:
        tree = parse_toml(f"value = {text}", text)
    except BadInput:
        return text.strip()
    # A line end in the text would begin another key.
    return tree["value"] if len(tree) == 1 else text.strip()


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
        raise BadInput(f"{where}: {explain(model, error, tree)}") from None
