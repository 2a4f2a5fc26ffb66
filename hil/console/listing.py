"""The list of records: what each was and how it ended, read once and kept.

A record is known by the time and size of its manifest, so that a list of thousands is made from an
index in the console's own folder, and only what is new is opened.
"""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from hil.console.folders import BIN, Folders
from hil.core.errors import BadInput
from hil.core.files import RECORD_BYTES, replace_file
from hil.record import layout
from hil.record.manifest import read_manifest

_INDEX = "index.json"
_FORM = 1


@dataclass(frozen=True, slots=True)
class Item:
    """One record in the list; `verdict` is held, failed, fault, interrupted, running or damaged."""

    name: str
    scenario: str
    law: str
    inner: str
    target: str
    seed: int
    start: str
    verdict: str
    detail: str
    failed: tuple[str, ...] = ()
    command: str = ""


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a list is filtered by; "" asks for nothing. Dates are YYYY-MM-DD, both within."""

    text: str = ""
    scenario: str = ""
    law: str = ""
    verdict: str = ""
    since: str = ""
    until: str = ""

    def holds(self, item: Item) -> bool:
        """Say whether an item is wanted."""
        day = item.start[:10]
        said = f"{item.name} {item.scenario} {item.law} {item.target} {item.detail}".lower()
        return (
            all(word in said for word in self.text.lower().split())
            and self.scenario in {"", item.scenario}
            and self.law in {"", item.law}
            and self.verdict in {"", item.verdict}
            and (not self.since or day >= self.since)
            and (not self.until or day <= self.until)
        )


class Listing:
    """All records of a folder, the newest first."""

    def __init__(self, folders: Folders) -> None:
        self._folders = folders
        self._known: dict[str, tuple[int, int, Item]] = {}
        self._one_at_a_time = threading.Lock()
        self._load()

    def items(self) -> list[Item]:
        """Return every record there is now, the newest first."""
        with self._one_at_a_time:
            return self._items()

    def _items(self) -> list[Item]:
        found, changed = {}, False
        for path in self._folders.records():
            name = self._folders.name_of(path)
            try:
                state = os.stat(path / layout.MANIFEST)
            except OSError:
                continue
            known = self._known.get(name)
            if known is None or known[:2] != (state.st_mtime_ns, state.st_size):
                changed = True
                known = (state.st_mtime_ns, state.st_size, read_item(path, name))
            found[name] = known
        if changed or len(found) != len(self._known):
            self._known = found
            self._save()
        return sorted((item for _, _, item in found.values()), key=_newest, reverse=True)

    def page(self, wanted: Wanted, offset: int, limit: int) -> dict[str, Any]:
        """Return one page of the list, and what may be filtered by."""
        items = self.items()
        chosen = [item for item in items if wanted.holds(item)]
        return {
            "total": len(items),
            "found": len(chosen),
            "items": [asdict(item) for item in chosen[offset : offset + limit]],
            "scenarios": sorted({item.scenario for item in items}),
            "laws": sorted({item.law for item in items}),
            "bin": binned(self._folders.root),
        }

    def _load(self) -> None:
        with suppress(OSError, ValueError, TypeError, KeyError):
            tree = json.loads((self._folders.own / _INDEX).read_bytes())
            if tree["form"] == _FORM:
                self._known = {
                    name: (mtime, size, Item(**item | {"failed": tuple(item["failed"])}))
                    for name, (mtime, size, item) in tree["records"].items()
                }

    def _save(self) -> None:
        records = {name: [m, size, asdict(item)] for name, (m, size, item) in self._known.items()}
        tree = {"form": _FORM, "records": records}
        with suppress(OSError):  # an index: it is made anew
            replace_file(self._folders.own / _INDEX, json.dumps(tree).encode())


def _newest(item: Item) -> tuple[str, str]:
    return item.start, item.name


def binned(root: Path) -> list[str]:
    """Return the names of the records in the bin."""
    folder = root / BIN
    if not folder.is_dir():
        return []
    return sorted(file.name.removesuffix(".from") for file in folder.glob("*.from"))


def _ended(path: Path) -> dict[str, Any]:
    """Return how a record ended that says it is running, as far as it can be read."""
    try:
        return read_manifest(path).model_dump(include={"outcome", "outcome_detail"})
    except BadInput:
        return {}


def read_item(path: Path, name: str) -> Item:
    """Return what the list says of a record; one that cannot be read is damaged."""
    try:
        tree = _tree(path / layout.MANIFEST)
        scenario = tree["scenario"] if isinstance(tree["scenario"], dict) else {}
        if tree.get("outcome", "running") == "running":  # or whoever wrote it is gone
            tree = {**tree, **_ended(path)}
        outcome = str(tree.get("outcome", "running"))
        failed = _failed(path) if outcome == "complete" else ()
        verdict = outcome if outcome != "complete" else "failed" if failed else "held"
        return Item(
            name=name,
            scenario=str(scenario.get("name", "")),
            law=str(tree.get("outer", "")),
            inner=str(tree.get("inner", "")),
            target=str(tree.get("target", "")),
            seed=int(tree.get("seed", 0)),
            start=str(tree.get("start_time_utc", "")),
            verdict=verdict,
            detail=str(tree.get("outcome_detail", "")),
            failed=failed,
            command=str(tree.get("command", "")),
        )
    except (
        OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError
    ) as error:  # fmt: skip
        return Item(name, "", "", "", "", 0, "", "damaged", f"{type(error).__name__}: {error}")


def _failed(path: Path) -> tuple[str, ...]:
    """Return the figures whose requirements did not hold."""
    listed: Sequence[Any] = _tree(path / layout.FIGURES).get("requirements", [])
    return tuple(str(item["metric"]) for item in listed if not item["holds"])


def _tree(file: Path) -> dict[str, Any]:
    if file.stat().st_size > RECORD_BYTES:
        raise ValueError("larger than any record's")
    found: dict[str, Any] = json.loads(file.read_bytes())
    return found
