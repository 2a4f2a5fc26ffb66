"""`hil bench parts`: what it measures is measured, and no test judges by the clock instead."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from hil.tools import bench_parts
from tests.cli.command import hil

TESTS = Path(__file__).resolve().parents[1]


def test_the_parts_are_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every figure has a name, a unit and a time that passed; the report's is left out here."""
    monkeypatch.setattr(bench_parts, "_TICKS", 20)
    monkeypatch.setattr(bench_parts, "report_s", lambda _: 1.0)
    done = hil("bench", "parts", "--runs", 1, "--json")
    assert done.status == 0
    found = done.json["figures"]
    assert len({figure["name"] for figure in found}) == len(found) == 6
    for figure in found:
        assert figure["unit"] in {"us", "s"}
        assert 0.0 < figure["least"] <= figure["median"] <= figure["largest"]


def test_no_test_asserts_on_the_clock() -> None:
    """A busy machine fails no test: speed is for the bench. Stamps may be compared with the clock.

    Commands beside the tests, such as the long fuzzing, may measure.
    """
    clocks = r"perf_counter|process_time|monotonic\(\) - |\btime\.time\(\) - "
    told = [
        f"{path.name}:{number}: {line.strip()}"
        for path in TESTS.rglob("test_*.py")
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if re.search(rf"assert .*({clocks})", line)
        or re.search(r"(perf_counter|process_time)\(", line)
    ]
    assert told == []
