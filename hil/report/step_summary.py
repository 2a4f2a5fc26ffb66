"""A summary of runs in Markdown for the page of a CI job, where the CI names a file for it.

GitHub, Gitea and Forgejo name it in GITHUB_STEP_SUMMARY; a step appends to it and may fill 1 MiB.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hil.core.text import visible

if TYPE_CHECKING:
    from hil.record.reader import RunRecord

VARIABLE = "GITHUB_STEP_SUMMARY"
_MOST_LINES = 100
_SPECIAL = {c: f"\\{c}" for c in "\\`*_[]|~#"} | {"&": "&amp;", "<": "&lt;", ">": "&gt;"}


def append_summary(records: Sequence[RunRecord], title: str, report: Path | None = None) -> None:
    """Append the summary to the file that the environment names; do nothing where it names none.

    Raises OSError when the file cannot be written.
    """
    name = os.environ.get(VARIABLE)
    if not name:
        return
    with Path(name).open("a", encoding="utf-8", errors="replace") as file:
        file.write(summary_of(records, title, report))


def summary_of(records: Sequence[RunRecord], title: str, report: Path | None = None) -> str:
    """Return a table with a line for each scenario and laws, and what does not hold."""
    from hil.report.junit import cases_of  # noqa: PLC0415 - loads XML, where a CI asks for a summary only

    groups: dict[tuple[str, ...], list[RunRecord]] = {}
    for record in records:
        manifest = record.manifest
        names = (manifest.scenario_name, manifest.target, manifest.outer, manifest.inner)
        groups.setdefault(names, []).append(record)
    lines = [
        f"### {_plain(title)}",
        "",
        "| scenario | target | outer law | wheel law | runs | requirements hold in |",
        "| --- | --- | --- | --- | ---: | ---: |",
    ]
    for key, runs in groups.items():
        good = sum(all(not case.kind for case in cases_of(run)) for run in runs)
        lines.append("| " + " | ".join([*map(_plain, key), str(len(runs)), str(good)]) + " |")
    wrong = _wrong(records)
    if wrong:
        lines += ["", *wrong[:_MOST_LINES]]
    if len(wrong) > _MOST_LINES:
        lines.append(f"- and {len(wrong) - _MOST_LINES} more")
    if report is not None:
        lines += ["", f"Report: {_plain(str(report))}"]
    return "\n".join(lines) + "\n\n"


def _wrong(records: Sequence[RunRecord]) -> list[str]:
    from hil.report.junit import cases_of  # noqa: PLC0415 - as above

    found = []
    for record in records:
        manifest = record.manifest
        who = f"{manifest.scenario_name}, {manifest.outer}, seed {manifest.seed}"
        for case in cases_of(record):
            if case.kind:
                text = f"{who}: {case.name}: {case.message} ({record.path})"
                found.append(f"- **{case.kind}** {_plain(text)}")
    return found


def _plain(text: str) -> str:
    """Return text that Markdown shows as it is, on one line."""
    return "".join(_SPECIAL.get(c, c) for c in visible(text))
