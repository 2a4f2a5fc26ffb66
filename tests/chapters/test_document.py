"""docs/reproduction.md is what the command writes today; the report and the tables beside it."""

from __future__ import annotations

import csv
import re
from collections import defaultdict
from pathlib import Path

import pytest

from hil.study.chapters import chapter8
from hil.study.chapters.claims import shown
from hil.study.chapters.deck import load_deck
from hil.study.chapters.document import SENSITIVITY, STARTS
from hil.study.chapters.reproduction import CHAPTERS
from hil.study.chapters.runs import run_job
from hil.study.chapters.sweeps import changes

DOCUMENT = Path(__file__).parents[2] / "docs" / "reproduction.md"
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.])")
CHAOTIC = ("O6 ", "O7 ", "O10 ", "U5", "U6", "U7", "U11", "control (6.27)")


def close(line, other):
    """Say whether the numbers of two lines of the same words agree to 3 %."""
    limit = 1.0 if any(name in line for name in CHAOTIC) else 0.03
    pairs = zip(NUMBER.findall(line), NUMBER.findall(other), strict=True)
    return all(
        abs(float(a) - float(b)) <= limit * max(abs(float(a)), abs(float(b)), 1e-3)
        for a, b in pairs
    )


def by_words(text):
    """Return the lines of a document by what is left of each without its numbers."""
    found = defaultdict(list)
    for line in text.splitlines():
        found[NUMBER.sub("#", line)].append(line)
    return found


@pytest.mark.parametrize("chapter", ["chapter4", "chapter5", "chapter6"])
def test_document_is_up_to_date(chapter, request):
    """Every line that the command writes for a study stands in the document."""
    fresh = request.getfixturevalue(chapter).markdown.splitlines()
    kept = by_words(DOCUMENT.read_text(encoding="utf-8"))
    missing = [
        line
        for line in fresh
        if line and not any(close(line, old) for old in kept[NUMBER.sub("#", line)])
    ]
    assert missing == []
    tables = [line for line in fresh if line.startswith("|")]
    assert len(tables) > 30


def test_document_has_nothing_that_no_study_writes(chapter4, chapter5, chapter6):
    """No row or claim of chapters 4 to 7 is left over from a study that has changed."""
    fresh = {
        line.split("|")[1].strip() + line.split("|")[2].strip()
        for done in (chapter4, chapter5, chapter6)
        for line in done.markdown.splitlines()
        if line.startswith("|")
    }
    text = DOCUMENT.read_text(encoding="utf-8")
    begin = text.index("## Chapter 4")
    rows = (
        text[begin : text.index(STARTS)]
        + text[text.index("## Chapters 5") : text.index("## Chapter 8")]
    )
    for line in rows.splitlines():
        if line.startswith("|"):
            assert line.split("|")[1].strip() + line.split("|")[2].strip() in fresh, line


@pytest.mark.parametrize("law", chapter8.LAWS)
def test_circle_of_chapter_8_is_up_to_date(law):
    """Section 8.9: the row of the document, and the figures of control.md section 2."""
    row = chapter8.circle_row(law)
    want = {"pid": 0.032, "asg-ism": 0.0063}[law]
    assert row.figures["ise_m2_s"] == pytest.approx(want, rel=0.02)
    cells = f"| {shown(row.figures['ise_m2_s'])} | {shown(row.figures['worst_m'])} |"
    assert any(
        f"| circle {law} " in line and cells in line for line in DOCUMENT.read_text().splitlines()
    )


def test_document_has_a_paragraph_a_chapter_and_every_assumed_value():
    """Chapters 4 to 8 are told, and each value to try stands in the table of sensitivities."""
    text = DOCUMENT.read_text(encoding="utf-8")
    for chapter in ("4", "5", "6", "7", "8"):
        assert f"**Chapter {chapter}.** " in text
    assert "none m" not in text
    assert "<<" not in text
    table = text[text.index(SENSITIVITY) :]
    for name in set(CHAPTERS.values()):
        deck = load_deck(name)
        assumed = [n for n, p in deck.parameters.items() if p.origin == "assumed" and p.sweep]
        assert len(assumed) >= 7
        for parameter in assumed:
            assert f"`{parameter}`" in table


def test_one_sensitivity_is_what_its_line_says():
    """Half the disturbance of the quadrotor, recomputed."""
    deck = load_deck("quadrotor")
    for name, value, job in changes(deck, ["Q6 circle"]):
        if name == "disturbance" and value == 0.25:
            ise = shown(run_job(job).figures["ise_m2_s"])
            lines = DOCUMENT.read_text(encoding="utf-8").splitlines()
            assert any(
                "| Q6 circle | `disturbance` | 0.5 | 0.25" in line and f"-> {ise} |" in line
                for line in lines
            )
            return
    pytest.fail("the study has no such value to try")


def test_map_of_starts_tells_where_the_claim_ends():
    """On the circle above 3, at the origin below 1, for the printed disturbance."""
    text = DOCUMENT.read_text(encoding="utf-8")
    table = text[text.index(STARTS) :]
    first = next(line for line in table.splitlines() if line.startswith("| 0 m |"))
    last = next(line for line in table.splitlines() if line.startswith("| 2 m |"))
    assert float(first.split("|")[3]) > 3.0
    assert float(last.split("|")[3]) < 1.0


def test_report_and_tables(chapter4):
    """One page without outside files, figures inside; the tables have every row and claim."""
    page = (chapter4.folder / "report.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 4
    assert "http" not in page.replace("http://www.w3.org", "")
    assert "2.3e6" in page
    assert "C A rho / 2 of (2.24)" in page  # where a parameter comes from
    with (chapter4.folder / "rows.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["row"] for row in rows] == [row["row"] for row in chapter4.document["rows"]]
    with (chapter4.folder / "claims.csv").open(encoding="utf-8") as file:
        claims = list(csv.DictReader(file))
    assert {"claim", "where_printed", "value_printed", "value_here", "verdict"} <= set(claims[0])
    assert len(claims) == len(chapter4.document["claims"])
