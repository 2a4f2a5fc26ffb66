"""The built wheel in a fresh environment, used from a folder that is no checkout."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
import tarfile
import venv
from dataclasses import dataclass
from pathlib import Path

import pytest

from hil import __version__
from hil.core.errors import BadInput

ROOT = Path(__file__).resolve().parents[2]
LAW = """
import hil


@hil.outer_law("own", summary="Drives straight on.")
class Own:
    def __init__(self, gains, limits, d0_m):
        pass

    def reset(self, reference, estimate):
        pass

    def step(self, reference, estimate, dt_s):
        return hil.OuterCommand(0.2, 0.0, {})
"""


@dataclass(frozen=True, slots=True)
class Installed:
    """An environment with the wheel, and a folder to work in."""

    folder: Path
    work: Path

    @property
    def packages(self) -> Path:
        """Return the folder of the installed packages."""
        return Path(
            sysconfig.get_path("purelib", "venv", {"base": str(self.folder)})
            if "venv" in sysconfig.get_scheme_names()
            else next(self.folder.glob("lib/python*/site-packages"))
        )

    def hil(self, *words: object, status: int = 0) -> str:
        """Run a command from the work folder; return what it wrote to stdout (stderr on refusal)."""
        done = self.call("hil", *words)
        assert done.returncode == status, (words, done.stdout, done.stderr)
        return done.stdout if status in {0, 1} else done.stderr

    def call(self, program: str, *words: object) -> subprocess.CompletedProcess[str]:
        """Run a program of the environment from the work folder."""
        environment = {
            "PATH": os.environ["PATH"],
            "HOME": str(self.work / "home"),
            "XDG_CACHE_HOME": str(self.work / "cache"),
            "MPLCONFIGDIR": str(self.work / "cache"),
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        return subprocess.run(
            [str(self.folder / "bin" / program), *map(str, words)],
            cwd=self.work, env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip

    def files(self) -> set[tuple[str, int]]:
        """Return name and size of all that is installed."""
        found = (path for path in self.packages.rglob("*") if path.is_file())
        return {(str(path), path.stat().st_size) for path in found}


def pip(*words: object) -> None:
    subprocess.run(
        [sys.executable, "-m", "pip", "--disable-pip-version-check", *map(str, words)],
        check=True, capture_output=True, cwd=ROOT,
    )  # fmt: skip


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """Build the wheel, and install it beside the dependencies of this environment."""
    base = tmp_path_factory.mktemp("installed")
    pip("wheel", "--no-deps", "--no-build-isolation", "--no-index", "-w", base / "wheel", ".")
    venv.create(base / "env", with_pip=False)
    found = Installed(base / "env", base / "work")
    found.work.mkdir()
    (wheel,) = (base / "wheel").glob("*.whl")
    assert wheel.name.startswith(f"skid_steer_hil-{__version__}-")
    pip("--python", found.folder, "install", "--no-deps", "--no-index", wheel)
    # Only the path: the hook that shows the checkout as installed here is not run for it.
    here = sysconfig.get_path("purelib")
    (found.packages / "dependencies.pth").write_text(f"{here}\n", encoding="utf-8")
    (found.work / "own.py").write_text(LAW, encoding="utf-8")
    return found


def test_it_is_the_installed_package(installed: Installed) -> None:
    """What runs is the wheel, typed, with sketch, schemas and data; not the checkout."""
    said = installed.call("python", "-c", "import hil, vision, sim_twin; print(hil.__file__)")
    assert Path(said.stdout.strip()).parent == installed.packages / "hil"
    assert installed.hil("--version").split()[-1] == __version__
    for file in (
        "hil/py.typed",
        "vision/py.typed",
        "sim_twin/py.typed",
        "hil/board/sketch/firmware_arduino/firmware_arduino.ino",
        "hil/board/sketch/firmware_arduino/src/core/params.def",
        "hil/data/schemas/scenario.json",
        "hil/wire/hil.xml",
    ):
        assert (installed.packages / file).is_file(), file


def test_data_of_the_checkout_are_all_there(installed: Installed) -> None:
    """Every file of the packages that git keeps is installed."""
    listed = subprocess.run(
        ["git", "-C", str(ROOT), "ls-files", "hil", "vision", "sim_twin", "firmware_arduino/src"],
        capture_output=True, text=True, check=False,
    ).stdout.split()  # fmt: skip
    if not listed:
        pytest.skip("not a git checkout: nothing says which files there should be")
    for name in listed:
        moved = name.replace("firmware_arduino/", "hil/board/sketch/firmware_arduino/")
        assert (installed.packages / moved).is_file(), name


def test_main_commands_from_another_folder(installed: Installed) -> None:
    """Run with an own law, compare, replay, export; nothing is written among the packages."""
    before = installed.files()
    short = ("--camera", "pose", "--set", "duration_s=1")
    for law in ("own.py", "pid"):
        installed.hil("run", "scenario-1", "--outer", law, *short, "--out", law[:3], status=1)
    installed.hil("compare", "own", "pid", "--report", "both.html", "--csv", "both.csv", status=1)
    assert "bit for bit" in installed.hil("replay", "own")
    assert json.loads(installed.hil("config", "robot.mass_kg", "--json"))["settings"]
    installed.hil("config", "schema", "--out", "schemas")
    assert (installed.work / "schemas" / "scenario.json").is_file()
    assert "scenario-1" in installed.hil("run", "--help")
    assert installed.files() == before


def test_a_cell_of_the_fault_matrix_from_another_folder(installed: Installed) -> None:
    """A fault, its verdict and its page; the list of faults is the installed one's."""
    cell = ("--fault", "camera stalls", "--at", "at speed", "--outer", "pid", "--out", "cells")
    assert "1 of 1 cells are met" in installed.hil("faults", *cell)
    assert (installed.work / "cells" / "faults.html").is_file()
    assert "there are: encoder dead" in installed.hil("faults", "--fault", "nope", status=2)


