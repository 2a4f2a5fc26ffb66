"""Gains from a file, as `hil tune` writes one, in place of a set that ships."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from hil.config.gains import Gains, make_gains, read_gain_set
from hil.core.errors import BadInput
from hil.core.files import read_toml

GAIN_SET = "control.gain_set"
_LAID_ON = "tuned"  # what a file leaves out is as in this set


def read_gain_file(path: Path, named_by: str) -> Gains:
    """Return the gains of a file; laws that it leaves out have those of the set that ships as tuned.

    `named_by` says which option or key names it. Raises BadInput with one line.
    """
    tables = read_toml(path, named_by)
    try:
        return make_gains(read_gain_set(_LAID_ON) | tables)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"])) or "gains"
        said = first["msg"].removeprefix("Value error, ")
        raise BadInput(f"{named_by} {path}: {where}: {said}") from None


def lay_gains(tree: dict[str, Any], name: Any, folder: Path | None = None) -> bool:
    """Put the gains of the file `name` into the tree as its tuned set, in use; False for no file's name.

    They lie below the gains that the tree names itself where it is a file's, given with its `folder`. A
    record then holds the gains. Raises BadInput.
    """
    if not isinstance(name, str) or not name.endswith(".toml"):
        return False
    gains = read_gain_file((folder or Path()) / name, f"{GAIN_SET} =").model_dump()
    control = tree["control"]
    own = control.get("gains", {}) if folder is not None else {}
    said = own.get(_LAID_ON, {}) if isinstance(own, dict) else {}
    control["gain_set"] = _LAID_ON
    control["gains"] = {**control.get("gains", {}), _LAID_ON: _over(gains, said)}
    return True


def fill_gains(tree: dict[str, Any], folder: Path | None) -> None:
    """Do so where a scenario's file names one beside it, in place; raises BadInput."""
    control = tree.get("control")
    if folder is not None and isinstance(control, dict):
        lay_gains(tree, control.get("gain_set"), folder)


def _over(gains: dict[str, Any], said: dict[str, Any]) -> dict[str, Any]:
    """Return the tables with what a scenario says itself on top, value by value."""
    both = {
        key: {**gains[key], **table}
        for key, table in said.items()
        if isinstance(gains.get(key), dict) and isinstance(table, dict)
    }
    return {**gains, **said, **both}
