"""The figures of chapters 4 to 7, redrawn from the samples of rows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hil.report.figures import INK, RUNS, Sheet
from hil.study.chapters.deck import FigureSpec
from hil.study.chapters.runs import RowResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_MAX_POINTS = 500
# column -> title of its axis
_TITLES = {
    "x_m": "x in m", "y_m": "y in m", "z_m": "z in m", "error_m": "|error| in m",
    "ise_m2_s": "∫|error|² in m² s", "u2": "|u|²", "effort": "∫|u|²", "cost_m": "H in m",
    "s_m_s": "||s|| in m/s", "u_m_s": "u in m/s", "v_m_s": "v in m/s", "w_m_s": "w in m/s",
    "q_rad_s": "q in rad/s", "r_rad_s": "r in rad/s", "tau_u_n": "thrust in N",
    "tau_q_n_m": "pitch torque in N m", "tau_r_n_m": "yaw torque in N m",
}  # fmt: skip
_FLOOR = 1e-6  # of a logarithmic axis


def figure_svg(spec: FigureSpec, rows: Sequence[RowResult]) -> str:
    """Return one figure as an SVG element; rows of the user's own law join it."""
    table = {row.name: row for row in rows}
    shown = [table[name] for name in spec.rows if name in table]
    shown += [row for row in rows if row.kind == "own law"]
    sheet = Sheet(len(spec.panels), 2.6)
    for panel, columns in enumerate(spec.panels):
        y_name, _, x_name = columns.partition(" over ")
        axes = sheet.axes[panel]
        for number, row in enumerate(shown):
            x, y = _points(row, x_name or "t_s", y_name, spec.until_s)
            axes.plot(x, np.maximum(y, _FLOOR) if spec.log else y, color=RUNS[number % len(RUNS)],
                      label=row.name)  # fmt: skip
        if spec.reference and shown:
            _reference(axes, shown[0], x_name or "t_s", y_name, spec.until_s)
        if spec.log:
            axes.set_yscale("log")
        sheet.label(panel, _TITLES[y_name], _TITLES.get(x_name, "t in s"))
    return sheet.svg(f"figure-{spec.number}")


def _points(row: RowResult, x_name: str, y_name: str, until_s: float | None) -> tuple[Array, Array]:
    samples = row.samples
    keep = samples["t_s"] <= (until_s or np.inf)
    x, y = samples[x_name][keep], samples[y_name][keep]
    step = max(1, -(-x.size // _MAX_POINTS))
    return x[::step], y[::step]


def _reference(axes: Axes, row: RowResult, x_name: str, y_name: str, until_s: float | None) -> None:
    across = x_name if x_name == "t_s" else f"ref_{x_name}"
    x, y = _points(row, across, f"ref_{y_name}", until_s)
    axes.plot(x, y, "--", color=INK, lw=0.8, label="reference")
