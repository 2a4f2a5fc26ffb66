"""Repeated runs of one scenario: arms (outer law over inner law), paired by seed.

Runs of one pair of laws with other gains are another arm (hil/report/arms.py). Seeds that every arm
has form the pairs. With both outer and both inner laws the four arms give three contrasts per
figure: outer law, inner law, and their interaction.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.analysis.intervals import FEW, coverage_of
from hil.analysis.metrics import Figures, all_metrics
from hil.analysis.stats import Adjusted, Paired, adjusted, paired
from hil.core.figures import Metric
from hil.report.arms import Arm, arm_names, arms_of, by_seed
from hil.report.compare import differences, is_judged, is_open_loop, shown_cell

if TYPE_CHECKING:
    from rich.table import Table

    from hil.record.reader import RunRecord

Values = dict[Arm, dict[int, float]]  # a figure of each arm by seed


_INTERACTION = "interaction"


@dataclass(frozen=True, slots=True)
class Contrast:
    """One question of an experiment and its answer per figure, by the figure's name."""

    name: str
    results: dict[str, Paired]
    at_equal_battery: dict[str, Adjusted]

    @property
    def is_interaction(self) -> bool:
        """Say whether it is a difference of differences, whose sides are sums that nobody ran."""
        return self.name.startswith(_INTERACTION)

    def to_json(self) -> dict[str, Any]:
        """Return the contrast for a JSON document."""
        figures = {name: result.to_json() for name, result in self.results.items()}
        for name, item in self.at_equal_battery.items():
            figures[name]["at_equal_battery"] = item.to_json()
        return {"contrast": self.name, "figures": figures}


@dataclass(frozen=True, slots=True)
class Repeats:
    """All repeats of one scenario; `complete` counts the runs of each arm that met everything."""

    scenario_name: str
    seeds: tuple[int, ...]
    arms: dict[str, int]
    complete: dict[str, int]
    contrasts: tuple[Contrast, ...]
    warnings: tuple[str, ...]
    metrics: tuple[Metric, ...]  # what the contrasts' figures are

    def metric(self, name: str) -> Metric:
        """Return one of `metrics`."""
        return next(metric for metric in self.metrics if metric.name == name)

    def to_json(self) -> dict[str, Any]:
        """Return the statistics for a JSON document."""
        return {
            "scenario": self.scenario_name,
            "seeds": list(self.seeds),
            "arms": self.arms,
            "met_every_requirement": self.complete,
            "warnings": list(self.warnings),
            "contrasts": [contrast.to_json() for contrast in self.contrasts],
        }


def repeats_of(runs: Sequence[RunRecord]) -> Repeats | None:
    """Return the statistics of runs of one scenario; None without two arms and two common seeds.

    Raises BadInput when two runs of an arm and seed are told apart by nothing.
    """
    groups = arms_of(runs)
    seeds = [{run.manifest.seed for run in group} for group in groups.values()]
    common = sorted(set.intersection(*seeds))
    if len(groups) < 2 or len(common) < 2:
        return None
    names = arm_names(list(groups))
    arms = {arm: by_seed(names[arm], group) for arm, group in groups.items()}
    paired_runs = {arm: {seed: by_seed[seed] for seed in common} for arm, by_seed in arms.items()}
    figures = {
        arm: {seed: _figures(run) for seed, run in by_seed.items()}
        for arm, by_seed in paired_runs.items()
    }
    every = [run for by_seed in figures.values() for run in by_seed.values() if run is not None]
    metrics = tuple(metric for metric in all_metrics(every) if metric.better != "neither")
    by_figure: dict[str, Values] = {
        metric.name: {
            arm: {seed: _value(found, metric.name) for seed, found in by_seed.items()}
            for arm, by_seed in figures.items()
        }
        for metric in metrics
    }
    battery: Values = {
        arm: {seed: _battery_v(run) for seed, run in by_seed.items()}
        for arm, by_seed in paired_runs.items()
    }
    return Repeats(
        scenario_name=runs[0].manifest.scenario_name,
        seeds=tuple(common),
        arms={names[arm]: len(by_seed) for arm, by_seed in arms.items()},
        complete={
            names[arm]: sum(_holds(run) for run in by_seed.values())
            for arm, by_seed in paired_runs.items()
        },
        contrasts=tuple(
            _contrast(name, sides, by_figure, battery, common)
            for name, sides in _questions(list(arms), names)
        ),
        warnings=tuple(_warnings(arms, names, common)),
        metrics=metrics,
    )


