"""The page of faults has every row of the matrix, and its figures are those of what was run."""

from __future__ import annotations

from hil.study.fault_kinds import ROWS
from tests.docs import faults

CELL = {
    "fault": ROWS[0].name, "instant": "at speed", "law": "asg-ism", "outcome": "fault",
    "said": "board: left ARMED by itself: SAFE (STALL_LEFT)", "rest_s": 0.37, "peak_m_s": 0.5,
    "travel_m": 0.3, "detected_s": 0.53, "flaws": [], "met": True,
}  # fmt: skip
FREE = {"runs": 3000, "alarms": 0, "most_ratio": 0.001, "met": True, "said": []}


def test_every_row_is_in_the_page_and_in_the_picture() -> None:
    """A row more in the matrix needs the page drawn again."""
    page, svg = faults.PAGE.read_text(), faults.SVG.read_text()
    drawn = page.split(faults.BEGIN)[1].split(faults.END)[0]
    for row in ROWS:
        assert f"| {row.name} |" in drawn, row.name
    assert svg.startswith("<svg")


def test_figures_are_those_of_the_cells() -> None:
    """One cell of one row, and what has not been run is said."""
    text = faults.figures([CELL], FREE)
    assert "1 of 1 cells are met. 409 cells were not run (blank)." in text
    assert "Of 3,000 runs without a fault 0 were stopped or diagnosed" in text
    assert "below 1 in 1,000" in text
    first = f"| {ROWS[0].name} | 0.53 | 0.37 | 0.50 | 0.30 | 1 of 1 | board: SAFE (STALL_LEFT) |"
    assert first in text
    bad = faults.figures([CELL | {"met": False, "flaws": ["moves on"]}], FREE)
    assert f"- {ROWS[0].name}, at speed, asg-ism: moves on" in bad


def test_what_is_not_between_the_marks_stays() -> None:
    page = faults.PAGE.read_text()
    again = faults.drawn(page, [CELL], FREE)
    assert again.split(faults.BEGIN)[0] == page.split(faults.BEGIN)[0]
    assert again.split(faults.END)[1] == page.split(faults.END)[1]
