"""A short form of `python -m tests.ends.parsers`: damaged files of every kind are read or refused."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from tests.ends.parsers import Parser, damaged, parsers, try_one

TRIES = 8


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("parsers")


@pytest.fixture(scope="module")
def kinds(folder: Path) -> dict[str, Parser]:
    return {parser.name: parser for parser in parsers(folder)}


def test_good_files_are_read(kinds: dict[str, Parser], folder: Path) -> None:
    """Else everything would be refused, and nothing tested."""
    for parser in kinds.values():
        path = folder / parser.file
        path.write_bytes(parser.good)
        assert parser.read(path) is not None, parser.name


def test_damaged_files_are_read_or_refused(kinds: dict[str, Parser], folder: Path) -> None:
    """No other error, no figure of nothing, no endless reading."""
    flaws = [
        flaw
        for parser in kinds.values()
        for seed in range(TRIES)
        if (flaw := try_one(parser, seed, folder)) is not None
    ]
    assert not flaws
    assert len(kinds) > 20


def test_what_is_wrong_with_a_parser_is_found(folder: Path) -> None:
    """One that raises something else, and one that takes for ever."""

    def careless(path: Path) -> object:
        return path.read_bytes().decode("ascii").split(",")[3]

    parser = Parser("careless", b"a,b,c,d", "careless.txt", careless)
    found = [flaw for seed in range(40) if (flaw := try_one(parser, seed, folder)) is not None]
    assert {True for flaw in found if "IndexError" in flaw.what} == {True}
    assert {True for flaw in found if "UnicodeDecodeError" in flaw.what} == {True}


def test_damage_is_the_same_for_the_same_seed() -> None:
    """So that what was found can be looked at again; and it is damage."""
    good = bytes(range(200))
    made = [damaged(good, random.Random(seed)) for seed in (1, 1, 2)]
    assert made[0] == made[1] != made[2]
    assert made[0] != good
