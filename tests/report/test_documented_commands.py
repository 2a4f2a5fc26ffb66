"""Every command block of README and docs: taken as written by a shell, and quick ones are run.

What starts with `hil` in an indented or fenced block is parted into words as a shell does, comments
left out, and given to the command's own parser: a wrong option, a missing argument or a value out
of bounds fails. Options named in running text are looked up too. TOML and Python blocks are read.
"""

from __future__ import annotations

import re
import shlex
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import click
import pytest

from hil.cli.main import cli, main
from hil.config.load import load_scenario
from hil.record.log_mapping import read_mapping
from tests.replay.records import record

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
PROGRAMS = {"hil", ".venv/bin/hil"}
# Placeholders that the pages explain, as words that the parser takes.
PLACEHOLDERS = {"RUN": "run", "DIR": "dir", "FILE": "file.toml", "LOG": "log.csv", "COMMAND": "run"}
# Blocks that need nothing but a record or a second of the twin; all others take minutes, a board,
# a camera, a display or another terminal.
QUICK = re.compile(
    r"hil (doctor|compare RUN RUN( --report \S+)?|replay RUN( --outer \S+)?"
    r"|run (square\.toml --out|scenario-1 --set robot)\S.*|run square\.toml --o.*"
    r"|compare square .*|experiment square.*|.*--help)$"
)


class Line(NamedTuple):
    """One command of a page, its comment left out."""

    page: Path
    number: int
    text: str

    def __str__(self) -> str:
        return f"{self.page.name}:{self.number}: {self.text}"


def block_lines(page: Path) -> Iterator[tuple[int, str]]:
    """Yield (number, text) of every line of a fenced or indented block, continued ones as one."""
    fenced = False
    text = re.sub(r"\\\n\s*", "", page.read_text(encoding="utf-8"))
    for number, line in enumerate(text.splitlines(), start=1):
        if line.startswith("```"):
            fenced = not fenced
        elif fenced or line.startswith("    "):
            yield number, line.strip()


def commands() -> list[Line]:
    """Return every `hil` command in the blocks of the pages."""
    found = []
    for page in PAGES:
        for number, text in block_lines(page):
            for part in text.split(" && "):
                if part.split(" ", 1)[0] in PROGRAMS:
                    plain = shlex.join(shlex.split(part, comments=True))
                    found.append(Line(page, number, plain))
    return found


def parsed(words: list[str]) -> None:
    """Give words after `hil` to the parser of their command; raises click's errors."""
    context = click.Context(cli, info_name="hil")
    name, *rest = words
    command = cli.get_command(context, name)
    assert command is not None, f"no command {name}"
    while isinstance(command, click.Group):
        name, *rest = rest
        inner = command.get_command(context, name)
        assert inner is not None, f"no command {name}"
        command = inner
    if "--help" not in rest:
        command.make_context(name, list(rest))


def filled(text: str) -> list[str]:
    """Return the words after `hil` with the placeholders filled."""
    words = [PLACEHOLDERS.get(word, word) for word in shlex.split(text)]
    return words[1:]


LINES = commands()


def test_the_pages_have_commands() -> None:
    """The collector sees them: README alone has more than ten."""
    assert sum(line.page.name == "README.md" for line in LINES) > 10
    assert len({line.page for line in LINES}) >= 6


@pytest.mark.parametrize("line", LINES, ids=str)
def test_a_command_is_taken_as_written(line: Line) -> None:
    """No unknown option, no argument too many (a comment without #), none missing."""
    try:
        parsed(filled(line.text))
    except click.ClickException as error:
        pytest.fail(f"{line}: {error.format_message()}")


def test_the_check_sees_mistakes() -> None:
    """An explanation without #, an option that is not there, a value out of bounds."""
    for wrong in (
        "hil run scenario-1 --view one run, opened in the viewer",
        "hil run scenario-1 --camera-record",
        "hil experiment --repeats 0",
        "hil compare",
    ):
        with pytest.raises(click.ClickException):
            parsed(shlex.split(wrong)[1:])


def inline() -> list[Line]:
    """Return every `hil ...` in backticks of running text."""
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for match in re.finditer(r"`hil ([a-z][^`]*)`", text):
            number = text.count("\n", 0, match.start()) + 1
            found.append(Line(page, number, " ".join(match.group(1).split())))
    return found


