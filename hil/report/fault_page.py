"""The fault matrix as one page: a picture of the cells, and what is not met in red."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from hil.core.text import visible

_LEFT_PX, _TOP_PX, _CELL_PX, _ROW_PX = 230, 60, 62, 22
_COLOURS = {"stopped": "#0072b2", "recovered": "#009e73", "told": "#e69f00", "not met": "#d00000"}


def fault_page(cells: Sequence[Mapping[str, Any]], fault_free: Mapping[str, Any] | None) -> str:
    """Return the HTML page of cells as `hil faults --json` gives them; no network, no script."""
    met = sum(cell["met"] for cell in cells)
    parts = [
        "<!doctype html><html lang='en'><meta charset='utf-8'><title>Faults</title>",
        "<style>body{font:15px sans-serif;margin:2em;max-width:70em}td,th{padding:.2em .6em;"
        "text-align:left;border-bottom:1px solid #ddd}.bad{color:#d00000}</style>",
        f"<h1>Faults: {met} of {len(cells)} cells are met</h1>",
        picture(cells),
        "<h2>Cell by cell</h2><table><tr><th>fault</th><th>instant</th><th>law</th><th>outcome</th>"
        "<th>stopped after</th><th>rest after the stop</th><th>peak</th><th>travel</th><th>said</th></tr>",
        *(_row(cell) for cell in cells),
        "</table>",
    ]
    if fault_free is not None:
        parts.append(
            f"<h2>Without a fault</h2><p>{fault_free['alarms']} alarms in {fault_free['runs']} runs: with "
            f"95 % confidence below {fault_free['most_ratio']:.2%} of them.</p>"
        )
    return "\n".join(parts) + "\n"


def picture(cells: Sequence[Mapping[str, Any]]) -> str:
    """Return the matrix as SVG: a row a fault, a column an instant and law."""
    faults = list(dict.fromkeys(cell["fault"] for cell in cells))
    columns = list(dict.fromkeys((cell["instant"], cell["law"]) for cell in cells))
    width = _LEFT_PX + _CELL_PX * len(columns) + 10
    height = _TOP_PX + _ROW_PX * len(faults) + 40
    parts = [
        f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width} {height}' width='{width}' "
        f"height='{height}' font-family='sans-serif' font-size='12'>"
    ]
    for place, (instant, law) in enumerate(columns):
        x = _LEFT_PX + _CELL_PX * place + 4
        parts.append(f"<text x='{x}' y='24'>{escape(instant)}</text>")
        parts.append(f"<text x='{x}' y='44'>{escape(law)}</text>")
    for place, fault in enumerate(faults):
        y = _TOP_PX + _ROW_PX * place + 15
        parts.append(f"<text x='4' y='{y}'>{escape(fault)}</text>")
    for cell in cells:
        x = _LEFT_PX + _CELL_PX * columns.index((cell["instant"], cell["law"]))
        y = _TOP_PX + _ROW_PX * faults.index(cell["fault"])
        title = escape(visible("; ".join([*cell["flaws"], cell["said"]])))
        parts.append(
            f"<rect x='{x}' y='{y}' width='{_CELL_PX - 3}' height='{_ROW_PX - 3}' rx='3' "
            f"fill='{_COLOURS[verdict(cell)]}'><title>{title}</title></rect>"
        )
    for place, (name, colour) in enumerate(_COLOURS.items()):
        x = _LEFT_PX + 110 * place
        parts.append(f"<rect x='{x}' y='{height - 26}' width='14' height='14' fill='{colour}'/>")
        parts.append(f"<text x='{x + 20}' y='{height - 14}'>{name}</text>")
    return "\n".join([*parts, "</svg>"])


def verdict(cell: Mapping[str, Any]) -> str:
    """Return in one word what came of a cell."""
    if not cell["met"]:
        return "not met"
    if cell["outcome"] != "complete":
        return "stopped"
    return "told" if cell["said"] else "recovered"


def _row(cell: Mapping[str, Any]) -> str:
    said = visible("; ".join([*cell["flaws"], cell["said"]]).strip("; "))
    detected = "" if cell["detected_s"] is None else f"{cell['detected_s']:.2f} s"
    texts = (
        cell["fault"], cell["instant"], cell["law"], verdict(cell), detected,
        f"{cell['rest_s']:.2f} s", f"{cell['peak_m_s']:.2f} m/s", f"{cell['travel_m']:.2f} m", said,
    )  # fmt: skip
    mark = "" if cell["met"] else " class='bad'"
    return f"<tr{mark}>{''.join(f'<td>{escape(text)}</td>' for text in texts)}</tr>"
