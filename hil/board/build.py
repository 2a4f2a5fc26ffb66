"""Builds the sketch with avr-gcc and uploads it, the way the Arduino IDE does.

Compiler, flags and link are those of Arduino's platform.txt (size-optimised, link-time
optimisation), so that what is measured here is what the IDE would put on the board. Debug
information is in a form that survives link-time optimisation; it takes no room on the board.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from serial.tools import list_ports

from hil.core.errors import BadInput, RigFault

PACKAGES = "gcc-avr avr-libc arduino-core-avr"
SKETCH = "firmware_arduino"
FLASH_LIMIT_BYTES = 48 * 1024
RAM_LIMIT_BYTES = 4 * 1024

_MCU = "atmega2560"
_CORE_FILES = ("main.cpp", "wiring.c", "hooks.c", "abi.cpp")  # all that the sketch calls
_COMMON = (
    f"-mmcu={_MCU}", "-DF_CPU=16000000L", "-DARDUINO=10819", "-DARDUINO_AVR_MEGA2560",
    "-DARDUINO_ARCH_AVR", "-gdwarf-2", "-Os", "-ffunction-sections", "-fdata-sections", "-flto",
)  # fmt: skip
_CXX = ("-std=gnu++11", "-fpermissive", "-fno-exceptions", "-fno-threadsafe-statics")
_STRICT = ("-Wall", "-Wextra", "-Werror")
_SOURCES = {".ino", ".cpp", ".c", ".S", ".h", ".def"}


# What writes a program to a board, in the order in which they are looked for.
_PROGRAMMERS = ("avrdude", "arduino-cli")


@dataclass(frozen=True, slots=True)
class Toolchain:
    """Where the compiler and Arduino's core for AVR boards are."""

    folder: Path
    core: Path

    def tool(self, name: str) -> str:
        """Return the path of avr-`name`."""
        return str(self.folder / f"avr-{name}")


@dataclass(frozen=True, slots=True)
class Build:
    """What a build made; flash counts code and initial values, ram what is allocated for good."""

    build_id: str
    elf: Path
    hex: Path
    flash_bytes: int
    ram_bytes: int

    def over_budget(self) -> list[str]:
        """Return a line for each size above its limit."""
        lines = []
        if self.flash_bytes > FLASH_LIMIT_BYTES:
            lines.append(f"flash {self.flash_bytes} bytes: above {FLASH_LIMIT_BYTES} bytes")
        if self.ram_bytes > RAM_LIMIT_BYTES:
            lines.append(f"static RAM {self.ram_bytes} bytes: above {RAM_LIMIT_BYTES} bytes")
        return lines


def find_toolchain() -> Toolchain:
    """Return compiler and core from Debian's packages or an Arduino installation.

    Raises BadInput, which names the packages, where one of them is missing.
    """
    home = Path.home()
    arduino = [home / ".arduino15/packages", home / "Library/Arduino15/packages"]
    compilers = [Path(found).parent for found in [shutil.which("avr-gcc")] if found]
    compilers += [p for root in arduino for p in sorted(root.glob("arduino/tools/avr-gcc/*/bin"))]
    cores = [Path("/usr/share/arduino/hardware/arduino/avr")]
    cores += [p for root in arduino for p in sorted(root.glob("arduino/hardware/avr/*"))]
    core = next((path for path in cores if (path / "cores/arduino/Arduino.h").is_file()), None)
    folder = next((path for path in compilers if (path / "avr-g++").is_file()), None)
    if folder is None or core is None:
        what = "avr-gcc" if folder is None else "Arduino's core for AVR boards"
        raise BadInput(f"{what}: not found on this machine; Debian: apt install {PACKAGES}")
    return Toolchain(folder, core)