@pytest.mark.parametrize("line", inline(), ids=str)
def test_options_in_running_text_exist(line: Line) -> None:
    """The command, and each --option of it, are there; values may be left out."""
    context = click.Context(cli, info_name="hil")
    command: click.Command | None = cli
    words = line.text.split()
    while isinstance(command, click.Group) and words and not words[0].startswith("-"):
        command = command.get_command(context, words.pop(0).split("|")[0].rstrip(",."))
        assert command is not None, line
    known = {name for item in command.params for name in (*item.opts, *item.secondary_opts)}
    for option in re.findall(r"(?<![\w-])--[a-z][a-z-]*", " ".join(words)):
        assert option in known | {"--help"}, line


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make what a reader has who followed the pages: the files they show, and one record."""
    place = tmp_path_factory.mktemp("reader")
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for name, block in re.findall(
            r"^`(\w+\.toml)`[^\n]*:\n\n```toml\n(.*?)```", text, re.M | re.S
        ):
            (place / name).write_text(block, encoding="utf-8")
    record(place / "run", ("duration_s=2", "requirements=[]"), rerun=True)
    return place


# Pages whose files and commands have tests of their own.
OWN_TESTS = {"own-plant.md", "own-robot.md"}


def quick() -> list[Line]:
    return [
        line
        for line in LINES
        if QUICK.match(line.text) and "--view" not in line.text and line.page.name not in OWN_TESTS
    ]


@pytest.mark.parametrize("line", quick(), ids=str)
def test_a_quick_command_does_what_it_says(
    line: Line, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It ends with 0 and says something, in the folder of somebody who followed the page."""
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "argv", ["hil", *filled(line.text)])
    with pytest.raises(SystemExit) as end:
        main()
    said = capsys.readouterr()
    assert end.value.code == 0, said.err
    assert said.out.strip()


def test_the_task_of_ones_own_arrives(folder: Path) -> None:
    """The page's own scenario is there, loads, and keeps nothing of another task."""
    scenario = load_scenario(str(folder / "square.toml"))
    assert scenario.reference.kind == "waypoints"
    assert [item.metric for item in scenario.requirements] == ["delta1_worst_last_second_m"]


def toml_blocks() -> list[tuple[str, str]]:
    return [
        (f"{page.name}-{index}", block)
        for page in PAGES
        for index, block in enumerate(
            re.findall(r"^```toml\n(.*?)```", page.read_text(encoding="utf-8"), re.M | re.S)
        )
    ]


@pytest.mark.parametrize(("name", "block"), toml_blocks(), ids=[name for name, _ in toml_blocks()])
def test_toml_blocks_are_read(name: str, block: str, tmp_path: Path) -> None:
    """Valid TOML; a mapping of a log is one that `hil import` takes."""
    tree = tomllib.loads(block)
    assert tree, name
    if "columns" in tree and "t" in tree:
        (tmp_path / "map.toml").write_text(block, encoding="utf-8")
        assert read_mapping(tmp_path / "map.toml").columns


def python_blocks() -> list[tuple[str, str]]:
    return [
        (f"{page.name}-{index}", block)
        for page in PAGES
        if page.name != "python-api.md"  # run in their order by tests/api/test_docs.py
        for index, block in enumerate(
            re.findall(r"^```python\n(.*?)```", page.read_text(encoding="utf-8"), re.M | re.S)
        )
    ]


@pytest.mark.parametrize(
    ("name", "block"), python_blocks(), ids=[name for name, _ in python_blocks()]
)
def test_python_blocks_run(
    name: str, block: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As written, with the record of this folder in the place of the one that is named."""
    monkeypatch.chdir(folder)
    exec(compile(re.sub(r"runs/[\w-]+", "run", block), name, "exec"), {})


def links() -> list[tuple[Path, str]]:
    return [
        (page, target)
        for page in PAGES
        for target in re.findall(r"\]\(([^)#\s:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    ]


def test_links_lead_somewhere_and_every_page_is_listed() -> None:
    """Every file that a page links to is there, and README lists every page of docs."""
    for page, target in links():
        assert (page.parent / target).exists(), f"{page.name}: {target}"
    listed = {target for page, target in links() if page.name == "README.md"}
    assert {f"docs/{page.name}" for page in PAGES[1:]} <= listed


def test_no_page_cites_what_is_not_here() -> None:
    """The thesis is cited in full, once; sections are those of pages that exist."""
    texts = {page.name: page.read_text(encoding="utf-8") for page in PAGES}
    assert "Seguimiento robusto como optimización" in texts["glossary.md"]
    for name, text in texts.items():
        assert not re.search(r"(?<![/\w])(harness|architecture|other_chapters)\.md", text), name
        assert "of the specification" not in text.lower(), name
