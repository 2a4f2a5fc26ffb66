"""What may be chosen on the page, and every value of a scenario with unit, bounds, meaning and source.

`python -m hil.console.choices NAME` does it for a scenario of a file, whose laws are code, in a process of
its own.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hil.board.wheel_laws import WHEEL_LAWS
from hil.config.fields import Setting, settings, told
from hil.config.load import builtin_names, dotted_names, load_scenario
from hil.config.scenario import Scenario
from hil.console.folders import Folders
from hil.console.hand_over import floor_of
from hil.console.people import plain
from hil.core.errors import BadInput, HilError
from hil.core.figures import metric_of
from hil.core.files import read_bounded
from hil.tools.doctor import examine
from hil.tools.inventory import listing
from hil.tools.serve_folder import default_names

# A file of one's own is looked for so far below the folder where the console was started.
_DEPTH = 2
_FILES = 200
_TEXT_BYTES = 400_000
# Folders that hold thousands of files and none of a user's own.
_NOT_IN = {"node_modules", "build", "dist", "__pycache__", "site-packages", "tests"}


def choices(folders: Folders) -> dict[str, Any]:
    """Return everything there is to choose from for a run."""
    own = list(_own_files(folders))
    served = list(_served_twins())
    return {
        "scenarios": _named("scenarios") + [item for item in own if item["is"] == "scenario"],
        "laws": [
            {"name": item.name, "summary": item.summary, "origin": item.origin}
            for item in listing("laws").items
        ]
        + [item for item in own if item["is"] == "law"],
        "inner": sorted(WHEEL_LAWS, key=lambda name: name != "asg-ism"),
        "campaigns": _named("campaigns") + [item for item in own if item["is"] == "campaign"],
        "robots": _named("robots") + [item for item in own if item["is"] == "robot"],
        "cameras": [item for item in own if item["is"] == "camera"],
        "targets": _targets() + served,
        "served": served,
        "folder": str(folders.work),
    }


def _named(kind: str) -> list[dict[str, Any]]:
    return [
        {"name": item.name, "summary": item.summary, "origin": item.origin}
        for item in listing(kind).items
    ]


def _targets() -> list[dict[str, str]]:
    found = [
        {"name": "twin", "summary": "digital twin, on this machine"},
        {"name": "pil", "summary": "the board's own program in a simulator"},
    ]
    found += [
        {"name": f.hint.removeprefix("--on "), "summary": f.detail}
        for f in examine()
        if f.hint.startswith("--on serial:")
    ]
    return found


def _served_twins() -> Iterator[dict[str, str]]:
    """Yield the twins that `hil twin serve` serves under its usual names."""
    try:
        names = list(default_names())
    except BadInput:
        return
    for port, camera in names:
        if port.is_symlink() and camera.is_socket():
            yield {
                "name": f"serial:{port}",
                "camera": f"twin:{camera}",
                "summary": "served twin, in real time",
            }


def _own_files(folders: Folders) -> Iterator[dict[str, Any]]:
    """Yield the user's own laws, scenarios, robots, cameras and campaigns, by what stands in them."""
    seen = 0
    for base in (folders.work, folders.set_up):
        for path in _walk(base, _DEPTH):
            kind = _kind_of(path)
            if kind:
                seen += 1
                root = folders.work if base == folders.work else folders.root
                name = path.relative_to(root).as_posix()
                yield {"name": name, "summary": "a file of your own", "origin": name, "is": kind}
            if seen >= _FILES:
                return


def _walk(folder: Path, depth: int) -> Iterator[Path]:
    try:
        entries = sorted(folder.iterdir())
    except OSError:
        return
    for entry in entries:
        if entry.name.startswith(".") or entry.is_symlink():
            continue
        if entry.is_file() and entry.suffix in {".py", ".toml"}:
            yield entry
        elif entry.is_dir() and depth > 1 and entry.name not in _NOT_IN:
            yield from _walk(entry, depth - 1)


