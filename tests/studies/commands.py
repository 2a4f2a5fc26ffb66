"""`hil` as a person runs it: what it says, ends with, and leaves when it is stopped."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import pytest

from hil.cli.main import main

PROGRAM = [sys.executable, "-m", "hil"]
_POLL_S = 0.05
_PATIENCE_S = 120.0


@dataclass(frozen=True, slots=True)
class Said:
    """What a command said and ended with."""

    returncode: int
    stdout: str
    stderr: str


def hil(folder: Path, *words: str) -> Said:
    """Run the command line in a folder to its end, in this process: its imports are made once."""
    out, err = io.StringIO(), io.StringIO()
    with (
        chdir(folder), patch.object(sys, "argv", ["hil", *words]),
        redirect_stdout(out), redirect_stderr(err), pytest.raises(SystemExit) as ended,
    ):  # fmt: skip
        main()
    return Said(int(ended.value.code or 0), out.getvalue(), err.getvalue())


def stopped(
    folder: Path, words: list[str], number: signal.Signals, workers: int
) -> tuple[int, str]:
    """Begin `hil`, send it a signal when its workers are there, and return its status and stderr.

    Its worker processes are its session: when this returns none of them is left, or it raises.
    """
    process = subprocess.Popen(
        [*PROGRAM, *words], cwd=folder, text=True, start_new_session=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    # With the workers comes the process in which Python tracks what they share.
    wait_until(lambda: len(members(process.pid)) >= workers + 2 or process.poll() is not None)
    assert process.poll() is None, process.communicate()
    process.send_signal(number)
    _, errors = process.communicate()  # the pipe ends with the last process that has it
    wait_until(lambda: not members(process.pid))
    return process.returncode, errors


def members(session: int) -> list[int]:
    """Return the living processes of a session."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text(encoding="utf-8").rpartition(")")[2].split()
                if os.getsid(int(entry.name)) == session and fields[0] != "Z":
                    found.append(int(entry.name))
            except OSError:  # it ended meanwhile
                continue
    return found


def wait_until(true: Callable[[], bool]) -> None:
    """Wait for something another process does; raises TimeoutError when it never does."""
    end_s = time.monotonic() + _PATIENCE_S
    while not true():
        if time.monotonic() > end_s:
            raise TimeoutError
        time.sleep(_POLL_S)
