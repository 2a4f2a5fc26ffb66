"""What is measured in cycles is only as good as the simulator's cycles: checked against the datasheet."""

import subprocess

import pytest

from hil.board.build import find_toolchain
from sim_twin.pil import pil_module
from sim_twin.pil_profile import FLASH_WORDS
from tests.pil.rigs import needs_toolchain

pytestmark = needs_toolchain

REPEATS = 64
# Microchip DS40002198 (AVR instruction set manual), column AVRe, program counter of 22 bits. A call
# stands with the 5 cycles of the return it comes back by; a skip passes over every second of a row,
# so that two of them take 2 cycles.
DATASHEET_CYCLES = {
    1: "nop; mov r4,r5; movw r4,r6; ldi r16,5; add r4,r5; adc r4,r5; sub r4,r5; sbc r4,r5; "
    "subi r16,1; sbci r16,1; and r4,r5; andi r16,1; or r4,r5; ori r16,1; eor r4,r5; com r4; neg r4; "
    "inc r4; dec r4; lsr r4; ror r4; asr r4; swap r4; bst r4,1; bld r4,1; cp r4,r5; cpc r4,r5; "
    "cpi r16,1; cpse r18,r19; in r4,0x1e; out 0x1e,r4; sbic 0x1e,7; sbis 0x1e,7; sbrc r18,7; "
    "sbrs r18,7; brcs .+0; sec; cli; wdr",
    2: "adiw r24,1; sbiw r24,1; mul r4,r5; muls r16,r17; mulsu r16,r17; fmul r16,r17; ld r4,X; "
    "ld r4,X+; ld r4,-X; ld r4,Y+; ld r4,-Y; ldd r4,Y+3; ld r4,Z; ld r4,Z+; ldd r4,Z+3; st X,r4; "
    "st X+,r4; st -X,r4; st Y+,r4; std Y+3,r4; st Z,r4; std Z+3,r4; lds r4,0x400; sts 0x400,r4; "
    "push r4; pop r4; sbi 0x1e,1; cbi 0x1e,1; rjmp .+0; brcc .+0",
    3: "lpm; lpm r4,Z; lpm r4,Z+; elpm r4,Z; elpm r4,Z+",
    9: "rcall func; icall; eicall",
    10: "call func",
}
HEAD = """
.global main
 jmp main
.org 4
 jmp handler
.org 0x200
func: ret
handler: reti
main: ldi r16,0x21
 out 0x3e,r16
 ldi r16,0xff
 out 0x3d,r16
"""
# X, Y, Z in RAM, or Z on the function; r18 and the carry clear.
SETUP = """
 ldi r27,8
 ldi r29,8
 ldi r30,{low}
 ldi r31,{high}
 clr r18
 out 0x3c,r18
 ldi r19,1
 clc
"""


@pytest.fixture(scope="module")
def assemble(tmp_path_factory):
    """Return a function: assembly text -> (ELF, addresses by label)."""
    folder, tools = tmp_path_factory.mktemp("asm"), find_toolchain()

    def run(text):
        source, elf = folder / "program.S", folder / f"program-{len(text)}.elf"
        source.write_text(HEAD + text)
        options = ["-mmcu=atmega2560", "-nostartfiles", "-nostdlib", "-o", str(elf)]
        subprocess.run([tools.tool("gcc"), *options, str(source)], check=True)
        listing = subprocess.run(
            [tools.tool("nm"), str(elf)], capture_output=True, text=True, check=True
        ).stdout
        words = (line.split() for line in listing.splitlines())
        return elf, {name: int(address, 16) for address, _, name in words}

    return run


def board(elf):
    """Return the processor with this program, not yet powered up."""
    return pil_module()(str(elf), "1", 0.0, b"")


def test_instructions_take_the_cycles_of_the_datasheet(assemble):
    """Every kind of instruction avr-gcc emits, 64 times in a row."""
    expected = {
        text.strip(): cycles
        for cycles, texts in sorted(DATASHEET_CYCLES.items(), reverse=True)
        for text in texts.split(";")
    }
    blocks = []
    for number, text in enumerate(expected):
        on_function = {"low": "lo8(pm(func))", "high": "hi8(pm(func))"}
        target = on_function if text.endswith("icall") else {"low": "0", "high": "8"}
        row = f" {text}\n" * REPEATS
        blocks.append(f"{SETUP.format(**target)} nop\nb{number}:\n{row}e{number}: nop\n")
    elf, label = assemble("".join(blocks) + "done: rjmp done\n")
    parts = bytearray(FLASH_WORDS)
    for number in range(len(expected)):
        for address in range(label[f"b{number}"], label[f"e{number}"], 2):
            parts[address // 2] = number + 1
    chip = board(elf)
    chip.start_profile(bytes(parts))
    chip.power_up()
    chip.advance_to(10_000, 12.0)
    measured = {
        text: count / REPEATS for text, count in zip(expected, chip.profile()[0][1:], strict=True)
    }
    assert measured == expected


def test_an_interrupt_costs_response_jump_and_return(assemble):
    """5 cycles of response, 3 of the vector's jump, 5 of the return, 22-bit program counter."""
    program = " ldi r16,1\n sts 0x69,r16\n out 0x1d,r16\n sei\nidle: rjmp idle\n"  # EICRA, EIMSK
    chip = board(assemble(program)[0])
    chip.power_up()
    for edge in range(10):
        chip.edge(100.0 * edge + 50.0, 0, (edge + 1) & 1)
        chip.advance_to(100 * (edge + 1), 12.0)
    assert chip.usage()["interrupts"] == {1: (10, 10 * (5 + 3 + 5), 5 + 3 + 5)}
