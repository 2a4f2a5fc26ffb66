"""A signal that comes while a pool starts a worker: obeyed after that; the worker has nothing to tell."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

# The signal comes when the worker's process is there and was not told yet what it is for.
_PROGRAM = """
import multiprocessing, os, signal, sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import util
from hil.core.errors import Stopped
from hil.runs.interruption import take_signals
from hil.study.workers import submit

begin = util.spawnv_passfds

def begin_and_signal(*arguments):
    pid = begin(*arguments)
    if b"spawn_main" in b" ".join(map(os.fsencode, arguments[1])):
        os.kill(os.getpid(), signal.SIGTERM)
    return pid

if __name__ == "__main__":
    take_signals()
    util.spawnv_passfds = begin_and_signal
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        try:
            {how}
        except Stopped as stopped:
            print("stopped by", stopped)
"""


@pytest.mark.parametrize(
    ("how", "whole"), [("submit(pool, abs, -1)", True), ("pool.submit(abs, -1)", False)]
)
def test_a_worker_that_is_being_started_is_started_first(how: str, whole: bool, tmp_path) -> None:
    """The pool's own way breaks the start off, and the worker tells of it by a traceback (control)."""
    file = tmp_path / "program.py"
    file.write_text(_PROGRAM.replace("{how}", how), encoding="utf-8")
    said = subprocess.run(
        [sys.executable, str(file)], capture_output=True, text=True, timeout=60, check=False
    )
    assert said.stdout == f"stopped by {signal.SIGTERM.name}\n"
    assert ("Traceback" not in said.stderr) == whole, said.stderr
