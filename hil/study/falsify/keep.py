"""Counterexamples on disk: scenario files that replay them, and a deck that runs them all later."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hil.config.load import parse_value
from hil.core.errors import BadInput
from hil.core.files import read_toml, replace_file
from hil.study.falsify.box import Box
from hil.study.falsify.search import Trial

_PLAIN = re.compile(r"[A-Za-z0-9_-]+")


def write_scenario(
    folder: Path,
    base: str,
    overrides: Sequence[str],
    box: Box,
    trial: Trial,
    law: str,
    seed: int,
    against: str | None,
) -> Path:
    """Write a counterexample as a scenario that lies on the one it departs from; return its file.

    `overrides` are the values that were set on top of that one.
    """
    base = os.path.relpath(base, folder) if base.endswith(".toml") else base
    number = 1 + len(list(folder.glob(f"{box.scenario.name}-{_word(law)}-*.toml")))
    path = folder / f"{box.scenario.name}-{_word(law)}-{number}.toml"
    replace_file(
        path, scenario_text(path.stem, base, overrides, box, trial, law, seed, against).encode()
    )
    return path


def scenario_text(
    name: str,
    base: str,
    overrides: Sequence[str],
    box: Box,
    trial: Trial,
    law: str,
    seed: int,
    against: str | None,
) -> str:
    """Return the text of a counterexample's scenario file."""
    tree = box.tree_at(trial.point)
    over = f", which {against} meets" if against else ""
    lines = [
        f"# A counterexample of `hil falsify`: {trial.outcome.why}{over}.",
        f"# hil run THIS_FILE --outer {law} --camera pose --seed {seed}",
        f"base = {_text(base)}",
        f"name = {_text(name)}",
        f"description = {_text(f'{law} violates {trial.outcome.why} here, by {-trial.outcome.margin:.2g}')}",
        'camera_source = "pose"',
        f"control.outer = {_text(law)}",
    ]
    axes = {axis.key: axis for axis in box.axes}
    departures = box.departures(trial.point)
    for text in overrides:
        key, _, given = (part.strip() for part in text.partition("="))
        if key not in departures:
            lines.append(f"{_dotted(key)} = {_value(parse_value(given))}  # set for the search")
    for key, value in departures.items():
        if axes[key].push is None:
            lines.append(f"{_dotted(key)} = {value!r}  # usual: {axes[key].usual:g}")
    usual = box.scenario.model_dump(mode="json")["requirements"]
    for table, rows in (
        ("requirements", tree["requirements"] if tree["requirements"] != usual else ()),
        ("disturbances", tree["disturbances"]),
    ):
        for row in rows:
            lines += ["", f"[[{table}]]"]
            lines += [f"{k} = {_value(v)}" for k, v in row.items() if v is not None]
    return "\n".join(lines) + "\n"


def add_to_deck(folder: Path, scenario: Path, law: str, seed: int) -> Path:
    """Enter a scenario in the deck of its law and seed, made where needed; return the deck's file."""
    path = folder / f"deck-{_word(law)}-seed{seed}.toml"
    names = list(read_toml(path)["scenarios"]) if path.exists() else []
    names = list(dict.fromkeys([*(Path(name).name for name in names), scenario.name]))
    lines = [
        "# Counterexamples that `hil falsify` found; each fails until it is mended:",
        f"# hil experiment THIS_FILE --camera pose --seed {seed}",
        "scenarios = [",
        *(f"  {_text(f'./{name}')}," for name in names),
        "]",
        f"laws = [{_text(law)}]",
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
    return re.sub(r"[^A-Za-z0-9_-]+", "-", Path(law).stem)


def _dotted(key: str) -> str:
    head, _, rest = key.partition(".")
    if head == "mismatch":
        return f"mismatch.{_text(rest)}"
    return ".".join(part if _PLAIN.fullmatch(part) else _text(part) for part in key.split("."))


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{k} = {_value(v)}" for k, v in value.items()) + " }"
    return _text(value) if isinstance(value, str) else json.dumps(value)
