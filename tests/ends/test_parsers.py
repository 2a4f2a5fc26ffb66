"""A short form of `python -m tests.ends.parsers`: damaged files of every kind are read or refused."""

from __future__ import annotations

import math
import random
import warnings
from pathlib import Path

import pytest

from hil.config.load import load_scenario
from hil.core.errors import BadInput
from hil.record.reader import read_events
from hil.runs.execute import RunSpec, execute_in_memory
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


# What the long form has found, each mended where it was.
_ENDLESS = "9" * 400


@pytest.mark.parametrize(
    ("kind", "old", "new", "said"),
    [
        ("parameters", b"0.2", _ENDLESS.encode(), "beyond what any parameter takes"),
        ("scenario", b'base = "lab"', b'base = "' + _ENDLESS.encode() + b'"', "no such file"),
        ("samples.parquet", b"est_x_m", b"e\xf8t_x_m", "damaged, not readable as Parquet"),
    ],
)
def test_what_was_found_is_refused(
    kinds: dict[str, Parser], folder: Path, kind: str, old: bytes, new: bytes, said: str
) -> None:
    """An integer without an end, a name longer than files have, a column's name that is no text."""
    parser = kinds[kind]
    assert old in parser.good
    path = folder / parser.file
    path.write_bytes(parser.good.replace(old, new))
    with pytest.raises(BadInput, match=said):
        parser.read(path)


def test_an_event_without_a_time_ends_the_events_and_not_the_record(
    kinds: dict[str, Parser], folder: Path
) -> None:
    """Its number is beyond what a float takes."""
    parser = kinds["events.jsonl"]
    path = folder / parser.file
    lines = parser.good.splitlines(keepends=True)
    path.write_bytes(lines[0] + b'{"t_s": %s, "kind": "", "text": ""}\n' % _ENDLESS.encode())
    assert parser.read(path) is not None
    assert len(read_events(path)) == 1


def test_figures_of_numbers_beyond_all_sense_are_infinite_without_a_word() -> None:
    """A damaged column squared is more than a float takes: NumPy's warning is of no use to anybody."""
    scenario = load_scenario("circle", ["duration_s=0.5"])
    run = execute_in_memory(RunSpec(scenario, "twin", "pose", "pid", "asg-ism", 1, Path()))
    run.samples["zeta_m_s2"][3] = run.samples["true_delta1_x_m"][3] = 1e200
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figures = run.figures().values
    assert figures["ise_m2_s"] == math.inf
