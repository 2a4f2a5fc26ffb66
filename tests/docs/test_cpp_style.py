"""One C++ style: the file that says it is understood, and applying it twice changes nothing more."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.steps import ROOT

UGLY = "int  f( int*a ){return *a;}\n"


def formatted(text: str, *options: str) -> subprocess.CompletedProcess[str]:
    """Run clang-format of the environment over a text, as a file of the core."""
    program = Path(sys.executable).with_name("clang-format")
    if not program.exists():
        pytest.skip("no clang-format; pip install clang-format")
    name = "--assume-filename=firmware_arduino/src/core/x.cpp"
    return subprocess.run(
        [str(program), "--style=file", name, *options],
        input=text, capture_output=True, text=True, check=False, cwd=ROOT,
    )  # fmt: skip


def test_the_style_is_the_projects() -> None:
    """Two columns, pointers at the type, short functions on a line, lines of up to 110 columns."""
    assert formatted(UGLY).stdout == "int f(int* a) { return *a; }\n"
    long = f"const int a = {' + '.join(['1'] * 60)};\n"
    assert max(len(line) for line in formatted(long).stdout.splitlines()) <= 110


def test_a_file_in_another_style_fails_the_check() -> None:
    """The negative control of `.ci/format-cpp --check`; a file that was formatted passes."""
    check = ("--dry-run", "--Werror")
    assert formatted(UGLY, *check).returncode != 0
    assert formatted(formatted(UGLY).stdout, *check).returncode == 0


@pytest.mark.parametrize("name", ["wheel_loop.cpp", "safety.cpp", "protocol.cpp"])
def test_formatting_twice_is_formatting_once(name: str) -> None:
    """The style has one answer for the files of the core."""
    once = formatted((ROOT / "firmware_arduino/src/core" / name).read_text(encoding="utf-8")).stdout
    assert once
    assert formatted(once).stdout == once
