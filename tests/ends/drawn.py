"""Ends of the real process at drawn instants: signals, files that may not grow, a folder that goes.

`python -m tests.ends.drawn --count 300` does hundreds and prints what each kind came to; the tests do
a few of each kind. An end is good when nothing says "running" afterwards, what was written can be read,
the robot was told to stop before the record was closed, the status is the kind's own, and no
traceback reaches the terminal.
"""

from __future__ import annotations

import argparse
import collections
import json
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from hil.core.errors import BadInput
from hil.record.reader import read_run

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
KINDS = ("SIGINT", "SIGTERM", "SIGHUP", "twice", "file limit", "folder gone")
# A run takes about so long from the start of its process to its end on an idle core, s.
WHOLE_S = 2.0
RUN = [
    sys.executable, "-m", "hil", "run", "circle", "--camera", "pose", "--set", "duration_s=20",
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class End:
    """One end: what was done when, and what was left; `flaws` is empty for a good one."""

    kind: str
    drawn: float
    status: int
    said: str
    flaws: tuple[str, ...]


def end(kind: str, rng: random.Random, folder: Path) -> End:
    """Run once into `folder` and end it in this way at an instant, or a size, that is drawn."""
    drawn = rng.uniform(0.0, WHOLE_S)
    limit_bytes = int(10.0 ** rng.uniform(3.3, 6.0)) if kind == "file limit" else None

    process = subprocess.Popen(
        [*RUN, "--out", str(folder)], text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    if limit_bytes is not None:
        limit_files(process, limit_bytes)
    else:
        wait_for_python(process)
        time.sleep(drawn if kind != "folder gone" else 0.0)
    _strike(kind, process, folder, rng)
    out, said = process.communicate(timeout=120)
    status = process.returncode
    flaws = [] if status in _statuses(kind, folder) else [f"status {status}: {said[-300:]}"]
    if "Traceback" in said:
        flaws.append(f"a traceback: {said[-1500:]}")
    flaws += _flaws_of(folder, status) if kind != "folder gone" else _left_over(folder)
    at = float(limit_bytes) if limit_bytes is not None else drawn
    return End(kind, at, status, (said or out).strip(), tuple(flaws))


def limit_files(process: subprocess.Popen[str], limit_bytes: int) -> None:
    """Let no file of the process grow beyond that."""
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (limit_bytes, limit_bytes))


def wait_for_python(process: subprocess.Popen[str]) -> None:
    """Wait until the process takes signals itself: before that it has nothing that could be lost."""
    status = Path(f"/proc/{process.pid}/status")
    while process.poll() is None:
        caught = next((line for line in status.read_text().splitlines() if "SigCgt" in line), "0 0")
        if int(caught.split()[1], 16) >> (signal.SIGTERM - 1) & 1:
            return
        time.sleep(0.005)


def _strike(kind: str, process: subprocess.Popen[str], folder: Path, rng: random.Random) -> None:
    if kind == "folder gone":
        while process.poll() is None and not (folder / "manifest.json").exists():
            time.sleep(0.005)
        time.sleep(rng.uniform(0.0, WHOLE_S))  # while it is closed too
        shutil.rmtree(folder, ignore_errors=True)
    elif kind == "twice":
        number = rng.choice(SIGNALS)
        process.send_signal(number)
        time.sleep(rng.uniform(0.0, 0.3))
        process.send_signal(number)
    elif kind != "file limit":
        process.send_signal(signal.Signals[kind])


def _statuses(kind: str, folder: Path) -> set[int]:
    """Return the statuses that are right for an end of this kind; an end too late is none at all."""
    finished = {0, 1} if _outcome(folder) in {"complete", ""} else set()
    if kind in signal.Signals.__members__:
        return {128 + signal.Signals[kind]} | finished
    if kind == "twice":
        return {128 + number for number in SIGNALS} | finished
    return {3} | finished


def _outcome(folder: Path) -> str:
    path = folder / "manifest.json"
    return str(json.loads(path.read_text())["outcome"]) if path.exists() else ""


def _left_over(folder: Path) -> list[str]:
    """Return what is wrong with what a folder torn to pieces still holds."""
    return ["the outcome is still running"] if _outcome(folder) == "running" else []


def _flaws_of(folder: Path, status: int) -> list[str]:
    if not (folder / "manifest.json").exists():
        return []
    try:
        run = read_run(folder)
    except BadInput as error:
        return [f"not readable: {error}"]
    flaws = []
    if run.manifest.outcome == "running":
        flaws.append("the outcome is still running")
    if list(folder.glob("*.part")) or (folder / ".reserve").exists():
        flaws.append("leavings")
    kinds = [event.kind for event in run.events]
    armed = "armed" in kinds
    written = status != 3  # a record that cannot be written cannot say so
    if armed and written and not {"stopped", "stop"} & set(kinds[kinds.index("armed") :]):
        flaws.append("the robot was not told to stop")
    return flaws


def main(say: Callable[[str], None] = print) -> int:
    """End a run many times; return 1 when an end was not a good one."""
    options = argparse.ArgumentParser(description=main.__doc__)
    options.add_argument("--count", type=int, default=300)
    options.add_argument("--seed", type=int, default=1)
    asked = options.parse_args()
    tally: collections.Counter[str] = collections.Counter()
    bad = 0
    for number in range(asked.count):
        kind = KINDS[number % len(KINDS)]
        with tempfile.TemporaryDirectory() as folder:
            done = end(kind, random.Random(f"{asked.seed}/{number}"), Path(folder) / "run")
        tally[f"{kind}: status {done.status}"] += 1
        if done.flaws:
            bad += 1
            say(f"{kind} at {done.drawn:g}: {'; '.join(done.flaws)}")
    for text, count in sorted(tally.items()):
        say(f"{count:5d}  {text}")
    say(f"{asked.count - bad} of {asked.count} ends were good")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
