"""The HTML report: one file, no network, figures as inline SVG, pictures as data."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2
from markupsafe import Markup

from hil.analysis.metrics import all_metrics
from hil.core.figures import BY_NAME, Metric, metric_of
from hil.core.files import replace_file, unwritable
from hil.core.text import visible
from hil.record.layout import refuse_own_file
from hil.report import figures as draw
from hil.report.assumptions import Assumption, assumptions, gain_assumptions
from hil.report.compare import HEADLINES, Comparison, Entry, best_entry, findings
from hil.report.photos import photos
from hil.report.repeats_html import repeats_context

if TYPE_CHECKING:
    from hil.report.circle import CircleStudy
    from hil.report.repeats import Repeats

# Where the thesis shows the same of its experiments: path, error, control, photographs.
_THESIS = {
    "scenario-1": ("8.10", "8.11", "8.12", "8.13"),
    "scenario-2": ("8.14", "8.15", "8.16", "8.17"),
    "scenario-3": ("8.18", "8.19", "8.20", ""),
}

Context = dict[str, Any]


def write_report(
    path: Path,
    comparisons: Sequence[Comparison],
    *,
    command: str,
    title: str = "",
    circle: CircleStudy | None = None,
    repeats: Sequence[Repeats] = (),
) -> None:
    """Write the report of one or several comparisons to `path`, atomically.

    `command` is the command line that made it; `circle` adds the section on ideal sensing.
    Raises BadInput when `path` cannot be written or is a file of a record, RigFault when the disk is
    full.
    """
    refuse_own_file(path, "report")
    page = render(
        comparisons, command=command, title=title, circle=circle, repeats=repeats
    ).encode()
    try:
        replace_file(path, page)
    except OSError as error:
        raise unwritable(f"report {path}", error) from None


def render(
    comparisons: Sequence[Comparison],
    *,
    command: str,
    title: str = "",
    circle: CircleStudy | None = None,
    repeats: Sequence[Repeats] = (),
) -> str:
    """Return the report as HTML text."""
    template = (files("hil.report") / "report.html.j2").read_text(encoding="utf-8")
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True,
        finalize=_shown,
    )  # fmt: skip
    context = {
        "title": title or _title(comparisons),
        "subtitle": _subtitle(comparisons, repeats),
        "verdict": _verdict_of_repeats(repeats) if repeats else _verdict(comparisons),
        "basis_note": _basis_note(comparisons),
        "summary": _summary(comparisons),
        "parts": [_part(comparison) for comparison in comparisons],
        "repeats": {item.scenario_name: repeats_context(item) for item in repeats},
        "circle": _circle(circle) if circle is not None else None,
        "metrics": all_metrics(entry.figures for entry in _entries(comparisons)),
        "conditions": _conditions(comparisons),
        "command": command,
        "provenance": _provenance(comparisons),
        "records": [_record(entry) for item in comparisons for entry in item.entries],
    }
    return environment.from_string(template).render(context)


def _shown(value: object) -> object:
    """Return text with its control characters made visible; markup of the report itself as it is."""
    if not isinstance(value, str) or hasattr(value, "__html__"):
        return value
    return "\n".join(visible(line) for line in value.split("\n"))


def _entries(comparisons: Sequence[Comparison]) -> list[Entry]:
    return [entry for comparison in comparisons for entry in comparison.entries]


def _title(comparisons: Sequence[Comparison]) -> str:
    laws = list(dict.fromkeys(entry.run.manifest.outer for entry in _entries(comparisons)))
    names = ", ".join(comparison.scenario_name for comparison in comparisons)
    return f"{' and '.join(laws)}: {names}"


def _subtitle(comparisons: Sequence[Comparison], repeats: Sequence[Repeats]) -> str:
    first = comparisons[0].entries[0].run.manifest
    repeated = {item.scenario_name for item in repeats}
    single = [item for item in comparisons if item.scenario_name not in repeated]
    runs = len(_entries(single)) + sum(sum(item.arms.values()) for item in repeats)
    started = first.start_time_utc.replace("T", " ")[:16]
    return f"{runs} runs on target {first.target}, camera {first.camera}, {started} UTC"


def _verdict(comparisons: Sequence[Comparison]) -> str:
    entries = _entries(comparisons)
    good = sum(entry.holds for entry in entries)
    if good == len(entries):
        return f"All {good} runs completed and met every requirement of their scenario."
    bad = ", ".join(
        f"{comparison.scenario_name} {entry.label}"
        for comparison in comparisons
        for entry in comparison.entries
        if not entry.holds
    )
    return f"{len(entries) - good} of {len(entries)} runs did not meet every requirement: {bad}."


def _verdict_of_repeats(repeats: Sequence[Repeats]) -> str:
    """Return how many of all repeats held, and which seed the table below shows."""
    good = sum(sum(item.complete.values()) for item in repeats)
    runs = sum(len(item.seeds) * len(item.complete) for item in repeats)
    bad = ", ".join(
        f"{item.scenario_name} {arm} {len(item.seeds) - count}"
        for item in repeats
        for arm, count in item.complete.items()
        if count < len(item.seeds)
    )
    seeds = ", ".join(dict.fromkeys(str(item.seeds[0]) for item in repeats))
    return (
        f"{good} of {runs} paired runs completed and met every requirement of their scenario"
        f"{f' (not: {bad})' if bad else ''}. This table is seed {seeds} alone; what all seeds say "
        "stands under each scenario."
    )


def _basis_note(comparisons: Sequence[Comparison]) -> str:
    entries = [entry for entry in _entries(comparisons) if entry.run.samples["t_s"].size]
    bases = {entry.figures.basis for entry in entries}
    told = {
        "truth": "Errors and paths rest on the simulated robot's true state.",
        "estimate": "Errors and paths rest on the estimated state: the truth is not known here.",
    }
    return " ".join(told[basis] for basis in sorted(bases))


def _colours(comparison: Comparison) -> list[int]:
    return [trace.colour for trace in draw.traces(comparison.entries)]


def _cells(comparison: Comparison, metric: Metric) -> list[Context]:
    values = comparison.values(metric.name)
    best = best_entry(comparison, metric)
    return [
        {"text": metric.text(value, with_unit=False), "best": index == best}
        for index, value in enumerate(values)
    ]


def _summary(comparisons: Sequence[Comparison]) -> Context:
    rows = []
    for comparison in comparisons:
        columns = [_cells(comparison, BY_NAME[name]) for name in HEADLINES]
        colours = _colours(comparison)
        for index, entry in enumerate(comparison.entries):
            rows.append(
                {
                    "new": index == 0,
                    "scenario": comparison.scenario_name if index == 0 else "",
                    "label": entry.label,
                    "colour": colours[index],
                    "holds": entry.holds,
                    "cells": [column[index] for column in columns],
                }
            )
    heads = [(BY_NAME[name].label, BY_NAME[name].shown_unit) for name in HEADLINES]
    return {"heads": heads, "rows": rows}


def _part(comparison: Comparison) -> Context:
    """Return the section of one scenario."""
    colours = _colours(comparison)
    runs = [
        {"label": entry.label, "colour": colour, "outcome": entry.run.manifest.outcome}
        for entry, colour in zip(comparison.entries, colours, strict=True)
    ]
    photographs = _THESIS.get(comparison.scenario_name, ("",) * 4)[3]
    return {
        "anchor": _anchor(comparison.scenario_name),
        "name": comparison.scenario_name,
        "description": comparison.description,
        "warnings": comparison.warnings,
        "figures": _figures(comparison),
        "photos": photos(comparison, colours),
        "photo_title": f"Photographs{_after(photographs)}",
        "runs": runs,
        "rows": [
            {
                "label": metric.label,
                "cells": _cells(comparison, metric),
                "unit": metric.shown_unit,
            }
            for metric in comparison.metrics
        ],
        "requirements": _requirements(comparison),
        "findings": findings(comparison),
    }


def _anchor(name: str) -> str:
    return re.sub(r"[^\w-]+", "-", name)


def _after(number: str) -> str:
    return f" (thesis figure {number})" if number else ""


def _figures(comparison: Comparison) -> list[Context]:
    runs = [run for run in draw.traces(comparison.entries) if run.samples["t_s"].size]
    if not runs:  # every run ended before its first tick
        return []
    anchor = _anchor(comparison.scenario_name)
    path, error, control, _ = _THESIS.get(comparison.scenario_name, ("",) * 4)
    limits = [
        verdict.maximum
        for verdict in comparison.entries[0].verdicts
        if verdict.name == "delta1_worst_last_second_m"
    ]
    limit_m = limits[0] if limits else None
    drawn = [
        (draw.path_figure(runs, f"{anchor}-path", limit_m), f"Path on the floor{_after(path)}",
         "Left: centre of mass in the X-Y plane, seen from above; the arrow is 10 cm along the "
         "heading at the start. Right: the flat output z1, which the laws steer and which lies d0 "
         "ahead of the centre of mass, enlarged around its target; the dotted circle is the limit "
         "on |δ1|. A dot ends each path."),
        (draw.error_figure(runs, f"{anchor}-error", limit_m), f"Error per component{_after(error)}",
         "|z1 - z1*|, logarithmic; the dotted line is the limit that the scenario sets on |δ1| "
         "over the last second."),
        (draw.control_figure(runs, f"{anchor}-control"), f"Control u{_after(control)}",
         "The inputs of the compensated model (2.33): u1 = ζ = dη1/dt, u2 = dη2/dt."),
        (draw.sliding_figure(runs, f"{anchor}-sliding"), "Sliding variable",
         "Norm of s (8.17) and its boundary layer."),
        (draw.wheel_figure(runs, f"{anchor}-wheels"), "Wheel speeds",
         "Measured by the board (thin) over the set-points (wide and faint)."),
    ]  # fmt: skip
    return [
        {"svg": Markup(svg), "title": title, "caption": caption}
        for svg, title, caption in drawn
        if svg is not None
    ]


def _requirements(comparison: Comparison) -> list[Context]:
    """Return one row per requirement; all runs have the same ones, their scenario being one."""
    return [
        {
            "text": verdict.text(),
            "cells": [
                {"value": _shown_value(entry, index), "holds": entry.verdicts[index].holds}
                for entry in comparison.entries
            ],
        }
        for index, verdict in enumerate(comparison.entries[0].verdicts)
    ]


def _shown_value(entry: Entry, index: int) -> str:
    verdict = entry.verdicts[index]
    metric = entry.figures.metric(verdict.name) or metric_of(verdict.name)
    return metric.text(verdict.value)


def _circle(circle: CircleStudy) -> Context:
    svg = draw.circle_figures(circle)
    told = (
        ("tracking", "Tracking of z1* (thesis figure 8.2)", "Both components of the flat output."),
        ("error", "Tracking error (thesis figure 8.3)", "Square of |δ1| and its integral."),
        ("control", "Control (thesis figure 8.4)", "Square of |u|, u = (ζ, u2), and its integral."),
        ("sliding", "Sliding variable", "Norm of s from the first instant, and its layer."),
    )
    return {
        "disturbance": circle.disturbance,
        "findings": circle.findings(),
        "figures": [
            {"svg": Markup(svg[key]), "title": title, "caption": caption}
            for key, title, caption in told
        ],
    }


def _conditions(comparisons: Sequence[Comparison]) -> list[Context]:
    """Return the values that all scenarios share, then what is each one's own, then the gains."""
    tables = [
        {
            item.key: (group, item)
            for group, items in assumptions(comparison_tree(comparison))
            for item in items
        }
        for comparison in comparisons
    ]
    shared = {
        key
        for key, (_, item) in tables[0].items()
        if all(key in table and table[key][1].value == item.value for table in tables)
    }
    blocks = [{"name": "All runs", "groups": _grouped(tables[0], shared)}] if shared else []
    for comparison, table in zip(comparisons, tables, strict=True):
        own = set(table) - shared
        if own:
            groups = _grouped(table, own)
            blocks.append({"name": comparison.scenario_name, "groups": groups})
    blocks.append({"name": "Gains", "groups": _gains(comparisons)})
    return blocks


