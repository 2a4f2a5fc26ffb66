"""The most stack that the firmware can ever take, from the instructions of its ELF.

Every path from reset is walked through what the compiler put out: bytes pushed and popped, room made and
given back below the stack pointer, three bytes of return address for each call (the processor has more
than 128 KB of program memory). The bound is the deepest of them, with the deepest interrupt on top of it;
interrupts do not interrupt each other unless one of them lets them, and then all count. What is called by
address may be any function that nothing calls by name; a jump by a table may go to any piece of its
function.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from hil.board.build import find_toolchain
from hil.core.errors import BadInput

RAM_BYTES = 8192
_RETURN_BYTES = 3
_RESET = "__ctors_end"
_LABEL = re.compile(r"^([0-9a-f]+) <(.+)>:$")
_LINE = re.compile(r"^\s*([0-9a-f]+):\t((?:[0-9a-f]{2} )+)\s*\t(\S+)(?:\t([^;]*))?(?:;.*)?$")
_TARGET = re.compile(r"(?:0x)?([0-9a-f]+)")
_CALLS, _JUMPS, _BY_ADDRESS = {"call", "rcall"}, {"jmp", "rjmp"}, {"icall", "eicall"}
_RETURNS, _TABLE_JUMPS = {"ret", "reti"}, {"ijmp", "eijmp"}
_SKIPS = {"cpse", "sbrc", "sbrs", "sbic", "sbis"}
_TABLE = "__tablejump2__"
_STUBS = "__trampolines_start"  # jumps to functions whose address may not fit a pointer
_NO_VALUES = ("__", "main", "_exit")  # entered by the processor and by what starts the program
_SPL = "0x3d"
# So many instructions lie between making room and setting the stack's pointer, at the most.
_NEAR = 6


class _Line(NamedTuple):
    """One instruction."""

    at: int
    size: int
    what: str
    operands: str
    symbol: str


@dataclass(frozen=True, slots=True)
class StackBound:
    """Bytes: of the program, of the worst interrupt on top of it; and the calls that take most."""

    program_bytes: int
    interrupt_bytes: int
    path: tuple[str, ...]

    @property
    def total_bytes(self) -> int:
        """Return the most bytes of stack that are ever in use."""
        return self.program_bytes + self.interrupt_bytes


def stack_bound(elf: Path) -> StackBound:
    """Return the bound of a firmware; raises BadInput for a program that calls itself."""
    tools = find_toolchain()
    listing = _output([tools.tool("objdump"), "-d", str(elf)])
    walk = _Walk(listing, _output([tools.tool("objdump"), "-t", str(elf)]))
    program, path = walk.deepest(walk.starts[_RESET])
    vectors = [at for name, at in walk.starts.items() if re.fullmatch(r"__vector_\d+", name)]
    depths = [_RETURN_BYTES + walk.deepest(at)[0] for at in vectors]
    nested = any(
        line.what == "sei" and re.fullmatch(r"__vector_\d+", line.symbol)
        for line in walk.lines.values()
    )
    interrupt = sum(depths) if nested else max(depths, default=0)
    return StackBound(program, interrupt, path)


def _output(command: list[str]) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def _read(listing: str) -> Iterator[_Line]:
    symbol = ""
    for text in listing.splitlines():
        label, line = _LABEL.match(text), _LINE.match(text)
        if label:
            symbol = label[2]
        elif line:
            size = len(line[2].split())
            yield _Line(int(line[1], 16), size, line[3], (line[4] or "").strip(), symbol)


class _Walk:
    """Walks the program's paths, each function once."""

    def __init__(self, listing: str, symbols: str) -> None:
        self.lines = {line.at: line for line in _read(listing)}
        self.starts: dict[str, int] = {}
        self._pieces: dict[str, list[int]] = {}
        ended, last = True, {}
        for line in self.lines.values():
            self.starts.setdefault(line.symbol, line.at)
            if ended and line.at != self.starts[line.symbol]:  # a jump by a table may go there
                self._pieces.setdefault(line.symbol, []).append(line.at)
            last[line.symbol] = ended = line.what in _RETURNS | _JUMPS | _TABLE_JUMPS
        marked = {line.split()[-1] for line in symbols.splitlines() if " F .text" in line}
        named, stubs = set[int](), set[int]()
        for line in self.lines.values():
            if line.what in _CALLS | _JUMPS and not line.operands.startswith(".+0"):
                if line.at >= self.starts[_RESET]:  # before it lie tables
                    named.add(self._target(line))
                elif line.symbol == _STUBS and self._target(line) in self.starts.values():
                    stubs.add(self._target(line))
        self._taken = stubs | {
            at
            for name, at in self.starts.items()
            if name in marked and at not in named and last[name] and not name.startswith(_NO_VALUES)
        }
        self._known: dict[int, tuple[int, tuple[str, ...]]] = {}
        self._under_way: list[int] = []

    def deepest(self, entry: int) -> tuple[int, tuple[str, ...]]:
        """Return the most bytes below the return address of what is entered there, and the calls to it.

        Raises BadInput for a function that calls itself, and a loop that takes more stack each time.
        """
        if entry in self._known:
            return self._known[entry]
        name = self.lines[entry].symbol
        if entry in self._under_way:
            names = [self.lines[at].symbol for at in [*self._under_way, entry]]
            raise BadInput(f"firmware: {' -> '.join(names)}: a function that calls itself")
        self._under_way.append(entry)
        best: tuple[int, tuple[str, ...]] = (0, ())
        reached = {entry: 0}
        todo = [entry]
        while todo:
            at = todo.pop()
            line, depth = self.lines[at], reached[at]
            after = depth + self._takes(line)
            if after > RAM_BYTES:
                raise BadInput(f"firmware: {name}: a loop that takes more stack each time")
            best = max(best, (after, ()))
            for called in self._called(line):
                below, path = self.deepest(called)
                best = max(best, (after + _RETURN_BYTES + below, path))
            for follows in self._follows(line):
                if follows in self.lines and reached.get(follows, -1) < after:
                    reached[follows] = after
                    todo.append(follows)
        self._under_way.pop()
        self._known[entry] = (best[0], (name, *best[1]))
        return self._known[entry]

    def _called(self, line: _Line) -> Iterable[int]:
        if line.what in _BY_ADDRESS:
            return self._taken
        if line.what in _CALLS and not line.operands.startswith(".+0"):
            target = self._target(line)
            return [target] if target else []  # to 0: a function that is not there, never called
        return []

    def _follows(self, line: _Line) -> list[int]:
        """Return where the program may go on after an instruction in the same call."""
        after = line.at + line.size
        if line.what in _RETURNS | _TABLE_JUMPS:
            return []
        if line.what in _JUMPS:
            target = self._target(line)
            if target == self.starts.get(_TABLE):
                return self._pieces.get(line.symbol, [])
            return [target] if target else []  # to 0: the program starts anew
        if line.what.startswith("br") and line.what != "break":
            return [after, self._target(line)]
        if line.what in _SKIPS and after in self.lines:
            return [after, after + self.lines[after].size]
        return [after]

    def _target(self, line: _Line) -> int:
        relative = re.match(r"\.([+-]\d+)", line.operands)
        if relative:
            return line.at + 2 + int(relative[1])
        absolute = _TARGET.fullmatch(line.operands)
        if absolute is None:
            raise BadInput(f"{line.symbol}: cannot read where {line.what} {line.operands} goes")
        return int(absolute[1], 16)

    def _takes(self, line: _Line) -> int:
        """Return the bytes of stack that an instruction takes; below 0 what it gives back."""
        if line.what in {"push", "pop"}:
            return 1 if line.what == "push" else -1
        if line.what == "rcall" and line.operands.startswith(".+0"):
            return _RETURN_BYTES  # a call of what comes next: it makes room for as many bytes
        if line.what not in {"sbiw", "adiw", "subi"} or not line.operands.startswith("r28,"):
            return 0
        nexts = self._next(line)
        if not any(n.what == "out" and n.operands.startswith(_SPL) for n in nexts):
            return 0
        size = int(line.operands.split(",")[1].strip(), 16)
        if line.what == "subi" and nexts[0].what == "sbci":
            size += 256 * int(nexts[0].operands.split(",")[1].strip(), 16)
            size -= 65536 if size >= 32768 else 0
        return -size if line.what == "adiw" else size

    def _next(self, line: _Line) -> list[_Line]:
        found = []
        for _ in range(_NEAR):
            line = self.lines[line.at + line.size]
            found.append(line)
        return found
