"""What the core's SHA-256 costs the board, and that it is SHA-256 there: run under simavr by itself.

`python -m tests.pil.signing_cost` prints the cycles of a block, and what signatures take at the link's rates.
"""

from __future__ import annotations

import hashlib
import random
import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hil.board.build import find_toolchain, sketch_folder
from hil.wire import dialect

CLOCK_HZ = 16_000_000
RATES_HZ = {"WHEEL_SETPOINT": 30, "WHEEL_STATE": 50}
# Key, header, CRC, link id and time stamp are hashed with the payload; the digest's padding takes nine bytes.
_OVERHEAD_BYTES = 32 + 10 + 2 + 1 + 6
_BLOCK_BYTES, _PADDING_BYTES = 64, 9
_SOURCES = ("sha256.cpp", "sha256.h", "sha256_avr.S", "flash.h")
_PROGRAM = """
#include <avr/io.h>
#include <avr/interrupt.h>
#include <avr/sleep.h>
#include "sha256.h"
const uint8_t texts[][128] PROGMEM = {TEXTS};
static void put(char c) { while (!(UCSR0A & (1 << UDRE0))) {} UDR0 = c; }
static void say(uint32_t v) {
  char digits[12]; int n = 0;
  do { digits[n++] = '0' + v % 10; v /= 10; } while (v);
  put('=');
  while (n) put(digits[--n]);
  put('\\n');
}
static hil::Sha256 sha;
static uint8_t text[128];
int main() {
  UBRR0 = 0;
  UCSR0B = 1 << TXEN0;
  for (uint8_t i = 0; i < sizeof(texts) / 128; ++i) {
    memcpy_P(text, texts[i], 128);
    hil::sha256_init(sha);
    uint32_t cycles = 0, slice = 0;
    for (uint8_t block = 0; block < 2; ++block) {
      TCCR1B = 0; TCNT1 = 0; TCCR1B = 1;
      hil::sha256_words(sha, 0, text + 64 * block, 16);
      hil::sha256_begin(sha);
      cycles += TCNT1;
      for (bool done = false; !done;) {
        TCNT1 = 0;
        done = hil::sha256_slice(sha);
        const uint16_t took = TCNT1;
        cycles += took;
        if (took > slice) slice = took;
      }
    }
    say(cycles / 2);
    say(slice);
    for (uint8_t k = 0; k < 8; ++k) say(sha.h[k]);
  }
  cli();
  sleep_enable();
  sleep_cpu();
  for (;;) {}
}
"""


@dataclass(frozen=True, slots=True)
class Cost:
    """Cycles of a block, and of its longest slice; `digests` are what the processor made of the texts."""

    block: int
    slice: int
    digests: tuple[bytes, ...]

    def signature(self, name: str) -> int:
        """Return the cycles that the blocks of a signed message take, without the key's eight rounds."""
        size = getattr(dialect, f"MAVLink_{name.lower()}_message").unpacker.size
        blocks = -(-(_OVERHEAD_BYTES + size + _PADDING_BYTES) // _BLOCK_BYTES)
        return self.block * blocks - self.block * 8 // 64


def texts_drawn(count: int) -> list[bytes]:
    """Return texts whose padding ends in the second block: drawn, and the longest and shortest of them."""
    rng = random.Random(1)
    sizes = [56, 119, *(rng.randint(56, 119) for _ in range(count - 2))]
    return [rng.randbytes(size) for size in sizes]


def _padded(text: bytes) -> bytes:
    return text + b"\x80" + bytes(128 - 9 - len(text)) + (8 * len(text)).to_bytes(8, "big")


def measure(texts: Sequence[bytes], first_word: str = "") -> Cost:
    """Run the core's code on the processor; `first_word` takes the place of the first of its constants."""
    folder_of_core = sketch_folder() / "src/core"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for source in _SOURCES:
            shutil.copy(folder_of_core / source, folder)
        if first_word:
            code = (folder / "sha256.cpp").read_text()
            (folder / "sha256.cpp").write_text(code.replace("0x428a2f98", first_word))
        rows = ",".join("{" + ",".join(map(str, _padded(text))) + "}" for text in texts)
        (folder / "main.cpp").write_text(
            "#include <avr/pgmspace.h>\n" + _PROGRAM.replace("TEXTS", rows)
        )
        files = ["main.cpp", "sha256.cpp", "sha256_avr.S"]
        compiler = [find_toolchain().tool("gcc"), "-mmcu=atmega2560", "-std=gnu++11", "-Os", "-w"]
        subprocess.run([*compiler, *files, "-o", "hash.elf"], cwd=folder, check=True)
        done = subprocess.run(
            ["simavr", "-m", "atmega2560", "-f", str(CLOCK_HZ), "hash.elf"],
            cwd=folder, capture_output=True, text=True, check=True, timeout=60,
        )  # fmt: skip
    said = [int(text) for text in re.findall(r"=(\d+)", done.stdout + done.stderr)]
    rows_said = [said[at : at + 10] for at in range(0, len(said), 10)]
    digests = tuple(b"".join(w.to_bytes(4, "big") for w in row[2:]) for row in rows_said)
    return Cost(max(row[0] for row in rows_said), max(row[1] for row in rows_said), digests)


def expected(texts: Sequence[bytes]) -> tuple[bytes, ...]:
    """Return the digests by hashlib."""
    return tuple(hashlib.sha256(text).digest() for text in texts)


def main() -> None:
    """Print what a block and a signature take."""
    cost = measure(texts_drawn(4))
    print(f"a block: {cost.block} cycles, its longest slice {cost.slice}")
    for name, rate_hz in RATES_HZ.items():
        cycles = cost.signature(name)
        share = cycles * rate_hz / CLOCK_HZ
        print(
            f"{name}: {cycles} cycles, {1e3 * cycles / CLOCK_HZ:.1f} ms, {share:.1%} at {rate_hz} Hz"
        )


if __name__ == "__main__":
    main()
