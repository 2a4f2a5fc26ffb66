"""Building and uploading the sketch."""

import shutil
import stat
import subprocess

import pytest

from hil.board import build
from hil.board.build import Build
from hil.core.errors import BadInput, RigFault
from tests.pil.rigs import needs_toolchain

BUILD = Build("0123abcd", *2 * [build.Path("none.hex")], 1000, 100)


@needs_toolchain
def test_builds_from_nothing_to_the_same_program(tmp_path):
    """Two builds from scratch give the same HEX to the last byte, and a third has nothing to do."""
    first = build.build(tmp_path / "a")
    second = build.build(tmp_path / "b")
    assert first.hex.read_bytes() == second.hex.read_bytes()
    assert not first.over_budget()
    made_at = first.elf.stat().st_mtime_ns
    assert build.build(tmp_path / "a") == first
    assert first.elf.stat().st_mtime_ns == made_at


@needs_toolchain
def test_build_id_is_in_the_program_and_follows_the_sources(tmp_path, monkeypatch):
    """The id the board reports is in its flash; another source file gives another id."""
    made = build.build()
    image = bytes.fromhex(
        "".join(line[9:-2] for line in made.hex.read_text().splitlines() if line[7:9] == "00")
    )
    assert made.build_id.encode() in image
    sketch = tmp_path / build.SKETCH
    shutil.copytree(build.sketch_folder(), sketch)
    (sketch / "src/core/constants.h").open("a").write("// one more line\n")
    monkeypatch.setattr(build, "sketch_folder", lambda: sketch)
    assert build.build(tmp_path / "out").build_id != made.build_id


@needs_toolchain
def test_compiles_in_the_way_of_the_arduino_ide(tmp_path):
    """Arduino's whole core as an archive, its own flags, no definition of ours: it links."""
    tools, sketch = build.find_toolchain(), build.sketch_folder()
    flags = [
        *build._COMMON,
        f"-I{tools.core / 'cores/arduino'}",
        f"-I{tools.core / 'variants/mega'}",
    ]

    def compile_all(sources, name):
        made = []
        for path in sources:
            target = tmp_path / f"{name}-{len(made)}.o"
            language = {".ino": ["-x", "c++"], ".S": ["-x", "assembler-with-cpp"]}.get(
                path.suffix, []
            )
            cxx = [] if path.suffix in {".c", ".S"} else [*build._CXX]
            # avr-gcc 5.4 does not define what Debian's copy of WString.cpp asks for.
            digits = ["-DDECIMAL_DIG=17"] if name == "core" else []
            tool = tools.tool("gcc" if path.suffix in {".c", ".S"} else "g++")
            command = [
                tool,
                *flags,
                *cxx,
                *digits,
                "-w",
                *language,
                "-c",
                str(path),
                "-o",
                str(target),
            ]
            subprocess.run(command, check=True)
            made.append(str(target))
        return made

    core = [p for p in (tools.core / "cores/arduino").iterdir() if p.suffix in {".c", ".cpp"}]
    archive = str(tmp_path / "core.a")
    subprocess.run([tools.tool("gcc-ar"), "rcs", archive, *compile_all(core, "core")], check=True)
    own = [p for p in build._sketch_sources(sketch) if p.suffix in {".ino", ".cpp", ".c", ".S"}]
    elf = tmp_path / "ide.elf"
    link = ["-w", "-fuse-linker-plugin", "-Wl,--gc-sections", "-o", str(elf)]
    command = [
        tools.tool("gcc"),
        *build._COMMON,
        *link,
        *compile_all(own, "own"),
        archive,
        "-lm",
    ]
    subprocess.run(command, check=True)
    flash_bytes, _ = build._sizes(tools, elf)
    assert flash_bytes == pytest.approx(build.build().flash_bytes, abs=500)


def test_without_the_compiler_it_says_how_to_get_it(monkeypatch):
    """One line that names the Debian packages."""
    monkeypatch.setattr(shutil, "which", lambda _: None)
    monkeypatch.setattr(build.Path, "home", lambda: build.Path("/nonexistent"))
    with pytest.raises(BadInput, match="apt install gcc-avr avr-libc arduino-core-avr"):
        build.find_toolchain()


@needs_toolchain
def test_a_source_that_does_not_compile_is_one_line(tmp_path, monkeypatch):
    """The compiler's first error, with file and line."""
    sketch = tmp_path / build.SKETCH
    shutil.copytree(build.sketch_folder(), sketch)
    (sketch / "src/core/constants.h").open("a").write("int wrong = ;\n")
    monkeypatch.setattr(build, "sketch_folder", lambda: sketch)
    with pytest.raises(BadInput, match=r"constants\.h:\d+:\d+: error") as caught:
        build.build(tmp_path / "out")
    assert "\n" not in str(caught.value)


@pytest.fixture
def programmer(tmp_path, monkeypatch):
    """Return a function that puts a programmer with this name and exit status on the path."""
    monkeypatch.setenv("PATH", str(tmp_path))

    def install(name, status):
        tool = tmp_path / name
        tool.write_text(
            f'#!/bin/sh\necho "$0 $@" >> {tmp_path}/called\necho no sync >&2\nexit {status}\n'
        )
        tool.chmod(tool.stat().st_mode | stat.S_IXUSR)
        return tmp_path / "called"

    return install


def test_upload_runs_avrdude_for_the_mega(programmer, tmp_path):
    """Protocol, chip and speed are those of the Mega 2560's bootloader."""
    called = programmer("avrdude", 0)
    port = tmp_path / "ttyACM0"
    port.touch()
    build.upload(BUILD, str(port))
    words = called.read_text().split()
    assert words[1:] == ["-p", "atmega2560", "-c", "wiring", "-P", str(port), "-b", "115200", "-D",
                         "-U", "flash:w:none.hex:i"]  # fmt: skip


def test_upload_falls_back_to_arduino_cli(programmer, tmp_path):
    """Where avrdude is not installed."""
    called = programmer("arduino-cli", 0)
    port = tmp_path / "ttyACM0"
    port.touch()
    build.upload(BUILD, str(port))
    assert "upload --fqbn arduino:avr:mega" in called.read_text()


def test_upload_without_port_programmer_or_answer(programmer, tmp_path):
    """No such port and no programmer are bad input; a board that does not answer is a rig fault."""
    with pytest.raises(BadInput, match="not there; ports on this machine"):
        build.upload(BUILD, str(tmp_path / "ttyACM9"))
    port = tmp_path / "ttyACM0"
    port.touch()
    with pytest.raises(BadInput, match="apt install avrdude"):
        build.upload(BUILD, str(port))
    programmer("avrdude", 1)
    with pytest.raises(RigFault, match="no sync; is the board on that port"):
        build.upload(BUILD, str(port))