def comparison_tree(comparison: Comparison) -> dict[str, Any]:
    """Return the resolved scenario of a comparison: that of its first run."""
    return comparison.entries[0].run.manifest.scenario


def _grouped(
    table: dict[str, tuple[str, Assumption]], keys: set[str]
) -> list[tuple[str, list[Assumption]]]:
    groups: dict[str, list[Assumption]] = {}
    for key, (group, item) in table.items():
        if key in keys:
            groups.setdefault(group, []).append(item)
    return list(groups.items())


def _gains(comparisons: Sequence[Comparison]) -> list[tuple[str, list[Assumption]]]:
    """Return the gains that each outer law ran with, as the manifests have them."""
    groups: dict[str, list[Assumption]] = {}
    for entry in _entries(comparisons):
        manifest = entry.run.manifest
        origin = f"set {manifest.gains.get('set', 'unnamed')}"
        values = manifest.gains.get("outer")
        if isinstance(values, dict):
            items = gain_assumptions(manifest.outer, values, origin)
            groups.setdefault(f"{manifest.outer}, {origin}", items)
    return list(groups.items())


_PROVENANCE = {"inner": "wheel law, on the board"}


def _provenance(comparisons: Sequence[Comparison]) -> list[tuple[str, str]]:
    """Return what made the runs; a value that differs between them is listed as it differs."""
    manifests = [entry.run.manifest for entry in _entries(comparisons)]
    rows = []
    for key in ("inner", "git_revision", "dialect_hash", "parameter_hash", "firmware_build_id"):
        found = dict.fromkeys(str(getattr(manifest, key)) or "unknown" for manifest in manifests)
        rows.append((_PROVENANCE.get(key, key.replace("_", " ")), ", ".join(found)))
    versions = manifests[0].versions
    rows += [(name, text) for name, text in versions.items()]
    return rows


def _record(entry: Entry) -> Context:
    manifest = entry.run.manifest
    samples = manifest.files.get("samples.parquet")
    return {
        "name": f"{manifest.scenario_name} {entry.label}",
        "folder": str(entry.run.path),
        "seed": manifest.seed,
        "started": manifest.start_time_utc,
        "digest": f"{samples.sha256[:16]}…" if samples else "record not closed",
    }