# How a question combines the arms of one seed: weights of the arms on each side.
Sides = tuple[dict[Arm, float], dict[Arm, float]]


def _questions(arms: Sequence[Arm], names: dict[Arm, str]) -> list[tuple[str, Sides]]:
    """Return the contrasts: every arm against the first, and the factors of a full 2 x 2."""
    base = arms[0]
    found: list[tuple[str, Sides]] = [
        (f"{names[arm]} - {names[base]}", ({base: 1.0}, {arm: 1.0})) for arm in arms[1:]
    ]
    outers = list(dict.fromkeys(arm[0] for arm in arms))
    inners = list(dict.fromkeys(arm[1] for arm in arms))
    if len(outers) == 2 and len(inners) == 2 and len({arm[:2] for arm in arms}) == len(arms) == 4:
        (a, b), (c, d) = outers, inners
        at = {arm[:2]: arm for arm in arms}
        found += [
            (f"outer law: {b} - {a}, mean over the inner laws",
             ({at[a, c]: 0.5, at[a, d]: 0.5}, {at[b, c]: 0.5, at[b, d]: 0.5})),
            (f"inner law: {d} - {c}, mean over the outer laws",
             ({at[a, c]: 0.5, at[b, c]: 0.5}, {at[a, d]: 0.5, at[b, d]: 0.5})),
            (f"{_INTERACTION}: {b} - {a} over {d}, less {b} - {a} over {c}",
             ({at[b, c]: 1.0, at[a, d]: 1.0}, {at[a, c]: 1.0, at[b, d]: 1.0})),
        ]  # fmt: skip
    return found


def _contrast(
    name: str, sides: Sides, by_figure: dict[str, Values], battery: Values, seeds: Sequence[int]
) -> Contrast:
    def arm_values(values: Values, weights: dict[Arm, float]) -> list[float]:
        return [sum(w * values[arm][seed] for arm, w in weights.items()) for seed in seeds]

    def difference(values: Values) -> list[float]:
        one, two = (arm_values(values, weights) for weights in sides)
        return [b - a for a, b in zip(one, two, strict=True)]

    volts = difference(battery)
    results, at_equal = {}, {}
    for figure, values in by_figure.items():
        one, two = (arm_values(values, weights) for weights in sides)
        results[figure] = paired(one, two)
        item = adjusted(difference(values), volts)
        if item is not None:
            at_equal[figure] = item
    return Contrast(name, results, at_equal)


def _battery_v(run: RunRecord) -> float:
    """Return the battery's mean voltage before the wheels load it: over the first second."""
    samples = run.samples
    early = samples["battery_v"][samples["t_s"] <= 1.0]
    known = early[np.isfinite(early)]
    # A real cell falls by hundredths of a volt from run to run; less is the converter's noise.
    return round(float(known.mean()), 2) if known.size else math.nan


def _figures(run: RunRecord) -> Figures | None:
    """Return a run's figures; none of a run that says nothing of its law (see is_judged)."""
    return run.figures() if is_judged(run) else None


def _value(found: Figures | None, name: str) -> float:
    return math.nan if found is None else found.values.get(name, math.nan)


def _holds(run: RunRecord) -> bool:
    complete = run.manifest.outcome == "complete"
    return complete and all(verdict.holds for verdict in run.verdicts())


