"""Figures as inline SVG: the thesis's figures 8.10 to 8.20 and 8.2 to 8.4, redrawn from runs.

Each figure is a string that goes into the page as it is. Text stays text, and the colours of ink,
grid and runs are CSS variables, so that one figure is right in light, in dark and on paper.
"""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from hil.analysis import metrics
from hil.core.registries import OUTER_LAWS
from hil.report import paper

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from hil.record.journal import Columns
    from hil.report.circle import CircleStudy
    from hil.report.compare import Entry

    Array = NDArray[np.float64]

# Stand-ins that matplotlib writes and the page replaces by a variable of its style sheet.
INK, _FAINT = "#010203", "#a1a2a3"
RUNS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
_VARIABLES = {INK: "var(--ink)", _FAINT: "var(--grid)"} | {
    colour: f"var(--run-{number})" for number, colour in enumerate(RUNS)
}
_WIDTH_IN = 7.4
_NEAR_MM = 40.0
_MAX_POINTS = 600  # a wider line has more points than a screen has dots
_DIGITS = re.compile(r"(\.\d\d)\d+")  # a hundredth of a point is finer than any screen
_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 9.0,
    "axes.labelsize": 9.0,
    "axes.titlesize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "grid.color": _FAINT,
    "grid.linewidth": 0.5,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "text.color": INK,
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "path.simplify": True,
    "path.simplify_threshold": 0.5,
}


@dataclass(frozen=True, slots=True)
class Trace:
    """One run in a figure: its label and its colour's number."""

    label: str
    colour: int
    samples: Columns

    @property
    def paint(self) -> str:
        """Return the stand-in colour that becomes a CSS variable."""
        return RUNS[self.colour]


def traces(entries: Sequence[Entry]) -> list[Trace]:
    """Return the runs with label and colour: each law has its own when there is more than one law.

    Runs of one law then share colour and label, so that a legend has one line for all of them.
    """
    laws = [entry.run.manifest.outer for entry in entries]
    colours = law_colours(laws, own_looks(entries, "colour"))
    called = own_looks(entries, "label")
    by_law = len(colours) > 1
    return [
        Trace(
            (called.get(law) or law) + (entry.label.removeprefix(law) if alone else ""),
            colours[law] if by_law else index % len(RUNS),
            entry.run.samples,
        )
        for index, (entry, law) in enumerate(zip(entries, laws, strict=True))
        for alone in [laws.count(law) == 1 or not by_law]
    ]


def own_looks(entries: Sequence[Entry], look: Literal["label", "colour"]) -> dict[str, str]:
    """Return what each law registered for reports: known here, or kept in its record."""
    kept = {
        plugin.name: getattr(plugin, look)
        for entry in entries
        for plugin in entry.run.manifest.plugins
        if plugin.kind == OUTER_LAWS.kind
    }
    return kept | {law.name: getattr(law, look) for law in OUTER_LAWS.entries()}


def law_colours(laws: Sequence[str], colours: Mapping[str, str]) -> dict[str, int]:
    """Return a place in RUNS for each law: its own colour's where it has one, else the next free."""
    names = list(dict.fromkeys(laws))
    own = {name: colour.lower() for name, colour in colours.items()}
    taken: dict[str, int] = {}
    for name in names:
        if own.get(name) in RUNS and RUNS.index(own[name]) not in taken.values():
            taken[name] = RUNS.index(own[name])
    free = (place for place in range(len(RUNS)) if place not in taken.values())
    for name in names:
        if name not in taken:
            taken[name] = next(free, len(taken) % len(RUNS))
    return taken


