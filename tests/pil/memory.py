"""Reads the sketch's variables out of the simulated board's RAM.

Addresses come from the ELF's symbols; places inside a structure from the compiler itself, which is
given a small program of offsets to translate.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from hil.board.build import Toolchain, find_toolchain, sketch_folder

_RAM = 0x800000


def _tool(toolchain: Toolchain, name: str, *arguments: str, text: str = "") -> str:
    command = [toolchain.tool(name), *arguments]
    return subprocess.run(command, input=text, capture_output=True, text=True, check=True).stdout


@cache
def symbols(elf: Path) -> dict[str, int]:
    """Return flash and RAM addresses by name, without namespaces and the optimiser's suffixes."""
    toolchain = find_toolchain()
    listing = _tool(toolchain, "nm", "--defined-only", str(elf))
    plain = re.sub(r"\.(lto_priv|constprop|isra|part)\.\d+", "", listing)
    table = {}
    for line in _tool(toolchain, "c++filt", text=plain).splitlines():
        address, _, name = line.split(" ", 2)
        table[name.rsplit("::", 1)[-1]] = int(address, 16) & ~_RAM
    return table


@cache
def constants(header: str, *expressions: str) -> tuple[int, ...]:
    """Return what the AVR compiler makes of constant expressions: `offsetof(hil::Board, inputs)`."""
    program = f"#include <stddef.h>\n#include <{header}>\n" + "".join(
        f"extern const long value_{i} = {expression};\n" for i, expression in enumerate(expressions)
    )
    arguments = ["-mmcu=atmega2560", "-std=gnu++11", "-w", f"-I{sketch_folder() / 'src'}"]
    listing = _tool(
        find_toolchain(), "g++", *arguments, "-x", "c++", "-S", "-o", "-", "-", text=program
    )
    return tuple(_value(listing, f"value_{i}") for i in range(len(expressions)))


def _value(listing: str, name: str) -> int:
    """Return a long from its assembly: four bytes, low first, written as signed numbers."""
    body = re.search(rf"^{name}:\n((?:\t\.byte\t-?\d+\n){{4}})", listing, re.MULTILINE)
    assert body is not None, f"{name} is not in the listing"
    return sum((int(n) & 0xFF) << 8 * i for i, n in enumerate(re.findall(r"-?\d+", body[1])))


def board_size_and(*members: Sequence[str]) -> tuple[int, ...]:
    """Return sizeof(hil::Board) and the offsets of its members."""
    return constants(
        "core/board.h", "sizeof(hil::Board)", *(f"offsetof(hil::Board, {m})" for m in members)
    )
