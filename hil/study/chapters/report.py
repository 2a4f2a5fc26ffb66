"""Writes a reproduction down: HTML with figures, CSV tables."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from hil.core.errors import BadInput
from hil.core.files import replace_file
from hil.study.chapters.claims import shown
from hil.study.chapters.draw import figure_svg
from hil.study.chapters.reproduction import Section

_STYLE = re.compile(r"<style>.*?</style>", re.DOTALL)


def refuse_used(folder: Path) -> None:
    """Raise BadInput when there is something in the folder already."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise BadInput(f"--out {folder}: exists and is not an empty folder; name a new one")


def write_all(folder: Path, sections: Sequence[Section], command: str) -> Path:
    """Write report.html and the CSV tables into a folder; return the report's path.

    Raises BadInput where the folder cannot be written to.
    """
    report = folder / "report.html"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        replace_file(report, render(sections, command).encode())
        for name, rows in tables(sections).items():
            replace_file(folder / f"{name}.csv", _csv(rows).encode())
    except OSError as error:
        raise BadInput(f"--out {folder}: cannot be written: {error.strerror}") from None
    return report


def write_markdown(path: Path, text: str) -> None:
    """Write the Markdown, atomically; raises BadInput when it cannot be written."""
    try:
        replace_file(path, text.encode())
    except OSError as error:
        raise BadInput(f"--markdown {path}: cannot be written: {error.strerror}") from None


def tables(sections: Sequence[Section]) -> dict[str, list[dict[str, Any]]]:
    """Return the tables of a reproduction: rows, claims, sensitivity."""
    return {
        "rows": [row.to_json() for section in sections for row in section.rows],
        "claims": [claim.to_json() for section in sections for claim in section.claims],
        "sensitivity": [item.to_json() for section in sections for item in section.sensitivities],
    }


def _csv(rows: Sequence[Mapping[str, Any]]) -> str:
    out = io.StringIO()
    if rows:
        writer = csv.DictWriter(out, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return out.getvalue()


def render(sections: Sequence[Section], command: str) -> str:
    """Return the report as one HTML page without any outside file."""
    template = files("hil.study.chapters") / "reproduction.html.j2"
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["shown"] = shown
    style = _STYLE.search((files("hil.report") / "report.html.j2").read_text(encoding="utf-8"))
    figures = {
        section.title: [
            (spec, Markup(figure_svg(spec, section.rows)))
            for spec in (section.deck.figures if section.deck else ())
        ]
        for section in sections
    }
    context = {
        "sections": sections,
        "figures": figures,
        "command": command,
        "style": Markup(style[0] if style else ""),
        "unexpected": [line for section in sections for line in section.unexpected],
    }
    return environment.from_string(template.read_text(encoding="utf-8")).render(context)
