"""Draws a campaign: figures along each varied value, and maps over two; one HTML page, vector."""

from __future__ import annotations

import html
import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hil.record.manifest import replace_file
from hil.report import figures as draw
from hil.study.campaign.findings import Outcomes, sentences, short
from hil.study.campaign.plan import HOLDS, metric_of

# The colours of hil/report/report.html.j2, so that both pages look alike.
_STYLE = """
:root { --paper: #fff; --ink: #1b1f24; --grid: #dfe3e8; --run-0: #0072b2; --run-1: #d55e00;
  --run-2: #00865f; --run-3: #b45a92; --run-4: #b07800; --run-5: #2f86bd; }
@media (prefers-color-scheme: dark) { :root { --paper: #14171a; --ink: #e4e7ea; --grid: #2c3238;
  --run-0: #4fa8e0; --run-1: #ff8f4a; --run-2: #35c596; --run-3: #e29ac7; } }
body { margin: 2.5rem auto; max-width: 62rem; padding: 0 1.5rem; color: var(--ink);
  background: var(--paper); font: 15px/1.55 system-ui, sans-serif; }
figure { margin: 1.4rem 0; break-inside: avoid; } svg { width: 100%; height: auto; }
figcaption { font-size: .88rem; } pre { white-space: pre-wrap; } li { margin: .2rem 0; }
@media print { body { margin: 0; padding: 0; max-width: none; font-size: 9pt; } }
"""


def write_page(path: Path, outcomes: Outcomes, command: str, notes: Sequence[str] = ()) -> None:
    """Write the page, atomically; `command` is the command line that made it.

    `notes` says how runs ended that have no figures, and which program made the rows.
    """
    file = outcomes.campaign.file
    parts = [
        f"<h1>Campaign {html.escape(file.name)}</h1>",
        f"<p>{html.escape(_described(outcomes))}</p>",
        *(f"<p>{html.escape(line)}</p>" for line in notes),
        "<ul>",
        *(f"<li>{html.escape(line)}</li>" for line in sentences(outcomes)),
        "</ul>",
        *_figures(outcomes),
        f"<h2>Command</h2><pre>{html.escape(command)}</pre>",
        f"<p>Campaign SHA-256 {outcomes.campaign.digest}</p>",
    ]
    page = (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f"<title>Campaign {html.escape(file.name)}</title><style>{_STYLE}</style></head>"
        f"<body>{''.join(parts)}</body></html>"
    )
    replace_file(path, page.encode())


def _described(outcomes: Outcomes) -> str:
    file, (pairs, arms) = outcomes.campaign.file, outcomes.complete.shape
    ended = ", ".join(
        f"{label} {int(outcomes.complete[:, i].sum())}" for i, label in enumerate(outcomes.labels)
    )
    return (
        f"{pairs * arms} runs of {file.scenario} on {file.target} with --camera {file.camera}: "
        f"{pairs} pairs of {arms} arms. Runs that came to their end, of {pairs} each: {ended}. "
        "Runs that did not (a safety stop) have no figures and drop their pair, except in the share of "
        "runs that met every requirement."
    )


def _figures(outcomes: Outcomes) -> list[str]:
    found = []
    axes = [axis for axis in outcomes.numeric_axes if len(outcomes.stations(axis)) > 1]
    for axis, figure in itertools.product(axes, outcomes.campaign.file.figures):
        found.append(
            _captioned(
                line_figure(outcomes, axis, figure),
                f"{metric_of(figure).label} along {axis}. Left: mean of each arm with its 95 % "
                f"interval. Right: paired difference to {outcomes.labels[0]} with its 95 % "
                "interval; all other values are averaged over.",
            )
        )
    if len(axes) == 2 and len(outcomes.points) == 2:
        for figure in outcomes.campaign.file.figures:
            found.append(
                _captioned(
                    map_figure(outcomes, axes[0], axes[1], figure),
                    f"{metric_of(figure).label}: difference to {outcomes.labels[0]} in percent"
                    f"{' of all runs' if figure == HOLDS.name else ' of it'}. Blue: lower, red: "
                    f"higher{_direction(figure)}. A dot marks a 95 % interval "
                    "without zero.",
                )
            )
    return found


