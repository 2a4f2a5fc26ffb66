"""The pages for people at a rig say what the programs say."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import click
import pytest

from hil.cli.main import cli

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "docs" / name for name in ("bring-up.md", "debugging.md")]
SOURCES = [
    *(
        path
        for name in ("hil", "vision", "sim_twin")
        for ending in ("*.py", "*.cpp", "*.hpp")
        for path in (ROOT / name).rglob(ending)
    ),
    ROOT / "firmware_arduino/src/core/texts.def",
    ROOT / "hil/wire/hil.xml",
]


def said() -> str:
    """Return every text of the sources, adjoining literals joined and parts run together."""
    text = "\n".join(path.read_text(encoding="utf-8") for path in SOURCES)
    return re.sub(r'"\s*\n\s*f?"', "", text)


def symptoms() -> list[str]:
    """Return what stands in backticks in the first column of every table of both pages."""
    cells = []
    for page in PAGES:
        for line in page.read_text(encoding="utf-8").splitlines():
            if line.startswith("| `"):
                cells += re.findall(r"`([^|]+?)`(?=[ ,|.]|$)", line.split("|")[1])
    return cells


def commands() -> list[str]:
    """Return every line of both pages that is a `hil` command."""
    found = []
    for page in PAGES:
        for line in page.read_text(encoding="utf-8").splitlines():
            if line.startswith("    hil "):
                found.append(line.strip())
            found += re.findall(r"`(hil (?:[^`]*))`", line)
    return found


def test_every_symptom_is_one_that_can_be_seen():
    """Each message, reason, fault and figure of the tables stands in the sources."""
    texts, cells = said(), symptoms()
    assert len(cells) > 60
    assert [
        cell for cell in cells if cell not in texts and cell != "0 bytes that were no frame"
    ] == []
    assert "bytes that were no frame" in texts


@pytest.mark.parametrize("line", sorted(set(commands())))
def test_every_command_exists(line: str):
    """Command, sub-command and options of each line are those of the program."""
    words = shlex.split(line.split("#", maxsplit=1)[0])[1:]
    command: click.Command = cli
    while words and isinstance(command, click.Group):
        found = command.get_command(click.Context(command), words[0])
        assert found is not None, line
        command, words = found, words[1:]
    known = {name for option in command.params for name in option.opts}
    assert {word for word in words if word.startswith("-")} <= known, line


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_leads_somewhere(page: Path):
    """Pages named in links are there."""
    for target in re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), target
