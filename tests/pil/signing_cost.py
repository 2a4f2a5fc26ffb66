"""What MAVLink's own signature would cost the board: cycles of its SHA-256 on the processor, under simavr.

`python -m tests.pil.signing_cost` prints cycles and time of one signed WHEEL_SETPOINT and WHEEL_STATE,
and the share of the processor at their rates. docs/firmware.md has the figures.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from pathlib import Path

from hil.board.build import find_toolchain, sketch_folder
from hil.wire import dialect

CLOCK_HZ = 16_000_000
# Header, CRC, link id and time stamp are signed with the payload; set-points come at 30 Hz, reports at 50.
_OVERHEAD_BYTES = 10 + 2 + 1 + 6
RATES_HZ = {"WHEEL_SETPOINT": 30, "WHEEL_STATE": 50}
_PROGRAM = """
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#define MAVLINK_HELPER static
#include "mavlink_sha256.h"
volatile uint8_t message[128], signature[6];
static void put(char c) { while (!(UCSR0A & (1 << UDRE0))) {} UDR0 = c; }
static void say(uint32_t v) {
  char digits[12]; int n = 0;
  do { digits[n++] = '0' + v % 10; v /= 10; } while (v);
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
int main(void) {
  UBRR0 = 0;
  UCSR0B = 1 << TXEN0;
  SAY
  cli();
  sleep_enable();
  sleep_cpu();
  for (;;) {}
}
"""


def measure() -> dict[str, int]:
    """Return the cycles of one signature by message."""
    sizes = {
        name: _OVERHEAD_BYTES + getattr(dialect, f"MAVLink_{name.lower()}_message").unpacker.size
        for name in RATES_HZ
    }
    header = (sketch_folder() / "src/mavlink/mavlink_sha256.h").read_text()
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        (folder / "mavlink_sha256.h").write_text(header.replace('#include "mavlink_types.h"', ""))
        says = " ".join(f"say(cycles_of({size}));" for size in sizes.values())
        (folder / "sign.c").write_text(_PROGRAM.replace("SAY", says))
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
    found = re.findall(r"(\d{4,})\.", done.stdout + done.stderr)
    return dict(zip(sizes, map(int, found), strict=True))


def main() -> None:
    """Print the table."""
    for name, cycles in measure().items():
        share = cycles * RATES_HZ[name] / CLOCK_HZ
        print(
            f"{name}: {cycles} cycles, {1e3 * cycles / CLOCK_HZ:.1f} ms, {share:.0%} of the processor "
            f"at {RATES_HZ[name]} Hz"
        )


if __name__ == "__main__":
    main()
