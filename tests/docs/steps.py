"""Commands written in files of a CI: cut into words, and whether they could run in a clone."""

from __future__ import annotations

import os
import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path

from hil.cli.main import cli

ROOT = Path(__file__).resolve().parents[2]
# Programs of the images and systems that the files name, which a desk need not have.
ELSEWHERE = {"apt-get"}


def commands(script: str) -> Iterator[list[str]]:
    """Yield the words of each command of a shell script of simple lines."""
    for line in script.replace("\\\n", " ").splitlines():
        for part in re.split(r"&&|\|\||[|;]", line):
            words = shlex.split(part, comments=True)
            if words:
                yield words


def problem(words: list[str]) -> str:
    """Return why a command could not run in a clone that is set up, "" when it could."""
    program, *rest = words
    if program in {"hil", ".venv/bin/hil"}:
        return _hil_problem(rest)
    if program.startswith("."):
        file = ROOT / program
        return "" if file.is_file() and os.access(file, os.X_OK) else f"{program}: no such program"
    known = program in ELSEWHERE or shutil.which(program) is not None
    return "" if known else f"{program}: no such program"


def _hil_problem(words: list[str]) -> str:
    """Parse a command line as `hil` would, without running it."""
    if words in (["--version"], ["--help"]):
        return ""
    command = cli.get_command(None, words[0])  # type: ignore[arg-type]
    if command is None:
        return f"hil {words[0]}: no such command"
    try:
        command.make_context(words[0], words[1:])
    except Exception as error:
        return f"hil {' '.join(words)}: {error}"
    return ""
