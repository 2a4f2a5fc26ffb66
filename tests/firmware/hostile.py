"""Millions of hostile frames against the board's core under sanitizers.

`python -m tests.firmware.hostile` throws 10 million, half of them at a board that nobody arms, and says
how many went by without motion, a bad access or undefined behaviour; the tests throw fewer.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from hil.board import codegen

FIRMWARE = codegen.ROOT / "firmware_arduino"
SANITIZERS = (
    "-fsanitize=address,undefined,float-cast-overflow",
    "-fno-sanitize-recover=all",
)
# Frames of one run of the program; seeds go on from run to run.
_BATCH = 250_000


def build(program: Path, level: str = "-O0") -> None:
    """Compile the core and what throws frames at it, with ASan and UBSan."""
    sources = [
        FIRMWARE / "host" / "hostile_bytes.cpp",
        *sorted((FIRMWARE / "src/core").glob("*.cpp")),
    ]
    warnings = ["-Wall", "-Wextra", "-Werror"]
    compiler = ["c++", "-std=c++17", level, "-ffp-contract=off", *warnings, *SANITIZERS]
    command = [*compiler, f"-I{FIRMWARE / 'src'}", *map(str, sources), "-o", str(program)]
    subprocess.run(command, check=True)


def throw(program: Path, frames: int, seed: int) -> str:
    """Throw so many frames at a board unarmed and as many at an armed one; return what is wrong."""
    command = [str(program), str(frames), str(seed)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    wanted = f"{frames} frames unarmed, {frames} armed, {frames // 4} with a key: no fault"
    if done.returncode == 0 and wanted in done.stdout:
        return ""
    return f"seed {seed}: {done.stderr.strip() or done.stdout.strip() or done.returncode}"


def main(say: Callable[[str], None] = print) -> int:
    """Throw frames until the count is reached; return 1 when one did what it must not."""
    options = argparse.ArgumentParser(description=main.__doc__)
    options.add_argument("--frames", type=int, default=10_000_000, help="in all")
    options.add_argument("--seed", type=int, default=1)
    asked = options.parse_args()
    batches = -(-asked.frames // (2 * _BATCH))
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "hostile_bytes"
        build(program, "-O2")
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            seeds = range(asked.seed, asked.seed + batches)
            bad = [
                text for text in pool.map(lambda seed: throw(program, _BATCH, seed), seeds) if text
            ]
    for text in bad:
        say(text)
    half = batches * _BATCH
    say(
        f"{half} hostile frames to a board unarmed, {half} to one armed: {len(bad)} runs with a fault"
    )
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
