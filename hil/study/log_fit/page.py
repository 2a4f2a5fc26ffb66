"""The page of a fit: held-out judgement, figures, values with intervals, what is not told."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2
import numpy as np
from markupsafe import Markup

from hil.core.errors import BadInput
from hil.core.files import replace_file
from hil.report.figures import INK, RUNS, Sheet
from hil.study.log_fit.judge import foretold, window_error

if TYPE_CHECKING:
    from hil.study.log_fit.advice import Advice
    from hil.study.log_fit.estimate import Estimate
    from hil.study.log_fit.judge import Score
    from hil.study.log_fit.model import Grid, Track
    from hil.study.log_fit.signals import Poses
    from hil.study.log_fit.windows import Mount, Windows

_SHOWN_LEAST = 3


@dataclass(frozen=True, slots=True)
class Page:
    """What a page shows; `layers` are (title, note, estimates)."""

    title: str
    subtitle: str
    scores: Mapping[str, Score]
    poses: Poses | None
    windows: Windows | None
    foretellers: Mapping[str, tuple[Track | None, Mount]]
    grid: Grid
    layers: Sequence[tuple[str, str, Sequence[Estimate]]] = ()
    advice: Sequence[Advice] = ()
    notes: Sequence[str] = field(default_factory=tuple)


def write_page(path: Path, page: Page) -> None:
    """Write the page in one step; raises BadInput when that cannot be."""
    try:
        replace_file(path, render(page).encode())
    except OSError as error:
        raise BadInput(f"report {path}: cannot be written: {error.strerror}") from None


def render(page: Page) -> str:
    """Return the page as HTML text: one file, no network."""
    template = (files("hil.study.log_fit") / "page.html.j2").read_text(encoding="utf-8")
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.from_string(template).render(
        title=page.title, subtitle=page.subtitle, style=_style(), verdict=verdict(page.scores),
        held_out_note=_held_out_note(page), scores=_score_rows(page.scores), figures=_figures(page),
        layers=[{"title": title, "note": note, "rows": [_row(item) for item in items]}
                for title, note, items in page.layers],
        advice=[{"tells": ", ".join(item.tells), "manoeuvre": item.manoeuvre}
                for item in page.advice],
        notes=list(page.notes),
    )  # fmt: skip


def verdict(scores: Mapping[str, Score]) -> str:
    """Return in one sentence how the fitted twin (or odometry) did against the plain one."""
    fitted = next((name for name in scores if name.startswith("fitted")), None)
    plain = next((name for name in scores if name.startswith("plain")), None)
    if fitted is None or plain is None:
        return "Nothing was held out to judge by: the log has no poses, or too few."
    own, other = scores[fitted].position_m, scores[plain].position_m
    words = "better than" if own < other else "no better than"
    return (
        f"On the part of the log that was not fitted, the {fitted} is {words} {plain}: "
        f"{1e3 * own:.1f} mm against {1e3 * other:.1f} mm RMS."
    )


def _style() -> Markup:
    report = (files("hil.report") / "report.html.j2").read_text(encoding="utf-8")
    found = re.search(r"<style>.*?</style>", report, flags=re.DOTALL)
    return Markup(found.group(0)) if found else Markup("")


def _held_out_note(page: Page) -> str:
    if page.windows is None or not page.scores:
        return "The log gives nothing to judge by."
    return (
        f"{len(page.windows.held_out)} windows of {page.windows.length_s:.2g} s were held out. In each, "
        "the foretelling is laid on the first quarter of a second and left alone after that."
    )


def _score_rows(scores: Mapping[str, Score]) -> list[dict[str, str]]:
    return [
        {
            "name": name,
            "position": f"{1e3 * score.position_m:.1f}",
            "end": f"{1e3 * score.position_end_m:.1f}",
            "heading": f"{math.degrees(score.heading_end_rad):.2f}"
            if math.isfinite(score.heading_end_rad)
            else "-",
        }
        for name, score in scores.items()
    ]


def _row(item: Estimate) -> dict[str, str]:
    return {
        "name": item.name,
        "value": f"{item.value:.4g}" if item.told else "not told",
        "interval": f"{item.low:.4g} to {item.high:.4g}" if item.told else item.note,
        "unit": item.unit,
        "meaning": item.meaning,
    }


def _figures(page: Page) -> list[dict[str, Any]]:
    if page.windows is None or page.poses is None or not page.windows.held_out:
        return []
    shown = [
        (name, colour)
        for (name, _), colour in zip(page.foretellers.items(), RUNS, strict=False)
        if name != "standing still"
    ][:_SHOWN_LEAST]
    return [
        {
            "svg": Markup(_paths(page, page.poses, page.windows, shown)),
            "title": "Paths held out.",
            "caption": "Seen (ink) and foretold in each window held out, from above.",
        },
        {
            "svg": Markup(_errors(page, page.poses, page.windows, shown)),
            "title": "Error of the position foretold.",
            "caption": "Over the time since the beginning of its window; one line a window.",
        },
    ]


def _paths(page: Page, poses: Poses, windows: Windows, shown: Sequence[tuple[str, str]]) -> str:
    figure = Sheet(1, 3.6)
    axes = figure.axes[0]
    axes.set_aspect("equal", adjustable="datalim")
    for k, span in enumerate(windows.held_out):
        first = k == 0
        axes.plot(poses.x_m[span], poses.y_m[span], color=INK, label="seen" if first else None)
        for name, colour in shown:
            x, y, _ = foretold(poses, span, *page.foretellers[name], page.grid)
            axes.plot(x, y, color=colour, linewidth=1.0, label=name if first else None)
    figure.label(0, "Y in m", "X in m")
    return figure.svg("log-fit-paths")


def _errors(page: Page, poses: Poses, windows: Windows, shown: Sequence[tuple[str, str]]) -> str:
    figure = Sheet(1, 2.4)
    axes = figure.axes[0]
    for k, span in enumerate(windows.held_out):
        since = poses.t_s[span] - poses.t_s[span][0]
        for name, colour in shown:
            error, _ = window_error(poses, span, *page.foretellers[name], page.grid)
            axes.plot(since, 1e3 * np.asarray(error), color=colour, linewidth=0.9,
                      label=name if k == 0 else None)  # fmt: skip
    figure.label(0, "error in mm", "t in s")
    return figure.svg("log-fit-errors")
