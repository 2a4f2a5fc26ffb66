"""Facts that stand in one place: files read and written, the pace of the serial line."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from hil.config.link import UART_BAUD, LinkConfig
from hil.core.errors import BadInput
from hil.core.files import read_toml, replace_file, replacing
from hil.rigs.serial import parse_target

ROOT = Path(__file__).resolve().parents[2]
SOURCES = sorted(
    path for room in ("hil", "vision", "sim_twin") for path in (ROOT / room).rglob("*.py")
)


def sources_with(pattern: str) -> list[str]:
    """Return the modules in which a pattern stands."""
    return [
        str(path.relative_to(ROOT))
        for path in SOURCES
        if re.search(pattern, path.read_text(encoding="utf-8"))
    ]


def test_one_module_reads_toml_and_one_replaces_files() -> None:
    """Everyone else asks `hil.core.files`; a video in work is no file that is replaced."""
    assert sources_with(r"^import tomllib|^from tomllib") == []
    assert sources_with(r"(?m)^import tomllib") == ["hil/core/files.py"]
    assert sources_with(r'\.part"') == ["hil/core/files.py"]


def test_the_pace_of_the_line_is_one_number() -> None:
    """57,600 bit/s stands once on the host; the firmware's and the twin's are the same."""
    assert sources_with(r"\b57_?600\b") == ["hil/config/link.py"]
    assert UART_BAUD == LinkConfig().baud == parse_target("serial:/dev/ttyX")[1]
    uart = (ROOT / "firmware_arduino/src/board/uart.h").read_text(encoding="utf-8")
    assert re.search(r"kBaud = (\d+);", uart)[1] == str(UART_BAUD)  # type: ignore[index]
    board = (ROOT / "sim_twin/native/kernel_board.hpp").read_text(encoding="utf-8")
    assert re.search(r"byte_us = 10e6 / (\d+)\.0;", board)[1] == str(UART_BAUD)  # type: ignore[index]


def test_a_file_is_replaced_whole_or_not_at_all(tmp_path: Path) -> None:
    """An error in mid-write leaves the old file, and nothing beside it."""
    path = tmp_path / "x"
    replace_file(path, b"old", durable=True)

    def half_written() -> None:
        with replacing(path) as part:
            part.write_bytes(b"ne")
            raise RuntimeError("power gone")

    with pytest.raises(RuntimeError):
        half_written()
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (None, "cannot be read: No such file"),
        (b"\xff", "cannot be read: "),
        (b"x = ", "not valid TOML"),
        (b"x = " + b"[" * 5000, "not valid TOML"),
        (b"x = " + b"9" * 5000, "not valid TOML"),
    ],
)
def test_toml_that_cannot_be_read_is_one_line(
    tmp_path: Path, data: bytes | None, said: str
) -> None:
    """Missing, no text, no TOML, brackets and digits beyond what Python takes."""
    path = tmp_path / "x.toml"
    if data is not None:
        path.write_bytes(data)
    with pytest.raises(BadInput) as refusal:
        read_toml(path, "robot file")
    assert said in str(refusal.value)
    assert str(path) in str(refusal.value)
    assert "\n" not in str(refusal.value)