class Sheet:
    """One figure under construction: a row of panels under one legend, closed by `svg`."""

    def __init__(self, panels: int, height_in: float = 2.4) -> None:
        # Margins are fixed in inches: matplotlib's layout engines draw every figure twice.
        with mpl.rc_context(_STYLE):
            self.figure = Figure(figsize=(_WIDTH_IN, height_in))
            FigureCanvasSVG(self.figure)
            self.axes: list[Axes] = list(self.figure.subplots(1, panels, squeeze=False)[0])
            self.figure.subplots_adjust(
                left=0.7 / _WIDTH_IN,
                right=1.0 - 0.08 / _WIDTH_IN,
                bottom=0.42 / height_in,
                top=1.0 - 0.32 / height_in,
                wspace=0.27,
            )

    def label(self, panel: int, y_title: str, x_title: str = "t in s") -> None:
        """Name the axes of one panel, with units."""
        self.axes[panel].set_xlabel(x_title, labelpad=2)
        self.axes[panel].set_ylabel(y_title)

    def svg(self, name: str) -> str:
        """Return the figure as an SVG element; `name` keeps its identifiers apart from others'."""
        handles, names = self.axes[0].get_legend_handles_labels()
        lines = dict(zip(names, handles, strict=True))
        out = io.StringIO()
        with mpl.rc_context(_STYLE | {"svg.hashsalt": name}):
            self.figure.legend(
                list(lines.values()), list(lines), ncols=len(lines), columnspacing=1.6,
                handlelength=1.6, loc="upper left", bbox_to_anchor=(0.55 / _WIDTH_IN, 1.01),
            )  # fmt: skip
            self.figure.savefig(out, format="svg", transparent=True, metadata={"Date": None})
        paper.keep(self.figure, name, _STYLE)
        return _for_page(out.getvalue())


def _for_page(text: str) -> str:
    """Return the SVG element alone: no numbered identifiers, colours as CSS variables."""
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, count=1, flags=re.DOTALL)
    text = re.sub(r"<defs>\s*<style.*?</defs>", "", text, count=1, flags=re.DOTALL)
    text = re.sub(r' id="[\w.]+_\d+"', "", text)
    text = re.sub(r"font-family: [^;]*; ", "", text)
    text = re.sub(r'(?<= d=")[^"]+', lambda path: _DIGITS.sub(r"\1", path[0]), text)
    for colour, variable in _VARIABLES.items():
        text = text.replace(colour, variable)
    return text


