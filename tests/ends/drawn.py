"""Ends of the real process at drawn instants: signals, kills, files and disks that fill, readers that go.

`python -m tests.ends.drawn --count 300` does hundreds and prints what each kind came to; the tests do
a few. An end is good when nothing says "running" afterwards (but after a kill, which nobody is told of),
what was written can be read, the robot was told to stop before the record was closed, the status is the
kind's own, no more than a few lines and no traceback reach the terminal, no process is left, and the same
command goes on with what is there.
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from hil.core.errors import BadInput
from hil.record.reader import read_run
from tests.ends.commands import COMMANDS, DISK, Command, outcome, prepare, records

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
KINDS = (
    "SIGINT", "SIGTERM", "SIGHUP", "twice", "SIGKILL", "file limit", "disk full", "folder gone",
    "reader gone", "terminal lost",
)  # fmt: skip
# Every other end is one of a run; the commands that do many runs take turns.
TURNS = tuple(name for other in list(COMMANDS)[1:] for name in ("run", other))
_MOST_LINES = 3
# A worker that outlives its parent by more has been left.
_LEFT_S = 10.0


@dataclass(frozen=True, slots=True)
class End:
    """One end: what was done when, and what was left; `flaws` is empty for a good one."""

    command: str
    kind: str
    drawn: float
    status: int
    said: str
    flaws: tuple[str, ...]


def kinds() -> tuple[str, ...]:
    """Return the kinds that can be done here: a disk of its own needs the right to mount one."""
    return tuple(kind for kind in KINDS if kind != "disk full" or os.geteuid() == 0)


def end(command: Command, kind: str, rng: random.Random, folder: Path) -> End:
    """Run a command in `folder` and end it in this way at an instant, or a size, that is drawn."""
    prepare(folder)
    drawn = rng.uniform(0.0, 1.2 * command.whole_s)
    if kind in {"file limit", "disk full"}:
        drawn = float(
            int(10.0 ** rng.uniform(*((3.3, 6.0) if kind == "file limit" else (4.8, 6.3))))
        )
    with _disk(kind, folder, int(drawn)) as give_room:
        process, said = _ended(command, kind, drawn, rng, folder)
        flaws = _flaws(command, kind, process, said, folder)
        if not flaws and command.kept is not None and kind != "folder gone":
            give_room()
            flaws = _goes_on(command, folder)
    return End(command.name, kind, drawn, process.returncode, said.strip(), tuple(flaws))


def _ended(
    command: Command, kind: str, drawn: float, rng: random.Random, folder: Path
) -> tuple[subprocess.Popen[str], str]:
    """Run the command and end it; return the process and what it said."""
    if kind == "terminal lost":
        return _in_a_terminal(command, drawn, folder)
    process = subprocess.Popen(
        command.line(folder), text=True, cwd=folder, start_new_session=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    if kind == "file limit":
        limit_files(process, int(drawn))
    elif kind != "disk full":
        wait_for_python(process)
        time.sleep(drawn if kind != "folder gone" else 0.0)
    _strike(command, kind, process, folder, rng)
    if kind == "reader gone":
        assert process.stdout is not None
        process.stdout.close()
        process.stdout = None
    _, said = process.communicate(timeout=300)
    return process, said


def _in_a_terminal(
    command: Command, drawn: float, folder: Path
) -> tuple[subprocess.Popen[str], str]:
    """Run the command in a terminal of its own and close that."""
    master, slave = os.openpty()
    helper = [sys.executable, "-c", _TAKE_TERMINAL, *command.line(folder)]
    process = subprocess.Popen(
        helper,
        text=True,
        cwd=folder,
        start_new_session=True,
        stdin=slave,
        stdout=slave,
        stderr=slave,
    )
    os.close(slave)
    wait_for_python(process)
    end_s = time.monotonic() + drawn
    os.set_blocking(master, False)
    said = b""
    while time.monotonic() < end_s and process.poll() is None:
        with contextlib.suppress(OSError):  # nothing there, or the other end has gone
            said += os.read(master, 65_536)
        time.sleep(0.01)
    os.close(master)
    process.wait(timeout=300)
    return process, "\n".join(
        line for line in said.decode(errors="replace").splitlines() if "Traceback" in line
    )


# The first process of a session takes a terminal; what it becomes keeps it.
_TAKE_TERMINAL = (
    "import fcntl, os, sys, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0); "
    "os.execv(sys.argv[1], sys.argv[1:])"
)


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


@contextlib.contextmanager
def _disk(kind: str, folder: Path, size_bytes: int) -> Iterator[Callable[[], None]]:
    """Put a small disk where results go to; what is given makes it a large one."""
    if kind != "disk full":
        yield lambda: None
        return
    disk = str(folder / DISK)

    def mount(options: str) -> None:
        subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", disk], check=True)

    mount(f"size={size_bytes}")
    try:
        yield lambda: mount("remount,size=64m")
    finally:
        subprocess.run(["umount", "-l", disk], check=True)


def _strike(
    command: Command, kind: str, process: subprocess.Popen[str], folder: Path, rng: random.Random
) -> None:
    """Do it: a signal goes to the process, or to all that the terminal has, as Ctrl-C does."""
    if kind == "folder gone":
        out = command.out(folder)
        while process.poll() is None and not (
            out.exists() and (out.is_file() or any(out.iterdir()))
        ):
            time.sleep(0.005)
        time.sleep(rng.uniform(0.0, command.whole_s))  # while it is closed too
        shutil.rmtree(folder / DISK, ignore_errors=True)
    elif kind == "twice":
        number = rng.choice(SIGNALS)
        _send(process, number, rng)
        time.sleep(rng.uniform(0.0, 0.3))
        _send(process, number, rng)
    elif kind in signal.Signals.__members__:
        _send(process, signal.Signals[kind], rng)


def _send(process: subprocess.Popen[str], number: signal.Signals, rng: random.Random) -> None:
    if process.poll() is not None:
        return
    if number == signal.SIGINT or (number == signal.SIGHUP and rng.random() < 0.5):
        os.killpg(process.pid, number)
    else:
        process.send_signal(number)


def _statuses(command: Command, kind: str, folder: Path) -> set[int]:
    """Return the statuses that are right for an end of this kind; an end too late is none at all."""
    ended = all(outcome(record) == "complete" for record in records(folder))
    finished = {0, 1} if ended or command.kept is not None else set()
    if kind in signal.Signals.__members__:
        number = signal.Signals[kind]
        return {-number if number == signal.SIGKILL else 128 + number} | finished
    if kind == "twice":
        return {128 + number for number in SIGNALS} | finished
    if kind == "reader gone":
        return {0, 1}
    return {129 if kind == "terminal lost" else 3} | finished


def _flaws(
    command: Command, kind: str, process: subprocess.Popen[str], said: str, folder: Path
) -> list[str]:
    flaws = []
    if process.returncode not in _statuses(command, kind, folder):
        flaws.append(f"status {process.returncode}: {said[-300:]}")
    if "Traceback" in said or said.count("\n") > _MOST_LINES:
        flaws.append(f"said: {said[-1500:]}")
    if kind == "reader gone" and said:
        flaws.append(f"said: {said[-300:]}")
    if left := _left(process.pid):
        flaws.append(f"processes left: {left}")
    for record in records(folder) if (folder / DISK).exists() else []:
        flaws += _flaws_of(record, kind, process.returncode)
    return flaws


def _left(session: int) -> list[str]:
    """Return the commands of processes that are still there after a while; they are killed."""
    end_s = time.monotonic() + _LEFT_S
    while (found := _of_session(session)) and time.monotonic() < end_s:
        time.sleep(0.05)
    for number in found:
        with contextlib.suppress(OSError):
            os.kill(number, signal.SIGKILL)
    return list(found.values())


def _of_session(session: int) -> dict[int, str]:
    found = {}
    for entry in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError, ValueError):
            state, _, _, of = (entry / "stat").read_text().rpartition(")")[2].split()[:4]
            if int(of) == session and state != "Z":
                words = (entry / "cmdline").read_bytes().replace(b"\0", b" ")
                found[int(entry.name)] = words.decode(errors="replace")[-120:].strip()
    return found


def _flaws_of(record: Path, kind: str, status: int) -> list[str]:
    """Return what is wrong with one record."""
    try:
        run = read_run(record)
    except BadInput as error:
        torn = kind == "folder gone" or (kind == "SIGKILL" and "cut off before" in str(error))
        return [] if torn else [f"not readable: {error}"]
    flaws = []
    if run.manifest.outcome == "running":
        flaws.append("the outcome is still running")
    leavings = list(record.glob("*.part")) or (record / ".reserve").exists()
    if leavings and kind not in {"SIGKILL", "folder gone"}:
        flaws.append("leavings")
    kinds_of = [event.kind for event in run.events]
    armed = "armed" in kinds_of
    written = status != 3 and kind != "SIGKILL"  # else nobody can, or may, say so
    if armed and written and not {"stopped", "stop"} & set(kinds_of[kinds_of.index("armed") :]):
        flaws.append("the robot was not told to stop")
    return flaws


def _goes_on(command: Command, folder: Path) -> list[str]:
    """Give the same command again; return what is wrong with what it comes to."""
    out = command.out(folder)
    if command.name == "tune" and out.exists():
        return []  # it was done
    assert command.kept is not None
    kept = command.kept(out)
    again = subprocess.run(
        command.line(folder), capture_output=True, text=True, cwd=folder, check=False
    )
    flaws = (
        [] if again.returncode in {0, 1} else [f"again: {again.returncode}: {again.stderr[-500:]}"]
    )
    if lost := kept - command.kept(out):
        flaws.append(f"again: {len(lost)} of {len(kept)} results were not kept")
    bad = [record.name for record in records(folder) if outcome(record) != "complete"]
    return [*flaws, *(f"again: {name} is not complete" for name in bad)]


def main(say: Callable[[str], None] = print) -> int:
    """End commands many times; return 1 when an end was not a good one."""
    options = argparse.ArgumentParser(description=main.__doc__)
    options.add_argument("--count", type=int, default=300)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--only", choices=list(COMMANDS), help="one command")
    options.add_argument("--kind", choices=KINDS, help="one kind of end")
    asked = options.parse_args()
    for (
        each
    ) in SIGNALS:  # in the background they may be ignored, and would be by what is begun here
        signal.signal(each, signal.default_int_handler)
    tally: collections.Counter[str] = collections.Counter()
    bad = 0
    for number in range(asked.count):
        kind = asked.kind or kinds()[number % len(kinds())]
        name = asked.only or TURNS[number // len(kinds()) % len(TURNS)]
        with tempfile.TemporaryDirectory() as folder:
            rng = random.Random(f"{asked.seed}/{number}")
            done = end(COMMANDS[name], kind, rng, Path(folder))
        tally[f"{name}, {kind}: status {done.status}"] += 1
        if done.flaws:
            bad += 1
            say(f"{number}: {name}, {kind} at {done.drawn:g}: {'; '.join(done.flaws)}")
    for text, count in sorted(tally.items()):
        say(f"{count:5d}  {text}")
    say(f"{asked.count - bad} of {asked.count} ends were good")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
