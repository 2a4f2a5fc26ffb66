"""The statistics of repeats for the HTML report: a forest plot and a table per contrast."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from hil.analysis.stats import Paired
from hil.report import figures as draw
from hil.report.compare import HEADLINES
from hil.report.repeats import Contrast, Repeats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hil.core.figures import Metric

_REACH_PERCENT = 150.0  # further differences are drawn as leaving the axis


def repeats_context(repeats: Repeats) -> dict[str, Any]:
    """Return what the template needs of one scenario's repeats."""
    met = ", ".join(f"{arm} in {count}" for arm, count in repeats.complete.items())
    return {
        "intro": (
            f"{len(repeats.seeds)} seeds, each run with every law under the same noise, delays and "
            f"losses. Runs that met every requirement: {met}. Intervals are 95 % "
            "intervals of the mean difference: Student's t and the studentised bootstrap."
        ),
        "caption": (
            "Mean of other - baseline in percent of the baseline's mean, with its 95 % interval; "
            "to the left of zero the other law is lower. Filled: the interval does not contain "
            "zero."
        ),
        "first_seed": repeats.seeds[0],
        "warnings": repeats.warnings,
        "svg": Markup(forest_figure(repeats, f"{repeats.scenario_name}-repeats")),
        "contrasts": [_contrast(contrast, repeats.metrics) for contrast in repeats.contrasts],
    }


def _contrast(contrast: Contrast, metrics: Sequence[Metric]) -> dict[str, Any]:
    rows = []
    for metric in metrics:
        result = contrast.results.get(metric.name)
        if result is None or result.pairs < 2:
            continue
        text = [
            metric.text(value, with_unit=False)
            for value in (result.baseline_mean, result.other_mean, result.mean)
        ]
        span = (result.interval.low, result.interval.high)
        if contrast.is_interaction:
            text[:2] = ["", ""]
        text.append(" to ".join(metric.text(value, with_unit=False) for value in span))
        text.append(f"{result.effect:.2f}" if math.isfinite(result.effect) else "–")
        text.append(str(result.pairs))
        lower_is_good = metric.better == "lower"
        verdict = "better" if (result.mean < 0) == lower_is_good else "worse"
        rows.append(
            {
                "label": metric.label,
                "cells": text,
                "unit": metric.shown_unit,
                "verdict": verdict if result.certain else "no difference shown",
            }
        )
    return {"name": contrast.name, "rows": rows}


def forest_figure(repeats: Repeats, name: str) -> str:
    """Draw the headline figures' differences with their intervals, one panel per contrast."""
    contrasts = repeats.contrasts[-3:]  # of a 2 x 2 matrix the factors and their interaction
    sheet = draw.Sheet(len(contrasts), 0.8 + 0.26 * len(HEADLINES))
    sheet.figure.subplots_adjust(left=0.24, wspace=0.12)
    for panel, contrast in enumerate(contrasts):
        axes = sheet.axes[panel]
        for row, metric_name in enumerate(HEADLINES):
            _bar(axes, row, contrast.results[metric_name])
        axes.axvline(0.0, color=draw.INK, lw=0.8)
        axes.set_ylim(len(HEADLINES) - 0.5, -0.5)
        labels = [repeats.metric(key).label for key in HEADLINES] if panel == 0 else []
        axes.set_yticks(range(len(HEADLINES)), labels or [""] * len(HEADLINES))
        axes.set_xlabel("difference in % of the baseline", labelpad=2)
        title = "interaction" if contrast.is_interaction else contrast.name.split(",")[0]
        axes.set_title(title, fontsize=8.5, loc="left")
    return sheet.svg(name)


def _bar(axes: Axes, row: int, result: Paired) -> None:
    if result.pairs < 2 or result.baseline_mean == 0.0:
        return
    unit = 100.0 / abs(result.baseline_mean)
    low, middle, high = (
        min(max(value * unit, -_REACH_PERCENT), _REACH_PERCENT)
        for value in (result.interval.low, result.mean, result.interval.high)
    )
    axes.plot([low, high], [row, row], color=draw.INK, lw=1.2)
    face = draw.INK if result.certain else "none"
    axes.plot([middle], [row], "o", ms=4.5, mec=draw.INK, mfc=face)
