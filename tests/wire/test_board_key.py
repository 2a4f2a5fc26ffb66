"""`hil firmware key` on a port: set, set again, named when wrong or missing, erased; over USB only."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(os.name != "posix", reason="a pseudo-terminal"),
]


@contextmanager
def served(folder: Path, *options: str) -> Iterator[None]:
    """Serve the twin on ./port while the block lasts."""
    words = ["twin", "serve", "--camera", "pose", "--pty", "port", "--frames", "frames", *options]
    server = subprocess.Popen(
        [sys.executable, "-m", "hil", *words], cwd=folder, stderr=subprocess.DEVNULL
    )
    try:
        while not (folder / "port").exists():
            time.sleep(0.1)
        yield
    finally:
        server.terminate()
        server.wait(timeout=10)


def hil(folder: Path, *words: str, key: str = "") -> tuple[int, str]:
    """Run a command there with HIL_KEY; return its status and the last line it says."""
    done = subprocess.run(
        [sys.executable, "-m", "hil", *words], cwd=folder, capture_output=True, text=True, check=False,
        timeout=60, env={**os.environ, "HIL_KEY": key},
    )  # fmt: skip
    lines = (done.stdout + done.stderr).strip().splitlines()
    return done.returncode, lines[-1] if lines else ""


READ = ("firmware", "params", "save", "--on", "port")


def test_a_key_is_set_used_and_erased_on_a_port(tmp_path):
    """Each mistake is one line and status 3, and changes nothing; with the key all goes on as before."""
    for name in ("mine", "other"):
        assert hil(tmp_path, "firmware", "key", "new", name)[0] == 0
    with served(tmp_path, "--usb"):
        assert hil(tmp_path, *READ, "a.toml")[0] == 0
        status, line = hil(tmp_path, *READ, "b.toml", key="mine")
        assert (status, "does not sign, so it has no key" in line) == (3, True), line
        for _ in range(2):
            status, line = hil(tmp_path, "firmware", "key", "set", "mine", "--on", "port")
            assert (status, line[:14]) == (0, "set and stored"), line
        status, line = hil(tmp_path, *READ, "b.toml")
        assert (status, "this host was given none" in line) == (3, True), line
        status, line = hil(tmp_path, *READ, "b.toml", key="other")
        assert (status, "signs with another key than other" in line) == (3, True), line
        assert not (tmp_path / "b.toml").exists()
        assert hil(tmp_path, *READ, "b.toml", key="mine")[0] == 0
        assert (tmp_path / "a.toml").read_text() == (tmp_path / "b.toml").read_text()
        status, line = hil(tmp_path, "firmware", "key", "clear", "--on", "port")
        assert (status, line[:6]) == (0, "erased"), line
        assert hil(tmp_path, *READ, "c.toml")[0] == 0


def test_a_key_is_not_set_over_bluetooth(tmp_path):
    """The board's own words, status 3; it goes on without a key."""
    assert hil(tmp_path, "firmware", "key", "new", "mine")[0] == 0
    with served(tmp_path):
        status, line = hil(tmp_path, "firmware", "key", "set", "mine", "--on", "port")
        assert (status, "key refused: it is set over the USB port only" in line) == (3, True), line
        assert hil(tmp_path, *READ, "a.toml")[0] == 0
