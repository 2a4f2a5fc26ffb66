"""The stack that no path of the firmware can pass, read off the program itself."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from hil.board.build import find_toolchain
from hil.board.stack_bound import StackBound, stack_bound
from hil.core.errors import BadInput
from tests.pil.rigs import needs_toolchain

pytestmark = needs_toolchain

# Not inlined and not seen through; `use` takes as much room as its buffer.
BEGIN = """
#include <avr/interrupt.h>
#define FAR __attribute__((noinline, noclone))
volatile unsigned char sink;
FAR void use(volatile unsigned char *p, unsigned n) { while (n--) sink = p[n]; }
FAR void leaf(void) { volatile unsigned char a[40]; use(a, 40); }
"""
SMALL = "int main(void) { leaf(); for (;;) {} }"
DEEP = """
FAR void deep(void) { volatile unsigned char a[300]; use(a, 300); leaf(); use(a, 300); }
int main(void) { if (sink) deep(); else leaf(); for (;;) {} }
"""
RECURSIVE = """
FAR unsigned down(unsigned n) { volatile unsigned char a[4]; use(a, 4); return n ? down(n - 1) + sink : 1; }
int main(void) { sink = down(sink); for (;;) {} }
"""
BY_ADDRESS = """
void (*volatile chosen)(void);
FAR void large(void) { volatile unsigned char a[200]; use(a, 200); }
int main(void) { chosen = large; chosen(); for (;;) {} }
"""
INTERRUPT = SMALL + "ISR(TIMER0_OVF_vect) { volatile unsigned char a[60]; use(a, 60); }"
NESTED = INTERRUPT + "ISR(TIMER1_OVF_vect) { volatile unsigned char a[50]; sei(); use(a, 50); }"


def bound_of(folder: Path, source: str) -> StackBound:
    """Return the bound of a program of its own."""
    text, elf = folder / "program.c", folder / "program.elf"
    text.write_text(BEGIN + source)
    command = [find_toolchain().tool("gcc"), "-mmcu=atmega2560", "-Os", str(text), "-o", str(elf)]
    subprocess.run(command, check=True, capture_output=True)
    return stack_bound(elf)


def test_the_deepest_path_counts(tmp_path: Path) -> None:
    """40 bytes in a leaf; 300 more, and one more call, on the way that is seldom taken."""
    small, deep = bound_of(tmp_path, SMALL), bound_of(tmp_path, DEEP)
    assert 40 <= small.total_bytes <= 70
    assert 303 <= deep.total_bytes - small.total_bytes <= 330
    assert deep.path[-3:] == ("deep", "leaf", "use")


def test_what_is_called_by_address_counts(tmp_path: Path) -> None:
    """Nobody says by name what a pointer calls: it may be the largest."""
    bound = bound_of(tmp_path, BY_ADDRESS)
    assert 200 <= bound.total_bytes <= 240
    assert "large" in bound.path


def test_interrupts_lie_on_top(tmp_path: Path) -> None:
    """One at a time; where one lets others in, all of them."""
    alone, nested = bound_of(tmp_path, INTERRUPT), bound_of(tmp_path, NESTED)
    assert 60 <= alone.interrupt_bytes <= 110
    assert 50 <= nested.interrupt_bytes - alone.interrupt_bytes <= 100


def test_a_function_that_calls_itself_has_no_bound(tmp_path: Path) -> None:
    """It is named, with the way back to it."""
    with pytest.raises(BadInput, match="down -> down: a function that calls itself"):
        bound_of(tmp_path, RECURSIVE)