def _kind_of(path: Path) -> str:
    """Say what a file is by its text; nothing of it is run."""
    try:
        text = read_bounded(path, _TEXT_BYTES).decode("utf-8", errors="replace")
    except (OSError, HilError):
        return ""
    if path.suffix == ".py":
        return "law" if "outer_law(" in text and "import hil" in text else ""
    tables = {line.strip() for line in text.splitlines()}
    marks = (
        ("campaign", ("[grid]", "[random]", "[[together]]")),
        ("scenario", ("[reference]", "[[requirements]]", "[start]", "[control]")),
        ("camera", ("[intrinsics]", "[pose]", "[marks]", "[floor]")),
        ("robot", ("[vehicle]", "[motor]", "[bring_up]")),
    )
    return next((kind for kind, words in marks if tables & set(words)), "")


def describe(name: str) -> dict[str, Any]:
    """Return a scenario's values as the form shows them, and what the floor shows before a run.

    Raises BadInput.
    """
    scenario = load_scenario(name)
    tree = scenario.model_dump(mode="json")
    known = _settings_by_key()
    values = []
    for key in dotted_names(tree):
        value = _value(tree, key)
        if isinstance(value, dict | list):
            continue
        said = told(Scenario, key, tree)
        setting = _setting_of(known, key, tree)
        values.append(
            {
                "key": key,
                "value": value,
                "unit": said.unit.strip("()"),
                "meaning": said.meaning,
                "source": said.source,
                **(_bounds(setting) if setting else {}),
            }
        )
    found: dict[str, Any] = plain(
        {
            "name": scenario.name,
            "description": scenario.description,
            "law": scenario.control.outer,
            "camera_source": scenario.camera_source,
            "values": values,
            "floor": floor_of(scenario),
            "requirements": [
                {"text": _requirement(item), "metric": item["metric"]}
                for item in tree["requirements"]
            ],
        }
    )
    return found


def _requirement(item: dict[str, Any]) -> str:
    low = f"{item['min']:g} <= " if item["min"] is not None else ""
    high = f" <= {item['max']:g}" if item["max"] is not None else ""
    return f"{low}{item['metric']}{high} {metric_of(item['metric']).unit}".strip()


def _settings_by_key() -> dict[str, list[Setting]]:
    found: dict[str, list[Setting]] = {}
    for setting in settings(Scenario):
        found.setdefault(setting.key, []).append(setting)
    return found


def _setting_of(known: dict[str, list[Setting]], key: str, tree: Any) -> Setting | None:
    parts = key.split(".")
    general = ".".join("*" if part.isdecimal() else part for part in parts)
    found = known.get(key) or known.get(general) or []
    kind = _value(tree, ".".join([*parts[:-1], "kind"]))
    return next((one for one in found if one.kind in {"", kind}), found[0] if found else None)


def _value(tree: Any, key: str) -> Any:
    node = tree
    parts = key.split(".")
    for depth, part in enumerate(parts):
        if isinstance(node, dict):
            rest = ".".join(parts[depth:])
            if rest in node:
                return node[rest]
            node = node.get(part)
        elif isinstance(node, list) and part.isdecimal() and int(part) < len(node):
            node = node[int(part)]
        else:
            return None
    return node


def _bounds(setting: Setting) -> dict[str, Any]:
    return {
        "low": setting.low,
        "high": setting.high,
        "above": setting.above,
        "below": setting.below,
        "bounds": setting.bounds(),
        "choices": list(setting.choices),
    }


def is_built_in(name: str) -> bool:
    """Say whether a scenario ships with the harness."""
    return name in builtin_names("scenarios")


def main() -> int:
    """Print what `describe` says of a scenario."""
    try:
        print(json.dumps(describe(sys.argv[1])))
    except HilError as error:
        print(f"hil: {error}", file=sys.stderr)
        return error.exit_status
    return 0


if __name__ == "__main__":
    sys.exit(main())
