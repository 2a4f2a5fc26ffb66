"""Which part of the firmware each flash word belongs to, from the ELF's debug information.

A part is named by functions: all that the compiler inlined into them counts for them, and so does
what they call without a part of its own, such as the soft-float library.
"""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass

from hil.board.build import Build, Toolchain, find_toolchain

FLASH_WORDS = 128 * 1024
# Part -> its functions as file:function. Interrupts are told by their vector besides, so that the
# way through the vector table counts for them.
PARTS: dict[str, tuple[str, ...]] = {
    "encoder interrupts": ("encoders.cpp:__vector_1", "encoders.cpp:__vector_5"),
    "serial interrupts": (
        "uart.cpp:__vector_25",
        "uart.cpp:__vector_26",
        "uart.cpp:__vector_36",
        "uart.cpp:__vector_37",
    ),
    "timer interrupt": ("ticker.cpp:__vector_47",),
    "link: receive": (
        "host_port.cpp:receive",
        "host_port.cpp:watch_other",
        "board.cpp:act_on_checked",
    ),
    "link: transmit": ("host_port.cpp:transmit",),
    "tick: sense": ("encoders.cpp:read", "battery.cpp:read_mv", "board.cpp:sense"),
    "tick: estimate": ("board.cpp:estimate",),
    "tick: check": ("board.cpp:check",),
    "tick: control": ("board.cpp:control",),
    "tick: limit": ("board.cpp:limit",),
    "tick: actuate": ("board.cpp:actuate", "motors.cpp:write", "motors.cpp:show_armed"),
    "tick: report": ("board.cpp:report_tick", "report.cpp:report_tick"),
    "tick: rest": ("firmware_arduino.ino:tick",),
    "signing": (
        "board.cpp:board_idle",
        "link.cpp:link_begin_hash",
        "link.cpp:mark_signed",
        "signer.cpp:signer_tick",
        "signer.cpp:signer_slice",
        "sha256.cpp:sha256_slice",
    ),
    "main loop": ("firmware_arduino.ino:loop",),
}
_VECTORS = {
    "encoder interrupts": (1, 2, 5, 6),
    "serial interrupts": (25, 26, 36, 37),
    "timer interrupt": (47,),
}
_VECTOR_WORDS = 2


@dataclass(frozen=True, slots=True)
class PartMap:
    """Part number of each flash word, and the parts by number; number 0 goes with the caller."""

    part_of_word: bytes
    names: tuple[str, ...]


def part_map(build: Build) -> PartMap:
    """Return the parts of a program."""
    names = ("elsewhere", *PARTS)
    number = {
        function: names.index(part) for part, functions in PARTS.items() for function in functions
    }
    words = bytearray(FLASH_WORDS)
    for address, chain in _inline_chains(find_toolchain(), build):
        words[address // 2] = next((number[f] for f in chain if f in number), 0)
    for part, vectors in _VECTORS.items():
        for vector in vectors:
            first = vector * _VECTOR_WORDS
            words[first : first + _VECTOR_WORDS] = bytes([names.index(part)] * _VECTOR_WORDS)
    return PartMap(bytes(words), names)


def _inline_chains(toolchain: Toolchain, build: Build) -> list[tuple[int, list[str]]]:
    """Return (address, functions the word stands in as file:function, innermost first)."""
    asked = "\n".join(hex(address) for address in range(0, build.flash_bytes, 2))
    command = [toolchain.tool("addr2line"), "-a", "-i", "-f", "-C", "-e", str(build.elf)]
    said = subprocess.run(command, input=asked, capture_output=True, text=True, check=True).stdout
    chains: list[tuple[int, list[str]]] = []
    function = ""
    for line in said.splitlines():
        if line.startswith("0x"):
            chains.append((int(line, 16), []))
            function = ""
        elif not function:
            function = line
        else:
            chains[-1][1].append(f"{_file_name(line)}:{_bare_name(function)}")
            function = ""
    return chains


def _file_name(place: str) -> str:
    """Return the file of "/path/board.cpp:12 (discriminator 2)"."""
    return place.rsplit("/", 1)[-1].split(":", 1)[0]


def _bare_name(function: str) -> str:
    """Return the last name of "hil::(anonymous namespace)::read(hil::Board&) [clone .part.1]"."""
    without_arguments = re.sub(r"\((?!anonymous).*", "", function)
    return without_arguments.rsplit("::", 1)[-1].strip()
