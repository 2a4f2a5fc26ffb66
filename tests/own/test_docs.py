"""The pages on own laws and localisers: every block is written, or run, in its order."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from hil.record.manifest import read_manifest
from tests.cli.command import Done, hil

DOCS = Path(__file__).resolve().parents[2] / "docs"
_BLOCK = re.compile(r"^```(\w+)(?: (\S+))?\n(.*?)^```$", re.M | re.S)
# Budgets on the page are for people; a short run shows that a command goes.
_SHORTER = {"--candidates": "11", "--held-out": "2", "--repeats": "1"}


def blocks(page: str) -> list[tuple[str, str, str]]:
    """Return (language, file, text) of every fenced block, and check that there are no others."""
    text = (DOCS / page).read_text(encoding="utf-8")
    found = [(m[1], m[2] or "", m[3]) for m in _BLOCK.finditer(text)]
    assert len(found) == text.count("```") // 2
    return found


def shorter(words: list[str]) -> list[str]:
    """Return a command that takes seconds: fewer candidates and seeds, and runs of a second."""
    words = [_SHORTER.get(before, word) for before, word in zip(["", *words], words, strict=False)]
    slow = words[0] in {"tune", "experiment", "run"} or words[:2] == ["check", "law"]
    return [*words, "--set", f"duration_s={2 if words[0] == 'run' else 0.5}"] if slow else words


def walk(page: str, as_run: Callable[[list[str]], list[str]] = shorter) -> list[tuple[str, Done]]:
    """Write the files and run the commands of a page in the current folder, in its order.

    `as_run` is given the words of a command and gives those that are run.
    """
    done = []
    for language, file, text in blocks(page):
        if language == "console":
            for line in text.splitlines():
                program, *words = shlex.split(line)
                assert program == "hil"
                done.append((line, hil(*as_run(words))))
        else:
            assert file, f"{page}: a block of {language} without a file"
            Path(file).write_text(text, encoding="utf-8")
            if language == "toml":
                tomllib.loads(text)
    return done


def refused(done: list[tuple[str, Done]]) -> list[str]:
    """Return what did not do as the page says; shortened runs cannot hold their requirements."""
    return [
        f"{line}: {end.status} {end.err} {end.out[-500:]}"
        for line, end in done
        if end.status != 0
        and not (end.status == 1 and "duration_s=" in " ".join(shorter(shlex.split(line)[1:])))
    ]


def test_page_on_own_laws(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """From the file to run, tune, comparison and replay, as the page says; the file has 40 lines."""
    monkeypatch.chdir(tmp_path)
    done = walk("own-law.md")
    assert refused(done) == []
    assert len(done) == 9
    assert len(Path("pursuit.py").read_text().splitlines()) <= 45
    outputs = dict(done)
    assert "bit for bit" in outputs["hil replay run"].out
    assert "pursuit - pid" in outputs[next(line for line in outputs if "hil tune" in line)].out
    assert read_manifest(Path("run")).outer == "pursuit"
    assert "pursuit" in Path("experiment/report.html").read_text()


def test_page_on_own_localisers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A tag by one line of a file, then a localiser of one's own: run, checked, replayed."""
    monkeypatch.chdir(tmp_path)
    done = walk("own-localiser.md")
    assert refused(done) == []
    for name, localiser in (("tagged", "tags"), ("same", "tags"), ("own", "red-green")):
        assert read_manifest(Path(name)).scenario["camera"]["localiser"] == localiser
    assert read_manifest(Path("own")).scenario["camera"]["localiser_settings"]["rise_dn"] == 30.0


def test_the_tests_on_the_pages_pass_under_pytest(tmp_path: Path):
    """The law of the page passes the whole kit, in the test of one's own that the page shows."""
    (text,) = [text for _, file, text in blocks("own-law.md") if file == "pursuit.py"]
    (test,) = [text for _, file, text in blocks("own-law.md") if file == "test_pursuit.py"]
    (tmp_path / "pursuit.py").write_text(text)
    (tmp_path / "test_pursuit.py").write_text(test)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tmp_path)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert "1 passed" in done.stdout