def _direction(figure: str) -> str:
    better = metric_of(figure).better
    return "" if better == "neither" else f"; {better} is better"


def _captioned(svg: str, caption: str) -> str:
    return f"<figure>{svg}<figcaption>{html.escape(caption)}</figcaption></figure>"


def line_figure(outcomes: Outcomes, axis: str, figure: str) -> str:
    """Draw each arm's level, and each other arm's paired difference, along one value."""
    sheet = draw.Sheet(2, 2.6)
    levels, differences = sheet.axes
    metric = metric_of(figure)
    factor = metric.shown[1] if metric.shown else 1.0
    stations = outcomes.stations(axis)
    x = np.array([station.value for station in stations], dtype=np.float64)
    for arm, label in enumerate(outcomes.labels):
        colour = draw.RUNS[arm % len(draw.RUNS)]
        found = [outcomes.level(figure, arm, station.pairs) for station in stations]
        mean = factor * np.array([value for value, _ in found])
        band = factor * np.array([(span.low, span.high) for _, span in found])
        levels.plot(x, mean, "o-", ms=3, color=colour, label=label)
        levels.fill_between(x, band[:, 0], band[:, 1], color=colour, alpha=0.18, lw=0)
        if arm == 0:
            continue
        results = [outcomes.difference(figure, arm, station.pairs) for station in stations]
        middle = factor * np.array([result.mean for result in results])
        span = factor * np.array([(r.interval.low, r.interval.high) for r in results])
        differences.plot(x, middle, "o-", ms=3, color=colour)
        differences.vlines(x, span[:, 0], span[:, 1], color=colour, lw=1.2)
    differences.axhline(0.0, color=draw.INK, lw=0.8)
    for panel in sheet.axes:
        if x.min() > 0 and x.max() / x.min() > 30:
            panel.set_xscale("log")
    sheet.label(0, f"{metric.label}, {metric.shown_unit}".rstrip(", "), axis)
    sheet.label(1, f"difference, {metric.shown_unit}".rstrip(", "), axis)
    return sheet.svg(f"{axis}-{figure}")


def map_figure(outcomes: Outcomes, x_axis: str, y_axis: str, figure: str) -> str:
    """Draw the relative paired difference of each other arm over two values."""
    others = range(1, len(outcomes.arms))
    sheet = draw.Sheet(max(len(others), 1), 3.0)
    columns, rows = outcomes.stations(x_axis), outcomes.stations(y_axis)
    for panel, arm in enumerate(others):
        axes = sheet.axes[panel]
        shares = np.full((len(rows), len(columns)), np.nan)
        for (j, row), (i, column) in itertools.product(enumerate(rows), enumerate(columns)):
            pairs = np.intersect1d(row.pairs, column.pairs)
            result = outcomes.difference(figure, arm, pairs)
            # A share of runs is a percentage already.
            whole = 1.0 if figure == HOLDS.name else abs(result.baseline_mean)
            if result.pairs and whole:
                shares[j, i] = 100.0 * result.mean / whole
            if result.certain:
                axes.plot(i, j, ".", ms=3, color=draw.INK)
        reach = float(np.nanmax(np.abs(shares), initial=1.0))
        mesh = axes.pcolormesh(
            range(len(columns)), range(len(rows)), shares,
            cmap="RdBu_r", vmin=-reach, vmax=reach, zorder=0, shading="nearest",
        )  # fmt: skip
        axes.set_xticks(range(len(columns)), [short(s.value) for s in columns])
        axes.set_yticks(range(len(rows)), [short(s.value) for s in rows])
        axes.grid(visible=False)
        sheet.figure.colorbar(mesh, ax=axes, label="difference in %")
        axes.set_title(f"{outcomes.labels[arm]} - {outcomes.labels[0]}", loc="left")
        sheet.label(panel, y_axis if panel == 0 else "", x_axis)
    return sheet.svg(f"map-{figure}")