def sketch_folder() -> Path:
    """Return the folder of the sketch: that of the checkout, or the one installed with the package.

    Raises BadInput when neither is there.
    """
    for folder in (_checkout() / SKETCH, Path(__file__).resolve().parent / "sketch" / SKETCH):
        if (folder / f"{SKETCH}.ino").is_file():
            return folder
    raise BadInput(f"{folder}: no sketch there; install the project again or use a checkout of it")


def build_folder(sketch: Path) -> Path:
    """Return where a build goes that nobody gave a folder: never among installed packages."""
    if sketch.parent == _checkout():
        return sketch.parent / "build" / "firmware"
    cache = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    return Path(cache or Path.home() / ".cache") / "skid-steer-hil" / "firmware"


def _checkout() -> Path:
    return Path(__file__).resolve().parents[2]


def build(out: Path | None = None, *, fresh: bool = False) -> Build:
    """Return the firmware built from the present sources; an up-to-date build is reused.

    Raises BadInput without a compiler, for a source that does not compile, and for a folder `out` that
    cannot be made.
    """
    tools, sketch = find_toolchain(), sketch_folder()
    out = out or build_folder(sketch)
    build_id = _build_id(tools, sketch)
    old = None if fresh else _read_report(out)
    if old is not None and old.build_id == build_id:
        return old
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(
            f"--out {out}: cannot be made: {error.strerror}; name a folder that can be written to"
        ) from None
    # Made aside and moved into place, so that a build under way elsewhere meets whole files only.
    with tempfile.TemporaryDirectory(dir=out) as folder:
        new = _compile(tools, sketch, Path(folder), build_id)
        elf, hex_file = new.elf.replace(out / new.elf.name), new.hex.replace(out / new.hex.name)
    made = replace(new, elf=elf, hex=hex_file)
    _write_report(out, made)
    return made


def _compile(tools: Toolchain, sketch: Path, folder: Path, build_id: str) -> Build:
    elf, hex_file = folder / f"{SKETCH}.elf", folder / f"{SKETCH}.hex"
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(_run, _compile_commands(tools, sketch, folder, build_id)))
    _run(_link_command(tools, sorted(folder.glob("*.o")), elf))
    _run([tools.tool("objcopy"), "-O", "ihex", "-R", ".eeprom", str(elf), str(hex_file)])
    return Build(build_id, elf, hex_file, *_sizes(tools, elf))


def _build_id(tools: Toolchain, sketch: Path) -> str:
    """Return eight hex digits over sources, flags and compiler: equal id, equal program."""
    version = _run([tools.tool("gcc"), "--version"]).splitlines()[0]
    digest = hashlib.sha256(" ".join([version, *_COMMON, *_CXX]).encode())
    for path in _sketch_sources(sketch):
        digest.update(f"{path.relative_to(sketch)}\n".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:8]


def _sketch_sources(sketch: Path) -> list[Path]:
    found = [*sketch.glob("*.ino"), *(sketch / "src").rglob("*")]
    return sorted(path for path in found if path.suffix in _SOURCES and path.is_file())


def _compile_commands(
    tools: Toolchain, sketch: Path, objects: Path, build_id: str
) -> list[list[str]]:
    """Return a command for every source: the sketch's recursively, and the core's that it needs."""
    include = [f"-I{tools.core / 'cores/arduino'}", f"-I{tools.core / 'variants/mega'}"]
    identity = f'-DHIL_BUILD_ID="{build_id}"'
    own = [path for path in _sketch_sources(sketch) if path.suffix in {".ino", ".cpp", ".c"}]
    commands = []
    for path in _sketch_sources(sketch):
        if path.suffix == ".S":
            name = f"{path.name}.o"
            assembler = [tools.tool("gcc"), *_COMMON, "-x", "assembler-with-cpp"]
            commands.append([*assembler, "-c", str(path), "-o", str(objects / name)])
    for path in own:
        name = str(path.relative_to(sketch)).replace(os.sep, "_")
        cxx = [tools.tool("g++"), *_COMMON, *_CXX, *_STRICT, *include, identity, "-x", "c++"]
        commands.append([*cxx, "-c", str(path), "-o", str(objects / f"{name}.o")])
    for name in _CORE_FILES:
        is_c = name.endswith(".c")
        language = [tools.tool("gcc"), "-std=gnu11"] if is_c else [tools.tool("g++"), *_CXX]
        source = str(tools.core / "cores/arduino" / name)
        target = str(objects / f"arduino_{name}.o")
        commands.append([*language, *_COMMON, "-w", *include, "-c", source, "-o", target])
    return commands


