"""Counterexamples on disk: scenario files that replay them, and a deck that runs them all later."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil.config.load import load_scenario
from hil.core.errors import BadInput
from hil.core.files import read_toml, replace_file
from hil.core.registries import OUTER_LAWS
from hil.core.registry import is_file_name
from hil.core.toml_text import toml_key, toml_value
from hil.study.falsify.box import Box
from hil.study.falsify.search import Trial

USUAL_INNER = "asg-ism"
# What the file says of itself, and not of the run's conditions.
_OWN = ("name", "description", "camera_source")


@dataclass(frozen=True, slots=True)
class Asked:
    """What runs a counterexample was found with, by the names of the laws."""

    law: str
    seed: int
    inner: str = USUAL_INNER
    against: str | None = None

    @property
    def over(self) -> str:
        """Return the option that names the wheel law, where it is not the usual one."""
        return "" if self.inner == USUAL_INNER else f" --inner {self.inner}"

    def law_from(self, folder: Path) -> str:
        """Return the law's name as a file in `folder` has to give it: FILE.py:NAME of one from a file."""
        origin = OUTER_LAWS.get(self.law).origin
        return f"{os.path.relpath(origin, folder)}:{self.law}" if is_file_name(origin) else self.law


def write_scenario(folder: Path, base: str, box: Box, trial: Trial, asked: Asked) -> Path:
    """Write a counterexample as a scenario that lies on `base`, from which it departs; return its file."""
    stem = f"{box.scenario.name}-{_word(asked.law)}"
    taken = [
        int(found[1])
        for path in folder.glob(f"{stem}-*.toml")
        if (found := re.fullmatch(re.escape(stem) + r"-(\d+)", path.stem))
    ]
    path = folder / f"{stem}-{1 + max(taken, default=0)}.toml"
    replace_file(path, scenario_text(path, base, box, trial, asked).encode())
    return path


def scenario_text(path: Path, base: str, box: Box, trial: Trial, asked: Asked) -> str:
    """Return the text of a counterexample's scenario file that is to lie at `path`."""
    law = asked.law_from(path.parent)
    over = f", which {asked.against} meets" if asked.against else ""
    why, margin = trial.outcome.why, -trial.outcome.margin
    said = toml_value(f"{_word(asked.law)} violates {why} here, by {margin:.2g}")
    lines = [
        f"# A counterexample of `hil falsify`: {_one_line(why)}{over}.",
        f"# hil run THIS_FILE --camera pose --seed {asked.seed}{asked.over}",
        f"base = {toml_value(os.path.relpath(base, path.parent) if base.endswith('.toml') else base)}",
        f"name = {toml_value(path.stem)}",
        f"description = {said}",
        'camera_source = "pose"',
        f"control.outer = {toml_value(law)}",
    ]
    usual = {axis.key: axis.usual for axis in box.axes}
    tables: list[str] = []
    wanted = {k: v for k, v in box.tree_at(trial.point).items() if k not in _OWN}
    wanted["control"] = {k: v for k, v in wanted["control"].items() if k != "outer"}
    for parts, value in _differences(load_scenario(base).model_dump(mode="json"), wanted):
        if len(parts) == 1 and value and isinstance(value, list) and isinstance(value[0], dict):
            tables += _rows(parts[0], value)
            continue
        dotted = ".".join(parts)
        told = f"usual: {usual[dotted]:g}" if dotted in usual else "set for the search"
        lines.append(f"{toml_key(*parts)} = {toml_value(value)}  # {told}")
    return "\n".join([*lines, *tables]) + "\n"


def _differences(
    usual: Mapping[str, Any], wanted: Mapping[str, Any], above: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield what has to be said on top of one tree to come to another: the parts of a key, its value."""
    for key, value in wanted.items():
        parts, old = (*above, key), usual.get(key)
        if value == old or value is None:
            continue
        if isinstance(value, dict) and value:
            # A table of another kind takes the place of the one below, with all that it holds.
            same_kind = isinstance(old, dict) and value.get("kind") == old.get("kind")
            yield from _differences(old if same_kind and old else {}, value, parts)
        else:
            yield parts, value
    if above == ("mismatch",):  # what is no longer off is as believed
        yield from (((*above, key), 1.0) for key in usual if key not in wanted)


def _rows(name: str, rows: list[dict[str, Any]]) -> Iterator[str]:
    for row in rows:
        yield from ("", f"[[{name}]]")
        yield from (f"{toml_key(k)} = {toml_value(v)}" for k, v in row.items() if v is not None)


def add_to_deck(folder: Path, scenario: Path, asked: Asked) -> Path:
    """Enter a scenario in the deck of its laws and seed, made where needed; return the deck's file."""
    over = "" if asked.inner == USUAL_INNER else f"-over-{asked.inner}"
    path = folder / f"deck-{_word(asked.law)}{over}-seed{asked.seed}.toml"
    names = list(read_toml(path)["scenarios"]) if path.exists() else []
    names = list(dict.fromkeys([*(Path(name).name for name in names), scenario.name]))
    lines = [
        "# Counterexamples that `hil falsify` found; each fails until it is mended:",
        f"# hil experiment THIS_FILE --camera pose --seed {asked.seed}{asked.over}",
        "scenarios = [",
        *(f"  {toml_value(f'./{name}')}," for name in names),
        "]",
        f"laws = [{toml_value(asked.law_from(folder))}]",
    ]
    replace_file(path, ("\n".join(lines) + "\n").encode())
    return path


def claim_folder(folder: Path) -> None:
    """Make the folder; raises BadInput where it cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"--keep {folder}: cannot be made: {error.strerror}") from None


def _word(law: str) -> str:
    return re.sub(r"[^A-Za-z0-9_-]+", "-", law)


def _one_line(text: str) -> str:
    return " ".join(text.split())
