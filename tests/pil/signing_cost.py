"""What MAVLink's signature would cost the board: cycles of SHA-256 on the processor, under simavr.

`python -m tests.pil.signing_cost` prints cycles and time of one signed WHEEL_SETPOINT and WHEEL_STATE, and
the share of the processor at their rates: by the code that mavgen brings along, and by one written for
eight bits (tests/pil/sha256_eight_bits.h). docs/firmware.md has the figures.
"""

from __future__ import annotations

import hashlib
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from hil.board.build import find_toolchain, sketch_folder
from hil.wire import dialect

CLOCK_HZ = 16_000_000
# The secret key, then header, CRC, link id and time stamp are hashed with the payload; set-points come at
# 30 Hz, reports at 50.
KEY_BYTES, _OVERHEAD_BYTES = 32, 10 + 2 + 1 + 6
RATES_HZ = {"WHEEL_SETPOINT": 30, "WHEEL_STATE": 50}
_BLOCK_BYTES, _PADDING_BYTES = 64, 9
# What is hashed: the bytes 0, 1, 2, ... padded to one block; the first word of its digest is said too.
_SAMPLE_BYTES = 55
_PROGRAM = """
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#define MAVLINK_HELPER static
#define KWHERE PROGMEM
#define KLOAD(p) pgm_read_dword(p)
#include "mavlink_sha256.h"
#undef R8
#include "sha256_eight_bits.h"
volatile uint8_t message[128], signature[6];
static void put(char c) { while (!(UCSR0A & (1 << UDRE0))) {} UDR0 = c; }
static void say(uint32_t v) {
  char digits[12]; int n = 0;
  do { digits[n++] = '0' + v % 10; v /= 10; } while (v);
  put('=');
  while (n) put(digits[--n]);
  put('\\n');
}
static uint32_t cycles_of(uint16_t bytes) {
  static mavlink_sha256_ctx ctx;
  uint8_t key[32], out[6];
  memset(key, 7, sizeof key);
  TCNT1 = 0;
  TCCR1B = 2;  // a count is 8 cycles
  mavlink_sha256_init(&ctx);
  mavlink_sha256_update(&ctx, key, 32);
  mavlink_sha256_update(&ctx, (const void *)message, bytes);
  mavlink_sha256_final_48(&ctx, out);
  memcpy((void *)signature, out, 6);
  return 8UL * TCNT1;
}
static uint32_t state[8] = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                            0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
static uint32_t cycles_of_block(void) {
  static uint8_t block[64];
  for (uint8_t i = 0; i < SAMPLE; ++i) block[i] = i;
  block[SAMPLE] = 0x80;
  block[62] = SAMPLE * 8 / 256;
  block[63] = SAMPLE * 8 % 256;
  TCNT1 = 0;
  TCCR1B = 2;
  take_block(state, block);
  return 8UL * TCNT1;
}
int main(void) {
  UBRR0 = 0;
  UCSR0B = 1 << TXEN0;
  SAY
  say(cycles_of_block());
  say(state[0]);
  cli();
  sleep_enable();
  sleep_cpu();
  for (;;) {}
}
"""


@dataclass(frozen=True, slots=True)
class Cost:
    """Cycles of one signature by message, by mavgen's code, and of one block by the one for eight bits."""

    mavgen: dict[str, int]
    block: int

    def eight_bits(self) -> dict[str, int]:
        """Return the cycles of one signature by message: of its blocks alone."""
        return {name: self.block * blocks for name, blocks in _blocks().items()}


def _sizes() -> dict[str, int]:
    """Return what of each message is hashed after the key, with the whole payload, in bytes."""
    return {
        name: _OVERHEAD_BYTES + getattr(dialect, f"MAVLink_{name.lower()}_message").unpacker.size
        for name in RATES_HZ
    }


def _blocks() -> dict[str, int]:
    whole = {name: KEY_BYTES + size + _PADDING_BYTES for name, size in _sizes().items()}
    return {name: -(-size // _BLOCK_BYTES) for name, size in whole.items()}


def measure() -> Cost:
    """Run both on the processor; raises ValueError where the digest is not SHA-256's."""
    sizes = _sizes()
    header = (sketch_folder() / "src/mavlink/mavlink_sha256.h").read_text()
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        (folder / "mavlink_sha256.h").write_text(header.replace('#include "mavlink_types.h"', ""))
        shutil.copy(Path(__file__).with_name("sha256_eight_bits.h"), folder)
        says = " ".join(f"say(cycles_of({size}));" for size in sizes.values())
        program = _PROGRAM.replace("SAY", says).replace("SAMPLE", str(_SAMPLE_BYTES))
        (folder / "sign.c").write_text(program)
        compiler = [
            find_toolchain().tool("gcc"),
            "-mmcu=atmega2560",
            "-DF_CPU=16000000L",
            "-Os",
            "-w",
        ]
        subprocess.run([*compiler, "sign.c", "-o", "sign.elf"], cwd=folder, check=True)
        simavr = shutil.which("simavr") or "simavr"
        done = subprocess.run(
            [simavr, "-m", "atmega2560", "-f", str(CLOCK_HZ), "sign.elf"],
            cwd=folder, capture_output=True, text=True, check=True, timeout=60,
        )  # fmt: skip
    *mavgen, block, word = (int(text) for text in re.findall(r"=(\d+)", done.stdout + done.stderr))
    wanted = hashlib.sha256(bytes(range(_SAMPLE_BYTES))).digest()[:4]
    if word != int.from_bytes(wanted, "big"):
        raise ValueError(f"the digest begins with {word:08x}, SHA-256's with {wanted.hex()}")
    return Cost(dict(zip(sizes, mavgen, strict=True)), block)


def main() -> None:
    """Print the table."""
    cost = measure()
    for code, found in (("mavgen's", cost.mavgen), ("for eight bits", cost.eight_bits())):
        for name, cycles in found.items():
            share = cycles * RATES_HZ[name] / CLOCK_HZ
            print(
                f"{code}: {name}: {cycles} cycles, {1e3 * cycles / CLOCK_HZ:.1f} ms, {share:.1%} of the "
                f"processor at {RATES_HZ[name]} Hz"
            )


if __name__ == "__main__":
    main()
