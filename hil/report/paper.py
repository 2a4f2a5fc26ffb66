"""Figures for a paper: every figure of a report as SVG, PDF and PNG, with its data as CSV.

Each is written in the two widths of a two-column page: `NAME-2col` as the report has it, across both
columns, and `NAME-1col` with its panels above each other.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np

from hil.core.errors import BadInput
from hil.core.files import replace_file, unwritable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Widths of one and of both columns of an IEEE page, in.
ONE_COLUMN_IN, TWO_COLUMNS_IN = 3.5, 7.16
_PANEL_IN = 2.0  # height of a panel in one column
_LEFT_IN, _RIGHT_IN, _ABOVE_IN, _BELOW_IN = 0.62, 0.08, 0.3, 0.42
_FORMATS = ("svg", "pdf", "png")
_PNG_DPI = 300

_folder: ContextVar[Path | None] = ContextVar("paper_folder", default=None)


@contextmanager
def figures_kept(folder: Path | None) -> Iterator[None]:
    """Have every figure that is drawn meanwhile written to `folder` (None: nothing is written).

    Raises BadInput when the folder cannot be made.
    """
    if folder is not None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BadInput(f"--figures {folder}: cannot be made: {error.strerror}") from None
    token = _folder.set(folder)
    try:
        yield
    finally:
        _folder.reset(token)


def keep(figure: Figure, name: str, style: Mapping[Any, Any]) -> None:
    """Write a finished figure where `figures_kept` says, if it says; the figure is not drawn on after."""
    folder = _folder.get()
    if folder is None:
        return
    _write(folder / f"{name}.csv", _data(figure).encode())
    height_in = float(figure.get_size_inches()[1])
    figure.set_size_inches(TWO_COLUMNS_IN, height_in)
    _save(figure, folder / f"{name}-2col", name, style)
    _stack(figure)
    _save(figure, folder / f"{name}-1col", name, style)


def _save(figure: Figure, stem: Path, name: str, style: Mapping[Any, Any]) -> None:
    # Text stays text in the SVG and is embedded as outlines' fonts (type 42) in the PDF.
    with mpl.rc_context({**style, "svg.hashsalt": name, "pdf.fonttype": 42}):
        for kind in _FORMATS:
            out = io.BytesIO()
            date = {"CreationDate": None} if kind == "pdf" else {"Date": None}
            metadata = {} if kind == "png" else date
            figure.savefig(out, format=kind, dpi=_PNG_DPI, metadata=metadata)
            _write(stem.with_name(f"{stem.name}.{kind}"), out.getvalue())


def _write(path: Path, data: bytes) -> None:
    try:
        replace_file(path, data)
    except OSError as error:
        raise unwritable(f"--figures: {path}", error) from None


def _stack(figure: Figure) -> None:
    """Lay the panels above each other in the width of one column, the legend above them."""
    panels = len(figure.axes)
    legend_in = _legend_height_in(figure)
    height_in = panels * (_PANEL_IN + _BELOW_IN) + legend_in
    figure.set_size_inches(ONE_COLUMN_IN, height_in)
    width = 1.0 - (_LEFT_IN + _RIGHT_IN) / ONE_COLUMN_IN
    for row, axes in enumerate(figure.axes):
        top_in = height_in - legend_in - row * (_PANEL_IN + _BELOW_IN)
        axes.set_position(
            (
                _LEFT_IN / ONE_COLUMN_IN,
                (top_in - _PANEL_IN) / height_in,
                width,
                _PANEL_IN / height_in,
            )
        )


def _legend_height_in(figure: Figure) -> float:
    """Return what the legend takes, after breaking it into lines of two entries."""
    for legend in figure.legends:
        legend.set_ncols(2)
        legend.set_bbox_to_anchor((_LEFT_IN / ONE_COLUMN_IN - 0.03, 1.005))
        return _ABOVE_IN + 0.17 * ((len(legend.get_texts()) + 1) // 2 - 1)
    return _ABOVE_IN


def _data(figure: Figure) -> str:
    """Return the lines of all panels, one point a row, under the titles of their axes."""
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(("panel", "line", "x_title", "y_title", "x", "y"))
    for panel, axes in enumerate(figure.axes, 1):
        titles = (axes.get_xlabel(), axes.get_ylabel())
        for line, x, y in _lines(axes):
            table.writerows(
                (panel, line, *titles, f"{a:.9g}", f"{b:.9g}") for a, b in zip(x, y, strict=True)
            )
    return out.getvalue()


def _lines(axes: Axes) -> Iterator[tuple[str, Any, Any]]:
    for number, line in enumerate(axes.get_lines(), 1):
        label = str(line.get_label())
        x = np.asarray(line.get_xdata(), dtype=float)
        y = np.asarray(line.get_ydata(), dtype=float)
        yield (f"line {number}" if label.startswith("_") else label), x, y
