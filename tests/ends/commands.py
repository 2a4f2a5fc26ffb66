"""The commands that are ended at drawn instants: how they are called, and what they leave."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

HIL = [sys.executable, "-m", "hil"]
DISK, OUT = "disk", "out"  # what is written goes to DISK/OUT in a folder
_CAMPAIGN = """scenario = "scenario-1"
set = ["duration_s=2"]
seeds = 6
[grid]
"link.latency_jitter_s" = [0.0, 0.02]
"""


@dataclass(frozen=True, slots=True)
class Command:
    """One command: its words before `--out`, and about how long it takes on an idle machine.

    `kept` returns what of its folder has to be there unchanged after the same command went on; None
    for a command that does not go on.
    """

    name: str
    words: tuple[str, ...]
    whole_s: float
    kept: Callable[[Path], set[str]] | None = None
    suffix: str = ""

    def line(self, folder: Path) -> list[str]:
        """Return the command line, for that folder."""
        return [*HIL, *self.words, "--out", str(self.out(folder))]

    def out(self, folder: Path) -> Path:
        """Return where its results go."""
        return folder / DISK / f"{OUT}{self.suffix}"


def prepare(folder: Path) -> None:
    """Write what the commands read."""
    (folder / DISK).mkdir()
    (folder / "campaign.toml").write_text(_CAMPAIGN)


def records(folder: Path) -> list[Path]:
    """Return the records below a folder, those set aside left out."""
    found = sorted(folder.glob(f"{DISK}/**/manifest.json"))
    return [path.parent for path in found if "set-aside" not in path.parts]


def outcome(record: Path) -> str:
    """Return how a record says it ended."""
    return str(json.loads((record / "manifest.json").read_text())["outcome"])


def _complete_records(out: Path) -> set[str]:
    manifests = [path for path in out.glob("*/manifest.json") if outcome(path.parent) == "complete"]
    return {path.read_text() for path in manifests}


def _cells(out: Path) -> set[str]:
    path = out / "cells.jsonl"
    lines = path.read_text().splitlines(keepends=True) if path.exists() else []
    return {line for line in lines if line.endswith("\n")}


def _nothing(_out: Path) -> set[str]:
    return set()


_SHORT = ("--set", "duration_s=2")
COMMANDS = {
    command.name: command
    for command in (
        Command("run", ("run", "circle", "--camera", "pose", "--set", "duration_s=20"), 2.0),
        Command(
            "experiment",
            ("experiment", "--camera", "pose", "--outer", "pid", "--repeats", "2", *_SHORT),
            5.0,
            _complete_records,
        ),
        Command("sweep", ("sweep", "campaign.toml", "--json"), 5.0, _nothing),
        Command(
            "tune",
            ("tune", "scenario-1", "--candidates", "11", "--held-out", "2", *_SHORT),
            7.0,
            _nothing,
            ".toml",
        ),
        Command(
            "faults", ("faults", "--fault", "link cut", "--fault", "board gone", "--outer", "pid"),
            6.0, _cells,
        ),
    )
}  # fmt: skip
