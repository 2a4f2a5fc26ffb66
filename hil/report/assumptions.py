"""The conditions of a run as a table: every resolved number, its unit, and where it comes from.

Meanings are the descriptions that stand beside the bounds of each value; sources are the comments
of the built-in robot, condition and scenario files. Neither is written down a second time here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hil.config.fields import told
from hil.config.gains import Gains
from hil.config.scenario import Scenario
from hil.config.sources import file_sources
from hil.core.registries import OUTER_LAWS

# Kept out of the table: the runs' subject and laws, shown elsewhere, and gain sets not in use.
_ELSEWHERE = (
    "name", "description", "requirements", "control.gains", "control.outer", "board.LAW",
)  # fmt: skip


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
    sources = file_sources(str(scenario.get("name", "")))
    groups: dict[str, list[Assumption]] = {}
    for key, value in _leaves(scenario):
        if key.startswith(_ELSEWHERE) or value is None:
            continue
        top = key.split(".")[0] if "." in key else "run"
        text = f"{value:g}" if isinstance(value, float) else str(value)
        known = told(Scenario, key, scenario)
        groups.setdefault(top, []).append(
            Assumption(key, text, known.unit, known.meaning, sources.get(key, known.source))
        )
    return list(groups.items())


def gain_assumptions(outer: str, values: Mapping[str, Any], source: str) -> list[Assumption]:
    """Return the gains of one outer law as a manifest has them."""
    laws = {entry.name: entry for entry in OUTER_LAWS.entries()}
    model = laws[outer].settings if outer in laws else None
    return [
        Assumption(
            key,
            f"{value:g}" if isinstance(value, float) else str(value),
            *told(model or Gains, key, values)[:2],
            source,
        )
        for key, value in values.items()
    ]


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
