"""What there is to choose from: every registered thing and every file that ships, with its settings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from typing import Any

from hil.board.wheel_laws import SUMMARIES
from hil.config.fields import Setting, settings
from hil.config.load import builtin_names
from hil.core.errors import BadInput
from hil.core.figures import declared
from hil.core.files import parse_toml
from hil.core.registries import (
    BY_PLURAL,
    ESTIMATORS,
    FIGURES,
    LOCALISERS,
    OUTER_LAWS,
    REFERENCES,
    VEHICLES,
)
from hil.core.registry import BUILT_IN, Entry, Registry

# Where a scenario has the settings of a thing of a kind.
_SET_BY = {
    OUTER_LAWS.kind: "control.gains.tuned.{}.",
    ESTIMATORS.kind: "control.estimator_settings.",
    LOCALISERS.kind: "camera.localiser_settings.",
    REFERENCES.kind: "reference.",
    VEHICLES.kind: "robot.vehicle.",
}


@dataclass(frozen=True, slots=True)
class Item:
    """One thing: `settings` are its own values, `search` the box that a tuning may vary."""

    name: str
    summary: str
    origin: str = BUILT_IN
    settings: tuple[Setting, ...] = ()
    search: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    trace: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    unit: str = ""
    better: str = ""  # which way, of a figure
    set_by: str = ""

    def lines(self) -> Iterator[str]:
        """Yield a line for each setting, and for each term of its trace; a figure's unit."""
        if self.better:
            yield f"unit {self.unit or 'none'}, better: {self.better}"
        if self.settings:
            yield f"--set {self.set_by}KEY=VALUE, with KEY"
        for item in self.settings:
            unit = f" {item.unit}" if item.unit else ""
            bounds = f", {item.bounds()}" if item.bounds() else ""
            box = self.search.get(item.key)
            searched = f", searched {box[0]:g} to {box[2]:g}" if box else ""
            default = _short(item.default)
            if item.default is None:
                default = "may be left out" if item.optional else "must be given"
            yield f"  {item.key} ({default}{bounds}{searched}{unit}): {item.meaning}"
        for name, (unit, meaning) in self.trace.items():
            yield f"records {name}{f' ({unit})' if unit else ''}: {meaning}"

    def to_json(self) -> dict[str, Any]:
        """Return the item for a JSON document."""
        return {
            "name": self.name,
            "summary": self.summary,
            "origin": self.origin,
            "unit": self.unit,
            "better": self.better,
            "set_by": self.set_by,
            "settings": [
                {
                    "key": item.key,
                    "unit": item.unit,
                    "meaning": item.meaning,
                    "default": _plain(item.default),
                    "low": item.low,
                    "high": item.high,
                    "low_excluded": item.above,
                    "high_excluded": item.below,
                }
                for item in self.settings
            ],
            "search": {name: list(box) for name, box in self.search.items()},
            "trace": [
                {"name": name, "unit": unit, "meaning": meaning}
                for name, (unit, meaning) in self.trace.items()
            ],
        }


@dataclass(frozen=True, slots=True)
class Listing:
    """All of one kind; `failed` is what could not be loaded: package -> its own error in one line."""

    kind: str
    items: tuple[Item, ...]
    failed: Mapping[str, str] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return the listing for a JSON document."""
        return {"items": [item.to_json() for item in self.items], "failed": dict(self.failed)}


def listing(kind: str, from_files: Sequence[str] = ()) -> Listing:
    """Return all there is of a kind, as `hil list` names them; raises BadInput for a bad file."""
    if kind in BY_PLURAL:
        return _registered(kind, BY_PLURAL[kind], from_files)
    if from_files:
        raise BadInput(f"{from_files[0]}: {_not_listed(kind, from_files[0])}")
    if kind == "wheel-laws":
        items = [Item(name, f"{said}, on the board") for name, said in SUMMARIES.items()]
    else:
        items = [Item(name, _first_words(kind, name)) for name in builtin_names(kind)]
    return Listing(kind, tuple(items))


def _not_listed(kind: str, file: str) -> str:
    """Return why a file of one's own is not listed, and what tells of it instead."""
    if kind == "robots":
        return f"a robot's file is not listed but checked: hil check robot {file}"
    if kind == "scenarios":
        return f"a scenario's file is not listed but run: hil run {file}"
    return f"{kind} of one's own are not listed: no file is given here"


def _registered(kind: str, registry: Registry, from_files: Sequence[str]) -> Listing:
    for file in from_files:
        registry.get(file)
    entries = registry.entries()
    failed = dict(registry.failed)
    items = []
    for entry in entries:
        try:
            items.append(_item(entry, registry))
        except BadInput as error:  # a package's trace= that is none
            failed[entry.origin] = str(error)
    return Listing(kind, tuple(items), failed)


def _item(entry: Entry, registry: Registry) -> Item:
    own = entry.settings
    keys = tuple(settings(own)) if own is not None else ()
    if registry in (REFERENCES, VEHICLES):
        keys = tuple(key for key in keys if key.key != "kind")
    set_by = _SET_BY.get(registry.kind, "").format(entry.key)
    metric = declared(entry) if registry is FIGURES else None
    return Item(
        entry.name, entry.summary, entry.origin, keys, entry.search, entry.trace,
        unit=metric.unit if metric else "", better=metric.better if metric else "", set_by=set_by,
    )  # fmt: skip


def _first_words(kind: str, name: str) -> str:
    """Return what a file says of itself: its description, or its comment's first line's first sentence."""
    text = (files("hil") / "data" / kind / f"{name}.toml").read_text(encoding="utf-8")
    said = parse_toml(text, f"{name}.toml").get("description")
    if said:
        return str(said)
    lines = (line for line in text.splitlines() if not line.startswith("#:"))  # a note to editors
    first = next(lines, "")
    sentence, stop, _ = first.removeprefix("#").strip().partition(". ")
    return sentence + stop.strip() if first.startswith("#") else ""


def _short(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _plain(value: Any) -> Any:
    return value if value is None or isinstance(value, str | int | float | bool) else str(value)