def _warnings(
    arms: dict[Arm, dict[int, RunRecord]], names: dict[Arm, str], common: Sequence[int]
) -> list[str]:
    lines = []
    for arm, own in arms.items():
        alone = sorted(set(own) - set(common))
        if alone:
            lines.append(f"{names[arm]}: {len(alone)} runs without a partner of the same seed")
        ended = sum(run.manifest.outcome != "complete" for run in own.values())
        if ended:
            lines.append(f"{names[arm]}: {ended} runs ended early; their pairs are left out")
        replays = sum(is_open_loop(run) for run in own.values())
        if replays:
            lines.append(f"{names[arm]}: {replays} replays (open loop); their pairs are left out")
    lines += _unlike([run for own in arms.values() for run in own.values()])
    if len(common) < FEW:
        lines.append(f"{len(common)} pairs: {coverage_of(len(common)).text()}")
    return lines


def _unlike(runs: Sequence[RunRecord]) -> list[str]:
    """Return a line for each condition in which the runs differ, and each flaw of a record."""
    lines = [f"{run.path.name}: {problem}" for run in runs for problem in run.problems]
    for key in ("target", "camera", "git_revision", "firmware_build_id"):
        found = sorted({str(getattr(run.manifest, key)) for run in runs})
        if len(found) > 1:
            lines.append(f"the runs differ in {key.replace('_', ' ')}: {', '.join(found)}")
    first = runs[0].manifest.scenario
    keys = {
        key
        for run in runs[1:]
        if run.manifest.scenario != first
        for key, _, _ in differences(first, run.manifest.scenario)
    }
    return lines + [f"the runs differ in {key}" for key in sorted(keys)]


def verdict(metric: Metric, result: Paired, name: str) -> str:
    """Return one sentence on one figure of a contrast."""
    if result.pairs < 2:
        return f"{metric.label}: {result.pairs} pairs, nothing can be said"
    low, high = (metric.text(value) for value in (result.interval.low, result.interval.high))
    said = f"{metric.label}: {name} = {metric.text(result.mean)}, 95 % {low} to {high}"
    left = f", {result.left_out} pairs without a value" if result.left_out else ""
    if not result.certain:
        return f"{said}{left}: no difference shown"
    better = (result.mean < 0) == (metric.better == "lower")
    return f"{said}{left}: {'better' if better else 'worse'}"


def text_tables(repeats: Repeats, figures: Sequence[str]) -> list[Table]:
    """Return one table per contrast for a terminal, over the named figures."""
    return [_table(repeats, contrast, figures) for contrast in repeats.contrasts]


def _table(repeats: Repeats, contrast: Contrast, figures: Sequence[str]) -> Table:
    from rich.table import Table  # noqa: PLC0415 - terminals only

    title = shown_cell(f"{repeats.scenario_name}: {contrast.name}, {len(repeats.seeds)} pairs")
    table = Table(title=title, title_justify="left")
    for head in ("figure", "baseline", "other", "difference", "95 % interval", "effect", "unit"):
        table.add_column(head, justify="left" if head in {"figure", "unit"} else "right")
    for name in figures:
        metric, result = repeats.metric(name), contrast.results[name]
        shown = (result.baseline_mean, result.other_mean, result.mean)
        cells = [metric.text(value, with_unit=False) for value in shown]
        if contrast.is_interaction:
            cells[:2] = ["", ""]
        ends = (result.interval.low, result.interval.high)
        span = " to ".join(metric.text(value, with_unit=False) for value in ends)
        if result.certain:
            good = (result.mean < 0) == (metric.better == "lower")
            cells[2] = f"[bold {'green' if good else 'red'}]{cells[2]}[/]"
        effect = f"{result.effect:.2f}" if math.isfinite(result.effect) else "–"
        table.add_row(metric.label, *cells, span, effect, metric.shown_unit)
    return table
