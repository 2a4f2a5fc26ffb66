"""Draws the fault matrix and its figures into docs/faults.md.

`python -m tests.docs.faults` runs what of the matrix and of the runs without a fault is not in
runs/faults yet (as `hil faults` does, with which it shares the folder), then writes docs/faults.svg and
the lines between the page's marks.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hil.cli.progress import job_progress
from hil.core.text import visible
from hil.report.fault_page import picture
from hil.study.fault_campaign import finished, finished_free, run_fault_free, run_matrix
from hil.study.fault_kinds import ROWS
from hil.study.fault_matrix import LAWS, cells

ROOT = Path(__file__).resolve().parents[2]
PAGE, SVG = ROOT / "docs" / "faults.md", ROOT / "docs" / "faults.svg"
BEGIN, END = "<!-- figures: drawn by python -m tests.docs.faults -->\n", "<!-- figures: end -->\n"
Cell = Mapping[str, Any]


def figures(found: Sequence[Cell], free: Mapping[str, Any]) -> str:
    """Return counts, table and the picture's link, in Markdown."""
    met, whole = sum(cell["met"] for cell in found), len(cells())
    missing = f" {whole - len(found)} cells were not run (blank)." if len(found) < whole else ""
    share = f"below 1 in {1.0 / free['most_ratio']:,.0f}"
    lines = [
        f"![The matrix: {len(ROWS)} faults at five instants under both laws](faults.svg)",
        "",
        f"{met} of {len(found)} cells are met.{missing} Of {free['runs']:,} runs without a fault "
        f"{free['alarms']} were stopped or diagnosed: with 95 % confidence {share}.",
        "",
        "| fault | stopped after (s) | rest (s) | peak (m/s) | travel (m) | met | told at speed as |",
        "| --- | --- | --- | --- | --- | --- | --- |",
        *(_row(row.name, [cell for cell in found if cell["fault"] == row.name]) for row in ROWS),
    ]
    bad = [cell for cell in found if not cell["met"]]
    if bad:
        lines += ["", "Not met:", ""]
        lines += [
            f"- {cell['fault']}, {cell['instant']}, {cell['law']}: {'; '.join(cell['flaws'])}"
            for cell in bad
        ]
    return visible_lines(lines)


def visible_lines(lines: Sequence[str]) -> str:
    """Return the lines as text of a page."""
    return "".join(f"{visible(line)}\n" for line in lines)


def _row(name: str, found: Sequence[Cell]) -> str:
    at_speed = {cell["law"]: cell for cell in found if cell["instant"] == "at speed"}
    detected = " / ".join(_seconds(at_speed[law]["detected_s"]) for law in LAWS if law in at_speed)
    told = _short(at_speed[LAWS[-1]]["said"]) or "recovered" if LAWS[-1] in at_speed else "not run"
    keys = ("rest_s", "peak_m_s", "travel_m")
    worst = [f"{max((cell[key] for cell in found), default=0.0):.2f}" for key in keys]
    met = f"{sum(cell['met'] for cell in found)} of {len(found)}"
    return f"| {' | '.join([name, detected, *worst, met, told])} |"


def _seconds(value: float | None) -> str:
    return "-" if value is None else f"{max(value, 0.0):.2f}"


def _short(said: str) -> str:
    text = said.replace("left ARMED by itself: ", "").replace("|", "/")
    return text if len(text) <= 75 else f"{text[:72]}..."


def drawn(text: str, found: Sequence[Cell], free: Mapping[str, Any]) -> str:
    """Return a page with the figures between its marks."""
    before, rest = text.split(BEGIN)
    _, after = rest.split(END)
    return f"{before}{BEGIN}{figures(found, free)}{END}{after}"


def main() -> None:
    """Run what is missing, then draw."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--out", type=Path, default=Path("runs/faults"))
    options.add_argument("--fault-free", type=int, default=10_000)
    options.add_argument("--as-it-is", action="store_true", help="draw what there is, run nothing")
    asked = options.parse_args()
    keys = finished(asked.out, 1) if asked.as_it_is else cells()
    runs = len(finished_free(asked.out, 1)) if asked.as_it_is else asked.fault_free
    with job_progress("faults") as update:
        found = run_matrix(keys, 1, asked.out, update)
    with job_progress("without a fault") as update:
        free = run_fault_free(runs, 1, asked.out, update)
    SVG.write_text(f"{picture(found)}\n", encoding="utf-8")
    PAGE.write_text(drawn(PAGE.read_text(encoding="utf-8"), found, free), encoding="utf-8")


if __name__ == "__main__":
    main()
