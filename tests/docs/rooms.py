"""Draws the rooms and their arrows from the contract of import-linter.

`python -m tests.docs.rooms` puts the picture into docs/overview.md, between its two marks.
"""

from __future__ import annotations

import importlib
from pathlib import Path

from hil.core.files import read_toml

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "overview.md"
BEGIN, END = "<!-- rooms: drawn by python -m tests.docs.rooms -->\n", "<!-- rooms: end -->\n"


def floors() -> list[list[str]]:
    """Return the rooms of the contract, the upper floors first."""
    contracts = read_toml(ROOT / "pyproject.toml")["tool"]["importlinter"]["contracts"]
    (layers,) = [contract["layers"] for contract in contracts if contract["type"] == "layers"]
    return [[room.strip() for room in floor.split("|")] for floor in layers]


def picture() -> str:
    """Return the picture and a table of what the rooms hold, in Markdown."""
    lines = ["```mermaid", "flowchart TD"]
    for upper, lower in zip(floors(), floors()[1:], strict=False):
        lines.append(f"  {_joined(upper)} --> {_joined(lower)}")
    lines += ["```", "", "| room | holds |", "| --- | --- |"]
    for floor in floors():
        for room in floor:
            said = (importlib.import_module(room).__doc__ or "").strip().split("\n")[0]
            lines.append(f"| `{room.replace('.', '/')}` | {said.rstrip('.')} |")
    return "\n".join(lines) + "\n"


def _joined(rooms: list[str]) -> str:
    return " & ".join(f"{room.replace('.', '_')}[{room.replace('.', '/')}]" for room in rooms)


def drawn(text: str) -> str:
    """Return a page with the picture between its marks."""
    before, rest = text.split(BEGIN)
    _, after = rest.split(END)
    return f"{before}{BEGIN}{picture()}{END}{after}"


if __name__ == "__main__":
    PAGE.write_text(drawn(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
