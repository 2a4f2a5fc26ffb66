"""A path from a file: a reference whose points stand in a CSV beside the scenario."""

from __future__ import annotations

import csv
from importlib.resources import files
from pathlib import Path
from typing import Any

from hil.core.errors import BadInput
from hil.core.files import read_text

_HEAD = ["x_m", "y_m"]


def fill_path(tree: dict[str, Any], folder: Path | None) -> None:
    """Put the points of `reference.file` in its place, in place; raises BadInput.

    The file lies beside the scenario's; built-in scenarios have theirs in hil/data/paths. A record
    then holds the points themselves.
    """
    reference = tree.get("reference")
    if not isinstance(reference, dict) or "file" not in reference:
        return
    name = str(reference.pop("file"))
    if "points_m" in reference:
        raise BadInput(f"reference: gives points_m and file = {name!r}; give one of the two")
    reference["points_m"] = _points(name, folder)


def _points(name: str, folder: Path | None) -> list[tuple[float, float]]:
    where = str(folder / name) if folder is not None else name
    try:
        if folder is None:
            text = (files("hil") / "data" / "paths" / name).read_text(encoding="utf-8")
        else:
            text = read_text(folder / name)
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"reference.file = {name!r}: {where} cannot be read: {error}") from None
    rows = [row for row in csv.reader(text.splitlines()) if row]
    if not rows or [cell.strip() for cell in rows[0]] != _HEAD:
        raise BadInput(f"{where}: its first line must be x_m,y_m (world, m); give it that head")
    points = []
    for number, row in enumerate(rows[1:], start=2):
        try:
            x_m, y_m = (float(cell) for cell in row)
        except ValueError:
            raise BadInput(
                f"{where}: line {number} is {','.join(row)[:60]!r}: needs two numbers in m, x_m,y_m"
            ) from None
        points.append((x_m, y_m))
    return points
