"""Each study once through the real command; its JSON, Markdown and files serve all tests."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from hil.cli.main import cli


@dataclass(frozen=True)
class Reproduced:
    """What `hil reproduce CHAPTER --quick --json --markdown ...` left behind."""

    status: int
    document: dict[str, Any]
    markdown: str
    folder: Path
    warned: str

    def row(self, name: str) -> dict[str, Any]:
        return next(row for row in self.document["rows"] if row["row"] == name)

    def claim(self, beginning: str) -> dict[str, Any]:
        return next(c for c in self.document["claims"] if c["claim"].startswith(beginning))


def reproduce(folder: Path, *arguments: str) -> Reproduced:
    """Run the command in this process and read what it printed and wrote."""
    text = folder / "page.md"
    out = folder / "out"
    result = CliRunner().invoke(
        cli,
        ["reproduce", *arguments, "--quick", "--json", "--out", str(out), "--markdown", str(text)],
        standalone_mode=False,
    )
    assert result.exception is None, result.exception
    status = result.return_value
    return Reproduced(int(status), json.loads(result.stdout), text.read_text(), out, result.stderr)


@pytest.fixture(scope="session")
def chapter4(tmp_path_factory):
    return reproduce(tmp_path_factory.mktemp("chapter4"), "4")


@pytest.fixture(scope="session")
def chapter5(tmp_path_factory):
    return reproduce(tmp_path_factory.mktemp("chapter5"), "5")


@pytest.fixture(scope="session")
def chapter6(tmp_path_factory):
    return reproduce(tmp_path_factory.mktemp("chapter6"), "6")
