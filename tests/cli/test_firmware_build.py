"""`hil firmware build`, `upload` and `codegen` as a person runs them."""

from __future__ import annotations

import json
import os
import shutil
import signal
import stat
import subprocess
from pathlib import Path

import pytest

from hil.board import build
from tests.cli.command import hil
from tests.pil.rigs import needs_toolchain
from tests.studies.commands import PROGRAM, wait_until


@pytest.fixture
def programmer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Put an avrdude on the path that notes how it was called; return the folder with `called`."""
    folder = tmp_path / "bin"
    folder.mkdir()
    tool = folder / "avrdude"
    tool.write_text(f'#!/bin/sh\necho "$@" >> {folder}/called\n', encoding="utf-8")
    tool.chmod(tool.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    return folder


@needs_toolchain
def test_build_says_what_it_made_and_upload_sends_it(tmp_path: Path, programmer: Path) -> None:
    """The id and sizes on stdout are those of the build; its HEX is what the programmer is given."""
    done = hil("firmware", "build")
    assert done.status == 0, done.err
    made = build.build()
    assert done.out.splitlines() == [
        f"build {made.build_id}: {made.elf} and {made.hex.name}",
        f"flash {made.flash_bytes} bytes, static RAM {made.ram_bytes} bytes",
    ]
    port = tmp_path / "ttyACM0"
    port.touch()
    done = hil("firmware", "upload", port)
    assert (done.status, done.out) == (0, f"build {made.build_id} is on the board at {port}\n")
    called = (programmer / "called").read_text(encoding="utf-8").split()
    assert called[called.index("-P") + 1] == str(port)
    assert called[-1] == f"flash:w:{made.hex}:i"


@pytest.mark.usefixtures("programmer")
def test_what_cannot_be_built_or_sent_is_one_line(tmp_path: Path, monkeypatch) -> None:
    """A file in place of the folder; no such port, and no programmer, are told before anything is built."""
    (tmp_path / "file").touch()
    if shutil.which("avr-gcc"):
        assert f"--out {tmp_path / 'file'}: cannot be made" in hil(
            "firmware", "build", "--out", tmp_path / "file"
        ).refusal  # fmt: skip
    monkeypatch.setattr(build, "build", lambda *_: pytest.fail("was built for nothing"))
    assert "not there; ports on this machine" in hil("firmware", "upload", tmp_path / "no").refusal
    monkeypatch.setenv("PATH", str(tmp_path))
    refusal = hil("firmware", "upload", tmp_path / "file").refusal
    assert "neither avrdude nor arduino-cli found" in refusal


def test_a_board_that_does_not_answer_is_a_rig_fault(
    programmer: Path, tmp_path: Path, monkeypatch
) -> None:
    """Exit status 3, with what the programmer said last."""
    (programmer / "avrdude").write_text("#!/bin/sh\necho stk500v2: timeout >&2\nexit 1\n")
    port = tmp_path / "ttyACM0"
    port.touch()
    made = build.Build("0123abcd", Path("none.elf"), Path("none.hex"), 1000, 100)
    monkeypatch.setattr(build, "build", lambda *_: made)
    done = hil("firmware", "upload", port)
    assert (done.status, done.out) == (3, "")
    assert "stk500v2: timeout; is the board on that port?" in done.err
    assert len(done.err.splitlines()) == 1


def test_generated_files_are_checked_and_a_stale_one_is_named(tmp_path: Path) -> None:
    """What it writes is up to date; an edited file makes the status 1."""
    assert hil("firmware", "codegen", "--out", tmp_path / "made").status == 0
    assert hil("firmware", "codegen", "--check", "--out", tmp_path / "made").status == 0
    edited = next(path for path in (tmp_path / "made").rglob("*") if path.suffix in {".h", ".hpp"})
    edited.write_text("// mine\n", encoding="utf-8")
    done = hil("firmware", "codegen", "--check", "--out", tmp_path / "made")
    assert done.status == 1
    assert edited.name in done.out


@needs_toolchain
@pytest.mark.realtime
def test_a_build_that_is_stopped_leaves_what_was_there(tmp_path: Path) -> None:
    """Ctrl-C while the compiler runs: status 130, one line, no file of the new build; then it is made."""
    out = tmp_path / "firmware"
    out.mkdir()
    words = [*PROGRAM, "firmware", "build", "--out", str(out)]
    process = subprocess.Popen(
        words, start_new_session=True, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    wait_until(lambda: any(out.rglob("*.o")) or process.poll() is not None)
    assert process.poll() is None, process.communicate()
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: the compiler has it too
    said, errors = process.communicate()
    assert (process.returncode, said) == (130, "")
    assert errors.splitlines()[-1] == "hil: stopped by Ctrl-C"
    assert list(out.iterdir()) == []
    again = subprocess.run(words, capture_output=True, text=True, check=False)
    assert again.returncode == 0, again.stderr
    assert json.loads((out / "build.json").read_text(encoding="utf-8"))["build_id"] in again.stdout
