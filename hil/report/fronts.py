"""The page of a verdict: fronts of all laws on the unseen tasks, and what the data say."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path

from matplotlib.figure import Figure

from hil.core.files import replace_file
from hil.core.registries import OUTER_LAWS

# Points of a law on the unseen tasks, by search seed: (accuracy, calm, effort), in the order of calm.
Fronts = Mapping[str, Sequence[Sequence[tuple[float, float, float]]]]
_STYLE = (
    "body{font:15px sans-serif;max-width:60em;margin:2em auto}"
    "td,th{padding:.2em .6em;text-align:right}"
)
_GREYS = ("#555555", "#888888", "#aaaaaa")
_MARKERS = "osD^v<>pXP"


def draw(fronts: Fronts) -> Figure:
    """Return accuracy over calm for every law, each seed of the search a line; both axes logarithmic."""
    figure = Figure(figsize=(7.16, 4.6), layout="constrained")
    axes = figure.subplots()
    for number, (law, by_seed) in enumerate(fronts.items()):
        colour = OUTER_LAWS.get(law).colour
        for place, points in enumerate(by_seed):
            axes.plot(
                [point[1] for point in points],
                [point[0] for point in points],
                marker=_MARKERS[number % len(_MARKERS)],
                markersize=4,
                linewidth=1.0,
                color=colour or _GREYS[number % len(_GREYS)],
                label=law if place == 0 else None,
            )
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("calm: variation of commands and PWM over PID as shipped, lower is calmer")
    axes.set_ylabel("accuracy score, lower is better")
    axes.axvline(1.0, color="#cccccc", linewidth=0.8, zorder=0)
    axes.legend(fontsize=7, ncols=2)
    return figure


def svg_of(figure: Figure) -> str:
    """Return a figure as SVG, the same text each time."""
    text = StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()


def page(
    title: str, fronts: Fronts, paragraphs: Sequence[str], tables: Sequence[Sequence[str]]
) -> str:
    """Return the page; tables are lines of Markdown."""
    body = [f"<h1>{html.escape(title)}</h1>"]
    body += [f"<p>{html.escape(text)}</p>" for text in paragraphs]
    body.append("<svg" + svg_of(draw(fronts)).partition("<svg")[2])
    body += [_table(lines) for lines in tables if lines]
    head = f"<!doctype html><meta charset=utf-8><title>{html.escape(title)}</title>"
    return f"{head}<style>{_STYLE}</style>" + "".join(body)


def _table(lines: Sequence[str]) -> str:
    rows = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in lines]
    rows = [row for row in rows if not set("".join(row)) <= {"-", " "}]
    made = ["<table>"]
    for number, row in enumerate(rows):
        tag = "th" if number == 0 else "td"
        cells = "".join(f"<{tag}>{_strong(cell)}</{tag}>" for cell in row)
        made.append(f"<tr>{cells}</tr>")
    return "".join(made) + "</table>"


def _strong(cell: str) -> str:
    text = html.escape(cell.strip("*"))
    return f"<b>{text}</b>" if cell.startswith("**") else text


def write_page(path: Path, text: str) -> None:
    """Write the page."""
    replace_file(path, text.encode())
