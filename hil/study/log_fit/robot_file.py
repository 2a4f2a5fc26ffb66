"""The robot file that a fit writes: what the log tells, with intervals, over the robot as believed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from hil.config.load import load_robot
from hil.core.errors import BadInput
from hil.core.files import parse_toml, read_text, replace_file
from hil.study.log_fit.fit import USUAL, twin_values

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.config.robot import RobotConfig
    from hil.study.log_fit.estimate import Estimate
    from hil.study.log_fit.fit import LogFit

BELIEVED = "thesis-4wd"
_MARK = "# Fitted by hil fit"


def believed_robot(file: Path, start: str | None) -> tuple[str, RobotConfig]:
    """Return name and values of the robot that a fit begins with; raises BadInput.

    That is `start`, else what already stands in `file` (below an earlier fit), else the built-in one.
    """
    if file.is_dir():
        raise BadInput(f"--robot {file}: is a folder; name a file")
    if not file.absolute().parent.is_dir():
        raise BadInput(f"--robot {file}: no such folder {file.parent}")
    if file.suffix != ".toml":
        raise BadInput(f"--robot {file}: a robot file's name ends in .toml")
    name = start or BELIEVED
    if start is None and file.is_file():
        name = _below(file)
    return name, load_robot(name)


def _below(file: Path) -> str:
    """Return the base of a file that an earlier fit wrote, or the file itself."""
    try:
        text = read_text(file)
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"--robot {file}: cannot be read: {error}") from None
    base = parse_toml(text, f"--robot {file}").get("base")
    if not text.startswith(_MARK) or not isinstance(base, str):
        return str(file)
    return str(file.parent / base) if base.endswith(".toml") else base


def write_robot_file(file: Path, believed: str, fit: LogFit) -> Path | None:
    """Write the file in one step; return where a file that stood there is kept, None if none did.

    Raises BadInput where it cannot be written.
    """
    kept = None
    if Path(believed).is_file() and file.is_file() and file.samefile(believed):
        kept = _free_name(file)
        replace_file(kept, file.read_bytes())
        believed = str(kept)
    try:
        replace_file(file, _text(file, believed, fit).encode())
        load_robot(str(file))
    except OSError as error:
        raise BadInput(f"--robot {file}: cannot be written: {error.strerror}") from None
    return kept


def _free_name(file: Path) -> Path:
    names = (
        file.with_name(f"{file.stem}.before{'' if k == 1 else f'-{k}'}.toml")
        for k in range(1, 1000)
    )
    return next(name for name in names if not name.exists())


def _text(file: Path, believed: str, fit: LogFit) -> str:
    base = believed
    if Path(believed).is_file():
        base = os.path.relpath(Path(believed).resolve(), file.resolve().parent)
    values: list[Estimate] = [item for item in fit.robot_values if item.told]
    lines = [
        f"{_MARK} from {fit.log.name}: 95 % intervals beside the values. What stands not here is as in",
        "# the file below; what the log did not tell, and what would tell it, stands at the end.",
        f'base = "{Path(base).as_posix() if base.endswith(".toml") else base}"',
    ]
    lines += [_line(item.name, item) for item in values if "." not in item.name]
    inner = [item for item in values if "." in item.name]
    for table in dict.fromkeys(item.name.partition(".")[0] for item in inner):
        lines += ["", f"[{table}]"]
        own = [item for item in inner if item.name.startswith(f"{table}.")]
        lines += [_line(item.name.partition(".")[2], item) for item in own]
    return "\n".join([*lines, *_log_fit(fit), ""])


def _line(key: str, item: Estimate) -> str:
    unit = "" if item.unit in {"SI", "ratio"} else f" {item.unit}"
    return f"{key} = {item.value:.6g}  # {item.low:.5g} to {item.high:.5g}{unit}; {item.meaning}"


def _log_fit(fit: LogFit) -> list[str]:
    estimates = [
        (f"{layer}.{item.name}", item)
        for layer, found in fit.layers.items()
        for item in found.estimates
    ]
    estimates += [(f"robot.{item.name}", item) for item in fit.robot_values]
    untold = [name for name, item in estimates if not item.told]
    lines = ["", "[log_fit]", f"log = {_quoted(fit.log.name)}", f'sha256 = "{fit.sha256}"',
             "not_told = [", *(f'  "{name}",' for name in untold), "]"]  # fmt: skip
    lines += [
        "",
        "[log_fit.twin]  # commands of the body to motion; `hil fit LOG --replay` drives it",
    ]
    told = {item.name: item for item in fit.body.found.estimates} if fit.body else {}
    for name, value in twin_values(fit).items():
        item = told.get(name)
        usual = "not told, the usual value" if value == USUAL[name] else "a guess: not told well"
        said = item.meaning if item is not None and item.told else usual
        lines.append(f"{name} = {value:.9g}  # {said}")
    lines += ["", "[log_fit.told]  # value and 95 % interval"]
    lines += [
        f'"{name}" = {{ value = {item.value:.9g}, low = {item.low:.9g}, high = {item.high:.9g} }}'
        f"  # {item.unit}"
        for name, item in estimates
        if item.told
    ]
    lines += ["", "# Not told by the log, and what would tell it:"]
    lines += [f"#   {advice.text()}" for advice in fit.advice]
    return lines


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{"".join(c if c.isprintable() else "?" for c in escaped)}"'


def check_not(files: Sequence[Path]) -> None:
    """Raise BadInput when a file that is to be written cannot be."""
    for file in files:
        if file.is_dir():
            raise BadInput(f"{file}: is a folder; name a file")
        if not file.absolute().parent.is_dir():
            raise BadInput(f"{file}: no such folder {file.parent}")