def _link_command(tools: Toolchain, objects: Sequence[Path], elf: Path) -> list[str]:
    flags = ["-Wall", "-Wextra", "-Werror", "-fuse-linker-plugin", "-Wl,--gc-sections"]
    names = [str(path) for path in objects]
    return [tools.tool("gcc"), *_COMMON, *flags, "-o", str(elf), *names, "-lm"]


def _run(command: Sequence[str]) -> str:
    """Run one tool and return what it says; its first error becomes one line."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        said = (done.stderr or done.stdout).strip().splitlines()
        first = next((line for line in said if "error" in line), said[0] if said else "no message")
        raise BadInput(
            f"{Path(command[0]).name} failed (status {done.returncode}): {first.strip()}"
        )
    return done.stdout


def _sizes(tools: Toolchain, elf: Path) -> tuple[int, int]:
    """Return (flash, static RAM) in bytes."""
    size: dict[str, int] = {}
    for line in _run([tools.tool("size"), "-A", str(elf)]).splitlines():
        words = line.split()
        if len(words) == 3 and words[0].startswith(".") and words[1].isdigit():
            size[words[0]] = int(words[1])

    def total(names: Iterable[str]) -> int:
        return sum(size.get(name, 0) for name in names)

    return total([".text", ".data"]), total([".data", ".bss", ".noinit"])


def _report_path(out: Path) -> Path:
    return out / "build.json"


def _write_report(out: Path, made: Build) -> None:
    new = out / f"build-{os.getpid()}.json"
    new.write_text(json.dumps(asdict(made), default=str), encoding="utf-8")
    new.replace(_report_path(out))


def _read_report(out: Path) -> Build | None:
    try:
        said = json.loads(_report_path(out).read_text(encoding="utf-8"))
        said |= {"elf": Path(said["elf"]), "hex": Path(said["hex"])}
        old = Build(**said)
    except (OSError, ValueError, TypeError, KeyError):
        return None
    return old if old.elf.is_file() and old.hex.is_file() else None


def upload(made: Build, port: str) -> None:
    """Write the program to the board on `port` through its bootloader.

    Raises BadInput without a programmer or such a port, RigFault when the board does not answer.
    """
    require_upload(port)
    command = _upload_command(made, port)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        said = (done.stderr or done.stdout).strip().splitlines()
        last = said[-1].strip() if said else "no message"
        raise RigFault(f"upload to {port} failed: {last}; is the board on that port?")


def require_upload(port: str) -> None:
    """Raise BadInput where nothing could be uploaded to `port`: no such port, or no programmer."""
    if not Path(port).exists() and not port.upper().startswith("COM"):
        present = ", ".join(sorted(p.device for p in list_ports.comports())) or "none"
        raise BadInput(f"port {port}: not there; ports on this machine: {present}")
    if not any(map(shutil.which, _PROGRAMMERS)):
        raise BadInput(f"neither {' nor '.join(_PROGRAMMERS)} found; Debian: apt install avrdude")


def _upload_command(made: Build, port: str) -> list[str]:
    if shutil.which("avrdude"):
        return ["avrdude", "-p", _MCU, "-c", "wiring", "-P", port, "-b", "115200", "-D",
                "-U", f"flash:w:{made.hex}:i"]  # fmt: skip
    return ["arduino-cli", "upload", "--fqbn", "arduino:avr:mega", "-p", port,
            "--input-file", str(made.hex)]  # fmt: skip