def _thin(*columns: Array) -> list[Array]:
    """Return every n-th point so that a line has at most _MAX_POINTS, always with the last."""
    size = columns[0].size
    step = -(-size // _MAX_POINTS)
    keep = np.arange(size - 1, -1, -step)[::-1]
    return [column[keep] for column in columns]


def path_figure(runs: Sequence[Trace], name: str, limit_m: float | None) -> str:
    """Draw the way on the floor (figures 8.10, 8.14, 8.18) and, enlarged, delta1 near its target."""
    sheet = Sheet(2, 3.4)
    floor, near = sheet.axes
    for run in runs:
        who = "true" if metrics.has_truth(run.samples) else "est"
        x_m, y_m = _thin(run.samples[f"{who}_x_m"], run.samples[f"{who}_y_m"])
        floor.plot(x_m, y_m, color=run.paint, label=run.label)
        error_x, error_y = (part * 1e3 for part in metrics.error_components(run.samples))
        near.plot(error_x, error_y, color=run.paint)
        for axes, x, y in ((floor, x_m, y_m), (near, error_x, error_y)):
            axes.plot(x[-1], y[-1], "o", ms=5, color=run.paint)
    first = runs[0].samples
    reference = _thin(first["ref_z1_x_m"], first["ref_z1_y_m"])
    floor.plot(*reference, "--", color=INK, lw=0.8)
    floor.plot(
        *(part[-1] for part in reference), "+", ms=11, mew=1.4, color=INK, label="target z1*"
    )
    near.plot(0.0, 0.0, "+", ms=11, mew=1.4, color=INK)
    _draw_start(floor, first)
    floor.set_aspect("equal", adjustable="datalim")
    _draw_limit(near, limit_m)
    sheet.label(0, "Y in m", "X in m")
    sheet.label(1, "δ1,Y in mm", "δ1,X in mm")
    return sheet.svg(name)


def _draw_limit(near: Axes, limit_m: float | None) -> None:
    """Show the plane of delta1 around the target, with the circle that the limit allows."""
    if limit_m is not None:
        turn = np.linspace(0.0, 2.0 * np.pi, 90)
        radius_mm = limit_m * 1e3
        near.plot(radius_mm * np.cos(turn), radius_mm * np.sin(turn), ":", color=INK, lw=0.8)
    near.set_aspect("equal", adjustable="box")
    near.set_xlim(-_NEAR_MM, _NEAR_MM)
    near.set_ylim(-_NEAR_MM, _NEAR_MM)


def _draw_start(axes: Axes, samples: Columns) -> None:
    """Mark the start with an arrow of 10 cm along the heading."""
    who = "true" if metrics.has_truth(samples) else "est"
    x_m, y_m, theta = (samples[f"{who}_{key}"][0] for key in ("x_m", "y_m", "theta_rad"))
    step = (0.1 * np.cos(theta), 0.1 * np.sin(theta))
    axes.arrow(x_m, y_m, *step, width=0.002, head_width=0.014, head_length=0.03,
               length_includes_head=True, color=INK, lw=0)  # fmt: skip
    axes.plot(x_m, y_m, "s", ms=4, color=INK, label="start, heading")


def error_figure(runs: Sequence[Trace], name: str, limit_m: float | None) -> str:
    """Draw |delta1| per component (figures 8.11, 8.15, 8.19), logarithmic, in mm."""
    sheet = Sheet(2)
    for component, axes in enumerate(sheet.axes):
        for run in runs:
            error_m = metrics.error_components(run.samples)[component]
            t_s, error_mm = _thin(run.samples["t_s"], np.abs(error_m) * 1e3)
            axes.semilogy(t_s, np.maximum(error_mm, 0.01), color=run.paint, label=run.label)
        if limit_m is not None:
            axes.axhline(limit_m * 1e3, color=INK, lw=0.8, ls=":", label="limit")
        sheet.label(component, f"|δ1,{'XY'[component]}| in mm")
    top = max(axes.get_ylim()[1] for axes in sheet.axes)
    for axes in sheet.axes:
        axes.set_ylim(0.1, top)
    return sheet.svg(name)


def control_figure(runs: Sequence[Trace], name: str) -> str:
    """Draw the control u of the compensated model (figures 8.12, 8.16, 8.20)."""
    signals = (("zeta_m_s2", "u1 = ζ in m/s²"), ("u2_m_s2", "u2 in m/s²"))
    return _pair_figure(runs, signals, name)


def wheel_figure(runs: Sequence[Trace], name: str) -> str:
    """Draw the measured wheel speeds, and the commanded ones as a faint line beneath."""
    signals = (
        ("omega_meas_left_rad_s", "left wheels in rad/s"),
        ("omega_meas_right_rad_s", "right wheels in rad/s"),
    )
    return _pair_figure(runs, signals, name, under="cmd")


def _pair_figure(
    runs: Sequence[Trace], signals: Sequence[tuple[str, str]], name: str, under: str = ""
) -> str:
    sheet = Sheet(len(signals))
    for panel, (column, title) in enumerate(signals):
        axes = sheet.axes[panel]
        for run in runs:
            t_s, values = _thin(run.samples["t_s"], run.samples[column])
            if under:
                wanted = _thin(run.samples[column.replace("meas", under)])[0]
                axes.step(t_s, wanted, where="post", color=run.paint, lw=2.6, alpha=0.3)
            axes.step(t_s, values, where="post", color=run.paint, lw=1.0, label=run.label)
        sheet.label(panel, title)
    return sheet.svg(name)


# ||s|| starts at zero, which a logarithmic axis cannot show; less than this is noise.
_S_FLOOR_M_S2 = 1e-3


def sliding_figure(runs: Sequence[Trace], name: str) -> str | None:
    """Draw ||s|| against its layer eps; None when no run has a sliding variable.

    Logarithmic: the layer may shrink by two decades, and ||s|| lies far inside it at first.
    """
    sliding = [run for run in runs if np.isfinite(run.samples["s_x_m_s2"]).any()]
    if not sliding:
        return None
    sheet = Sheet(1, 2.2)
    axes = sheet.axes[0]
    for run in sliding:
        norm = np.hypot(run.samples["s_x_m_s2"], run.samples["s_y_m_s2"])
        t_s, s_norm, eps = _thin(run.samples["t_s"], norm, run.samples["eps_m_s2"])
        axes.plot(t_s, s_norm, color=run.paint, lw=1.0, label=f"‖s‖, {run.label}")
        axes.plot(t_s, eps, color=INK, lw=0.8, ls=":", label=f"layer ε, {run.label}")
    sheet.label(0, "‖s‖ in m/s²")
    axes.set_yscale("log")
    axes.set_ylim(_S_FLOOR_M_S2, None)
    return sheet.svg(name)


def circle_figures(circle: CircleStudy) -> dict[str, str]:
    """Draw figures 8.2 to 8.4 and the sliding variable of the ideal-sensing study, by key."""
    return {
        "tracking": _circle_tracking(circle),
        "error": _circle_pair(circle, "delta1", ("|δ1|² in mm²", "∫|δ1|² in m²·s"), 1e6),
        "control": _circle_pair(circle, "u", ("|u|² in m²/s⁴", "∫|u|² in m²/s³"), 1.0),
        "sliding": _circle_sliding(circle),
    }


def _circle_tracking(circle: CircleStudy) -> str:
    sheet = Sheet(2)
    for panel, axes in enumerate(sheet.axes):
        for number, run in enumerate(circle.runs.values()):
            t_s, z1_m, wanted_m = _thin(run.t_s, run.z1_m[:, panel], run.z1_ref_m[:, panel])
            if number == 0:
                axes.plot(t_s, wanted_m, "--", color=INK, lw=0.8, label="reference z1*")
            axes.plot(t_s, z1_m, color=RUNS[number], lw=1.0, label=list(circle.runs)[number])
        sheet.label(panel, f"z1,{'XY'[panel]} in m")
    return sheet.svg("circle-tracking")


def _circle_pair(circle: CircleStudy, key: str, titles: tuple[str, str], factor: float) -> str:
    """Draw the square of a signal, logarithmic, and its integral."""
    sheet = Sheet(2)
    for number, (label, run) in enumerate(circle.runs.items()):
        square = (getattr(run, key) ** 2).sum(axis=1)
        total = np.cumsum(square) * (run.t_s[1] - run.t_s[0])
        t_s, square, total = _thin(run.t_s, square * factor, total)
        sheet.axes[0].semilogy(t_s, square, color=RUNS[number], lw=1.0, label=label)
        sheet.axes[1].plot(t_s, total, color=RUNS[number], label=label)
    sheet.label(0, titles[0])
    sheet.label(1, titles[1])
    return sheet.svg(f"circle-{key}")


def _circle_sliding(circle: CircleStudy) -> str:
    sheet = Sheet(1, 2.2)
    axes = sheet.axes[0]
    for number, (label, run) in enumerate(circle.runs.items()):
        norm = np.hypot(run.s[:, 0], run.s[:, 1])
        if np.isfinite(norm).all():
            axes.plot(*_thin(run.t_s, norm), color=RUNS[number], lw=0.9, label=f"‖s‖, {label}")
    axes.axhline(circle.layer_m_s2, color=INK, lw=0.8, ls=":", label="layer ε")
    axes.set_ylim(0.0, None)
    sheet.label(0, "‖s‖ in m/s²")
    return sheet.svg("circle-sliding")
