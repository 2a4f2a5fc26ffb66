"""Looks at this machine: what is installed, which ports and cameras there are, what is missing.

Nothing here is fatal: a check that cannot be made is a line that says so, and each lack comes with
the way to mend it.
"""

from __future__ import annotations

import ctypes.util
import glob
import importlib
import os
import platform
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, Literal

from rich.markup import escape
from rich.table import Table

State = Literal["ok", "missing", "note"]

_DISTRIBUTION = "skid-steer-hil"
_SOURCE_ROOT = Path(__file__).resolve().parents[2]
_NATIVE = ("hil.board._firmware", "hil.control.estimators._fused", "sim_twin._native")
_PIL = "sim_twin._pil"  # built where its headers are; target pil alone needs it
_ARDUINO_CORE = Path("/usr/share/arduino/hardware/arduino/avr")
_APT = "Debian: apt install {}"
_PIL_HINT = "Debian: apt install libsimavr-dev libelf-dev, then .ci/setup again (builds it)"
_RUNNABLE = "can be run now"

# What a Mega 2560 or its usual copies say on USB; an HC-05 has no USB identity of its own.
_BOARD_VENDORS = {0x2341: "Arduino", 0x2A03: "Arduino", 0x1A86: "CH340", 0x0403: "FTDI"}


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the report; `hint` says how to get what is missing."""

    group: str
    name: str
    state: State
    detail: str
    hint: str = ""


def examine() -> list[Finding]:
    """Return everything found on this machine."""
    found = [
        *_system(),
        *_packages(),
        *_native_modules(),
        *_toolchain(),
        *_viewer(),
        *_ports(),
        *_cameras(),
    ]
    return [*found, *_runnable(found)]


def as_document(findings: list[Finding]) -> dict[str, Any]:
    """Return the findings as one JSON document."""
    return {
        "findings": [asdict(finding) for finding in findings],
        "missing": [f"{f.group}: {f.name}" for f in findings if f.state == "missing"],
        "can_run_now": [f.name for f in findings if f.group == _RUNNABLE and f.state == "ok"],
    }


def as_table(findings: list[Finding]) -> Table:
    """Return the findings as a table for the terminal."""
    table = Table(box=None, pad_edge=False)
    for title in ("", "what", "found"):
        table.add_column(title, overflow="fold")
    marks = {"ok": "[green]ok[/]", "missing": "[red]missing[/]", "note": "[yellow]note[/]"}
    group = ""
    for finding in findings:
        if finding.group != group:
            group = finding.group
            table.add_row("", f"[bold]{group}[/]")
        table.add_row(marks[finding.state], finding.name, escape(finding.detail))
        if finding.hint:
            table.add_row("", "", f"[dim]-> {escape(finding.hint)}[/]")
    return table


def _system() -> Iterator[Finding]:
    yield Finding("system", "python", "ok", f"{platform.python_version()} at {sys.executable}")
    yield Finding("system", "machine", "ok", f"{platform.platform()}, {os.cpu_count()} cores")


def _requirements() -> list[str]:
    """Return the packages this project asks for, from its metadata or its source tree."""
    try:
        lines = metadata.requires(_DISTRIBUTION) or []
    except metadata.PackageNotFoundError:
        project = tomllib.loads((_SOURCE_ROOT / "pyproject.toml").read_text(encoding="utf-8"))
        lines = project["project"]["dependencies"]
    return [line for line in lines if "extra ==" not in line]


def _packages() -> Iterator[Finding]:
    hint = "run the set-up command of the README again"
    for line in _requirements():
        name = re.split(r"[^A-Za-z0-9_.-]", line, maxsplit=1)[0]
        try:
            yield Finding("packages", name, "ok", metadata.version(name))
        except metadata.PackageNotFoundError:
            yield Finding("packages", name, "missing", f"wanted: {line}", hint)


def _native_modules() -> Iterator[Finding]:
    for name in (*_NATIVE, _PIL):
        try:
            module = importlib.import_module(name)
        except ImportError as error:
            yield Finding(
                "native modules",
                name,
                "missing",
                str(error),
                _PIL_HINT if name == _PIL else "pip install . (builds it with cmake)",
            )
            continue
        yield Finding("native modules", name, "ok", str(module.__file__))


def _version_line(program: str, *arguments: str) -> str:
    """Return the first line with a version number that a program says, or where it is."""
    path = shutil.which(program)
    assert path is not None
    try:
        run = subprocess.run(
            [path, *arguments], capture_output=True, text=True, timeout=10, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return path
    lines = (run.stdout + run.stderr).splitlines()
    return next((line.strip() for line in lines if re.search(r"\d\.\d", line)), path)


def _program(group: str, program: str, arguments: tuple[str, ...], hint: str) -> Finding:
    if shutil.which(program) is None:
        return Finding(group, program, "missing", "not on the search path", hint)
    return Finding(group, program, "ok", _version_line(program, *arguments))


def _folder(name: str, path: Path, package: str) -> Finding:
    if path.exists():
        return Finding("firmware tools", name, "ok", str(path))
    return Finding("firmware tools", name, "missing", f"no {path}", _APT.format(package))


def _toolchain() -> Iterator[Finding]:
    group = "firmware tools"
    yield _program(group, "avr-g++", ("--version",), _APT.format("gcc-avr"))
    yield _folder("avr-libc", Path("/usr/lib/avr/include/avr/io.h"), "avr-libc")
    yield _folder("arduino core", _ARDUINO_CORE, "arduino-core-avr")
    yield _program(group, "avrdude", ("-?",), _APT.format("avrdude"))
    library = ctypes.util.find_library("simavr")
    if library is None:
        yield Finding(
            group, "libsimavr", "missing", "library not found", _APT.format("libsimavr-dev")
        )
    else:
        yield Finding(group, "libsimavr", "ok", library)
    yield _folder("libsimavr headers", Path("/usr/include/simavr/sim_avr.h"), "libsimavr-dev")
    yield _folder("libelf headers", Path("/usr/include/libelf.h"), "libelf-dev")


def _runnable(found: list[Finding]) -> Iterator[Finding]:
    """Say which targets can run here as things are, and what keeps the others from it."""
    lacks = {f.name: f for f in found if f.state == "missing"}
    devices = {f.group: f.name for f in found if f.state == "ok" and f.hint.startswith("--")}
    base = [f.name for f in lacks.values() if f.group == "packages"]
    base += [name for name in _NATIVE if name in lacks]
    board = [name for name in ("avr-g++", "avr-libc", "arduino core") if name in lacks]
    simulated = [*board, *(name for name in (_PIL,) if name in lacks)]
    upload = [*board, *(name for name in ("avrdude",) if name in lacks)]
    port = [] if "serial ports" in devices else ["a serial port"]
    camera = [] if "cameras" in devices else ["a camera"]
    for name, needs in (
        ("--on twin: runs, experiments, campaigns, replays, reports", base),
        ("--on pil, hil replay --elf, hil bench firmware", base + simulated),
        ("hil firmware upload", base + upload + port),
        ("--on serial:DEV with --camera INDEX", base + port + camera),
    ):
        state: State = "note" if needs else "ok"
        yield Finding(_RUNNABLE, name, state, f"needs {', '.join(needs)}" if needs else "yes")


def _viewer() -> Iterator[Finding]:
    beside = Path(sys.executable).parent / "rerun"
    path = shutil.which("rerun") or (str(beside) if beside.exists() else None)
    if path is None:
        yield Finding("viewer", "rerun", "missing", "no program rerun", "pip install rerun-sdk")
    else:
        yield Finding("viewer", "rerun", "ok", path)
    if sys.platform == "linux" and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        yield Finding(
            "viewer",
            "display",
            "note",
            "none here: records and reports are written all the same",
            "open run.rrd on a machine with a screen, or `rerun --serve-web run.rrd`",
        )


def _ports() -> Iterator[Finding]:
    try:
        from serial.tools import list_ports  # noqa: PLC0415 - its absence is a finding above
    except ImportError:
        return
    ports = list(list_ports.comports())
    if not ports:
        yield Finding(
            "serial ports",
            "none",
            "note",
            "no board needed for --on twin or pil",
            "plug the board in, or pair the HC-05 (rfcomm bind), then ask again",
        )
    for port in ports:
        maker = _BOARD_VENDORS.get(port.vid or 0, "")
        what = " ".join(text for text in (maker, port.description, port.hwid) if text != "n/a")
        if os.name == "posix" and not os.access(port.device, os.R_OK | os.W_OK):
            hint = "sudo usermod -a -G dialout $USER, then log in again"
            yield Finding("serial ports", port.device, "missing", f"no permission; {what}", hint)
        else:
            yield Finding("serial ports", port.device, "ok", what, f"--on serial:{port.device}")


def _cameras() -> Iterator[Finding]:
    devices = sorted(glob.glob("/dev/video*"), key=lambda path: (len(path), path))
    if sys.platform != "linux":
        yield Finding("cameras", "not listed", "note", "this system names no cameras",
                      "try --camera 0, 1, ...")  # fmt: skip
        return
    if not devices:
        yield Finding(
            "cameras",
            "none",
            "note",
            "no camera needed for --on twin or pil",
            "plug it in; in a container, pass /dev/video0 through",
        )
    for device in devices:
        index = device.removeprefix("/dev/video")
        label = Path(f"/sys/class/video4linux/video{index}/name")
        name = label.read_text(encoding="utf-8").strip() if label.exists() else "camera"
        if os.access(device, os.R_OK | os.W_OK):
            yield Finding("cameras", device, "ok", name, f"--camera {index}")
        else:
            hint = "sudo usermod -a -G video $USER, then log in again"
            yield Finding("cameras", device, "missing", f"no permission; {name}", hint)
