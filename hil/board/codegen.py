"""Generates both worlds of the dialect from hil.xml: the board's C headers and `hil.wire.dialect`.

mavgen (pymavlink) does the work; `minimal.xml` comes from the installed pymavlink, so generation needs
no network. `check` regenerates and compares, leaving out the build date mavgen stamps into version.h.
"""

from __future__ import annotations

import contextlib
import io
import shutil
import tempfile
from pathlib import Path

import pymavlink.dialects.v20
from pymavlink.generator import mavgen, mavparse

from hil.core.errors import BadInput

ROOT = Path(__file__).resolve().parents[2]
XML = ROOT / "hil/wire/hil.xml"
PROJECT = ROOT / "pyproject.toml"
PYTHON_OUT = Path("hil/wire/dialect.py")
C_OUT = Path("firmware_arduino/src/mavlink")
_LEFT_OUT = ("testsuite.h",)  # mavgen's own tests: 100 KB the board never compiles
_DATE_MARK = "MAVLINK_BUILD_DATE"


def _mavgen(xml: Path, output: Path, language: str) -> None:
    options = mavgen.Opts(
        str(output), wire_protocol=mavparse.PROTOCOL_2_0, language=language, validate=False
    )
    with contextlib.redirect_stdout(io.StringIO()) as said:
        if not mavgen.mavgen(options, [str(xml)]):
            raise BadInput(f"mavgen refused {XML.name}: {said.getvalue().strip()[-200:]}")


def generate() -> dict[Path, str]:
    """Return every generated file: path inside the project -> text."""
    minimal = Path(next(iter(pymavlink.dialects.v20.__path__))) / "minimal.xml"
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        shutil.copy(XML, work / "hil.xml")
        shutil.copy(minimal, work / "minimal.xml")
        _mavgen(work / "hil.xml", work / "dialect.py", "Python3")
        _mavgen(work / "hil.xml", work / "c", "C")
        files = {PYTHON_OUT: (work / "dialect.py").read_text(encoding="utf-8")}
        for header in sorted((work / "c").rglob("*.h")):
            if header.name not in _LEFT_OUT:
                name = C_OUT / header.relative_to(work / "c")
                files[name] = header.read_text(encoding="utf-8")
    return files


def _without_date(text: str) -> list[str]:
    return [line for line in text.splitlines() if _DATE_MARK not in line]


def project_folder(asked: Path | None) -> Path:
    """Return the folder to generate into: the one asked for, else the checkout.

    Raises BadInput outside a checkout: an installed package is not written into.
    """
    if asked is None and not PROJECT.is_file():
        raise BadInput(
            "codegen: installed, not a checkout: nothing is written among installed packages; "
            "give a folder: --out DIR"
        )
    folder = ROOT if asked is None else asked
    if folder.exists() and not folder.is_dir():
        raise BadInput(f"{folder}: not a folder; give another --out")
    return folder


def differences(root: Path = ROOT) -> list[str]:
    """Name every generated file under `root` that is missing, stale or no longer generated."""
    files = generate()
    found = []
    for name, text in files.items():
        path = root / name
        if not path.is_file():
            found.append(f"{name}: missing")
        elif _without_date(path.read_text(encoding="utf-8")) != _without_date(text):
            found.append(f"{name}: differs from what hil.xml generates")
    for path in sorted((root / C_OUT).rglob("*.h")):
        if path.relative_to(root) not in files:
            found.append(f"{path.relative_to(root)}: not generated from hil.xml")
    return found


def write(root: Path = ROOT) -> list[Path]:
    """Write the generated files that changed; return their paths inside the project."""
    changed = []
    for name, text in generate().items():
        path = root / name
        if path.is_file() and _without_date(path.read_text("utf-8")) == _without_date(text):
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        changed.append(name)
    return changed