def test_code_generation_asks_for_a_folder(installed: Installed) -> None:
    """The installed package is not written into; a folder that is named gets every file."""
    before = installed.files()
    said = installed.hil("firmware", "codegen", status=2)
    assert said == (
        "hil: codegen: installed, not a checkout: nothing is written among installed packages; "
        "give a folder: --out DIR\n"
    )
    assert installed.hil("firmware", "codegen", "--check", status=2) == said
    installed.hil("firmware", "codegen", "--out", "generated")
    made = installed.work / "generated"
    assert (made / "hil/wire/dialect.py").read_text("utf-8") == (
        ROOT / "hil/wire/dialect.py"
    ).read_text("utf-8")
    assert (made / "firmware_arduino/src/mavlink/hil/hil.h").is_file()
    assert installed.hil("firmware", "codegen", "--check", "--out", "generated") == ""
    assert installed.files() == before


def test_firmware_and_processor_in_the_loop(installed: Installed) -> None:
    """The installed sketch builds, into the user's cache, and runs under simavr."""
    from hil.board.build import find_toolchain  # noqa: PLC0415

    try:
        find_toolchain()
        import sim_twin._pil  # noqa: F401, PLC0415
    except (BadInput, ImportError) as error:
        pytest.skip(str(error))
    before = installed.files()
    said = installed.hil("firmware", "build")
    assert str(installed.work / "cache/skid-steer-hil/firmware/firmware_arduino.elf") in said
    short = ("--camera", "pose", "--set", "duration_s=0.2")
    installed.hil("run", "scenario-1", "--on", "pil", *short, "--out", "pil", status=1)
    assert installed.files() == before


def test_source_distribution_is_whole(tmp_path: Path) -> None:
    """The sdist carries all that builds the wheel, tests and docs."""
    code = (
        "import os, sys; from scikit_build_core.build import build_sdist; "
        f"os.chdir({str(ROOT)!r}); print(build_sdist({str(tmp_path)!r}))"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
    (file,) = tmp_path.glob("*.tar.gz")
    assert file.name == f"skid_steer_hil-{__version__}.tar.gz"
    with tarfile.open(file) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    wanted = ["pyproject.toml", "README.md", "LICENSE", "docs/overview.md"]
    for folder in ("hil", "vision", "sim_twin", "firmware_arduino"):
        wanted += [
            str(path.relative_to(ROOT))
            for path in (ROOT / folder).rglob("*")
            if path.is_file() and "__pycache__" not in path.parts and path.suffix != ".so"
        ]
    assert sorted(set(wanted) - names) == []
