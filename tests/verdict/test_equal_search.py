"""The table of all laws on one budget is that of its data, and the data are what runs give."""

from __future__ import annotations

import copy
import json

from hil.core.registries import OUTER_LAWS
from hil.study.verdict import Field, shipped_text
from tests.verdict import equal_search

FOUND = json.loads(equal_search.DATA.read_text(encoding="utf-8"))


def test_every_law_had_the_same_budget_and_the_same_code():
    """All built-in laws, as many candidates each, one revision, their start in the box."""
    assert set(FOUND) == set(OUTER_LAWS.names())
    assert {one["candidates"] for one in FOUND.values()} == {301}
    assert len({one["revision"] for one in FOUND.values()}) == 1
    assert all(one["values"]["zeta_start_m_s2"] > 0.0 for one in FOUND.values())


def test_the_page_has_the_figures_of_the_data():
    """Changed data make another page."""
    text = equal_search.PAGE.read_text(encoding="utf-8")
    assert equal_search.page() == text, "python -m tests.verdict.equal_search"
    changed = copy.deepcopy(FOUND)
    changed["pid"]["held_out_cost"] += 1.0
    shipped = json.loads(shipped_text())["shipped"]
    assert equal_search.table(FOUND, shipped) in text
    assert equal_search.table(changed, shipped) not in text


def test_a_score_of_the_data_is_what_a_run_gives_now(monkeypatch):
    """One law in one unseen cell, to the last digit that is kept; other gains give another score."""
    (cell, runs), *_ = FOUND["pid"]["unseen"].items()
    field_of = Field.of

    def one_cell(*words):
        field = field_of(*words)
        object.__setattr__(field, "unseen", (cell,))
        return field

    monkeypatch.setattr(Field, "of", one_cell)
    assert equal_search.judged({"pid": FOUND["pid"]})["pid"] == {cell: runs}
    softer = copy.deepcopy(FOUND["pid"])
    softer["values"]["kp_s3"] *= 0.5
    assert equal_search.judged({"pid": softer})["pid"] != {cell: runs}
