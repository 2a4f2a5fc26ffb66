"""Where the numbers of the built-in files come from: the comment beside each of them.

The comments are written once, for who reads the file; reports and listings show the same text.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from importlib.resources import files
from typing import Any

from hil.config.fields import Setting, settings
from hil.config.load import builtin_names, load_scenario
from hil.config.scenario import Scenario

_LINE = re.compile(r'^"?(?P<key>[\w.]+)"?\s*=\s*(?P<value>[^#]*?)\s*(?:#\s*(?P<note>.*))?$')
_TABLE = re.compile(r"^\[(?P<table>[\w.]+)\]")
_UNIT_FIRST = re.compile(r"^(?!not printed)[^;:,]{1,12}; ")


def built_in_settings(scenario: str = "scenario-1") -> Iterator[Setting]:
    """Yield every setting with the value of a built-in scenario as default, and its source."""
    tree = load_scenario(scenario).model_dump(mode="json")
    comments = file_sources(scenario)
    for setting in settings(Scenario):
        node: Any = tree
        for part in setting.key.split("."):
            node = node.get(part) if isinstance(node, dict) else None
        if node is None or setting.key == "mismatch" or _of_other_kind(setting, tree):
            node = setting.default
        source = comments.get(setting.key, setting.source)
        if not source and setting.key.startswith("control.gains.tuned."):
            source = "found by hil tune"
        yield replace(setting, default=node, source=source)


def _of_other_kind(setting: Setting, tree: dict[str, Any]) -> bool:
    table = tree.get(setting.key.partition(".")[0])
    return bool(setting.kind) and isinstance(table, dict) and table.get("kind") != setting.kind


def file_sources(scenario_name: str) -> dict[str, str]:
    """Return the comment beside each value of the built-in files, by dotted scenario key."""
    data = files("hil") / "data"
    found: dict[str, str] = {}
    for folder, prefix in (("robots", "robot."), ("labs", ""), ("scenarios", "")):
        for item in sorted((data / folder).iterdir(), key=lambda path: path.name):
            wanted = folder != "scenarios" or item.name == f"{scenario_name}.toml"
            if wanted and item.name.endswith(".toml"):
                found |= _comments(item.read_text(encoding="utf-8"), prefix)
    for name in builtin_names("gains"):
        text = (data / "gains" / f"{name}.toml").read_text(encoding="utf-8")
        found |= _comments(text, f"control.gains.{name}.")
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
