"""Sets runs of one scenario side by side, and says plainly which did better in what.

Runs are comparable when their task is the same: scenario name, start, reference and duration.
Everything else that differs (seed, limits, robot, link) is named as a warning.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil.analysis.metrics import Figures, Verdict, all_metrics, check
from hil.config.control import WaypointReference
from hil.control.references import unfinished
from hil.core.errors import BadInput
from hil.core.figures import BY_NAME, Metric
from hil.core.text import visible
from hil.record import layout
from hil.record.manifest import read_manifest
from hil.report.target_gap import tier_gap

if TYPE_CHECKING:
    from rich.table import Table

    from hil.record.reader import RunRecord

_TASK_KEYS = ("name", "start", "reference", "duration_s")
# What a law brings along, and what runs are judged by: the subject of a comparison, no condition of it.
_OWN_KEYS = ("description", "figures", "requirements", "control.outer", "control.gain")
# The figures that decide the summary, with the question that each one answers.
HEADLINES = {
    "delta1_worst_last_second_m": "accuracy",
    "settling_20mm_s": "speed",
    "ise_m2_s": "error integral",
    "control_energy_m2_s3": "control effort",
    "theta_dot_variation_rad_s": "command smoothness",
    "pwm_variation_counts": "PWM chatter",
}
# Share by which two runs may differ in length and still be set against each other.
_EQUAL_LENGTH = 0.05
_EQUAL_RATIO = 1.05


@dataclass(frozen=True, slots=True)
class Entry:
    """One run of a comparison, under the shortest label that tells it from the others."""

    label: str
    run: RunRecord
    figures: Figures
    verdicts: tuple[Verdict, ...]

    @property
    def holds(self) -> bool:
        """Say whether the run completed and met every requirement of its scenario."""
        complete = self.run.manifest.outcome == "complete"
        return complete and all(verdict.holds for verdict in self.verdicts)

    @property
    def judged(self) -> bool:
        """Say whether the run's figures may be set against those of others."""
        return is_judged(self.run)


@dataclass(frozen=True, slots=True)
class Comparison:
    """Runs of one scenario, and what a reader must know before trusting their differences."""

    scenario_name: str
    description: str
    entries: tuple[Entry, ...]
    warnings: tuple[str, ...]

    @property
    def holds(self) -> bool:
        """Say whether every run met every requirement."""
        return all(entry.holds for entry in self.entries)

    @property
    def metrics(self) -> tuple[Metric, ...]:
        """Return every figure that some run has, the built-in ones first."""
        return all_metrics(entry.figures for entry in self.entries)

    def values(self, name: str) -> list[float]:
        """Return a figure of each run, NaN where a run has none."""
        return [entry.figures.values.get(name, math.nan) for entry in self.entries]


def is_judged(run: RunRecord) -> bool:
    """Say whether a run's figures are those of its law: it came to its end, in closed loop.

    One that was stopped early looks quick and calm; in a replay the robot goes where the record's
    commands took it.
    """
    return run.manifest.outcome == "complete" and not is_open_loop(run)


def is_open_loop(run: RunRecord) -> bool:
    """Say whether the run was driven by a record's inputs instead of a robot's."""
    return run.manifest.target.startswith("replay:")


def compare_runs(runs: Sequence[RunRecord], least: int = 2) -> Comparison:
    """Return the comparison of `least` or more runs; raises BadInput when their tasks differ."""
    if len(runs) < least:
        raise BadInput(f"compare: {len(runs)} run given, at least {least} are needed")
    for run in runs:
        refuse_other_task(runs[0], run)
        _refuse_other_tape(run)
    entries = tuple(_entry(label, run) for label, run in zip(labels(runs), runs, strict=True))
    first = runs[0].manifest
    description = str(first.scenario.get("description", ""))
    return Comparison(first.scenario_name, description, entries, tuple(_warnings(entries)))


def _entry(label: str, run: RunRecord) -> Entry:
    figures = run.figures()
    return Entry(label, run, figures, check(figures, run.manifest.scenario))


def refuse_other_task(first: RunRecord, other: RunRecord) -> None:
    """Raise BadInput when two runs are not of one task."""
    for key in _TASK_KEYS:
        here, there = first.manifest.scenario.get(key), other.manifest.scenario.get(key)
        if here != there:
            raise BadInput(
                f"{other.path}: cannot be compared with {first.path}: scenario {key} differs "
                f"({_short(there)} against {_short(here)}); compare runs of one scenario"
            )


def _refuse_other_tape(run: RunRecord) -> None:
    """Raise BadInput when a replay was made of a record of another task than its own."""
    folder = Path(run.manifest.target.removeprefix("replay:"))
    if not is_open_loop(run) or not (folder / layout.MANIFEST).is_file():
        return
    recorded = read_manifest(folder).scenario
    for key in ("name", "start", "reference"):
        if recorded.get(key) != run.manifest.scenario.get(key):
            raise BadInput(
                f"{run.path}: is a replay of {folder}, whose scenario {key} is another "
                f"({_short(recorded.get(key))} against {_short(run.manifest.scenario.get(key))}); its "
                "figures are of no task: leave it out"
            )


def labels(runs: Sequence[RunRecord]) -> list[str]:
    """Return a distinct label per run, made of as little as needed: law, inner law, seed, folder."""
    makers: tuple[Callable[[RunRecord], str], ...] = (
        lambda run: run.manifest.outer,
        lambda run: f"{run.manifest.outer} over {run.manifest.inner}",
        lambda run: f"{run.manifest.outer}, seed {run.manifest.seed}",
        lambda run: f"{run.manifest.outer}, {run.path.name}",
    )
    for make in makers:
        names = [make(run) for run in runs]
        if len(set(names)) == len(names):
            return names
    return [f"{run.manifest.outer}, run {index + 1}" for index, run in enumerate(runs)]


def _warnings(entries: Sequence[Entry]) -> list[str]:
    """Return one line for each condition in which the runs differ, and each flaw of a record."""
    lines = [f"{entry.label}: {text}" for entry in entries for text in _flaws(entry)]
    first = entries[0].run.manifest
    for entry in entries[1:]:
        other = entry.run.manifest
        for key in ("seed", "target", "camera", "inner", "git_revision"):
            here, there = getattr(first, key), getattr(other, key)
            if here != there:
                name = key.replace("_", " ")
                lines.append(f"{entry.label}: {name} {there} against {here} ({entries[0].label})")
        gap = tier_gap(entries[0].run, entry.run)
        lines += [f"{entry.label}: {gap}"] if gap else []
        for key, here, there in differences(first.scenario, other.scenario):
            text = f"{key} {_short(there)} against {_short(here)} ({entries[0].label})"
            lines.append(f"{entry.label}: {text}")
    lines += _lengths(entries)
    bases = {entry.figures.basis for entry in entries if entry.run.samples["t_s"].size}
    if len(bases) > 1:
        lines.append("figures rest on the truth in some runs and on the estimate in others")
    return lines


def _lengths(entries: Sequence[Entry]) -> list[str]:
    """Return a line for each run that covers another time than the first one."""
    ends_s = [float(entry.run.samples["t_s"][-1]) if entry.run.samples["t_s"].size else 0.0
              for entry in entries]  # fmt: skip
    first = entries[0].label
    return [
        f"{entry.label}: covers {end_s:.3g} s against {ends_s[0]:.3g} s ({first}): errors, energies and "
        "variations add up over time and cannot be set against each other"
        for entry, end_s in zip(entries[1:], ends_s[1:], strict=True)
        if abs(end_s - ends_s[0]) > _EQUAL_LENGTH * max(end_s, ends_s[0])
    ]


def _flaws(entry: Entry) -> list[str]:
    manifest = entry.run.manifest
    flaws = [*entry.run.problems, *manifest.notes]
    told = _unfinished(manifest.scenario)
    if told and told not in flaws:  # records of before notes were kept
        flaws.append(told)
    if manifest.outcome in {"fault", "interrupted"}:
        detail = f" ({manifest.outcome_detail})" if manifest.outcome_detail else ""
        flaws.append(
            f"the run ended by {manifest.outcome}{detail}: figures cover what there is, and are not "
            "set against those of other runs"
        )
    if is_open_loop(entry.run):
        flaws.append(
            "a replay: the robot went where the record's commands took it (open loop), so its "
            "figures are not set against those of other runs"
        )
    return flaws


def _unfinished(scenario: Mapping[str, Any]) -> str | None:
    """Return that a run of this scenario ends before its waypoints do; None when it does not."""
    if (scenario.get("reference") or {}).get("kind") != "waypoints":
        return None
    try:
        config = WaypointReference.model_validate(scenario["reference"])
        return unfinished(config, float(scenario["duration_s"]))
    except (ValueError, TypeError, KeyError, BadInput):  # not one of ours: nothing is known of it
        return None


def differences(
    here: Mapping[str, Any], there: Mapping[str, Any], prefix: str = ""
) -> list[tuple[str, Any, Any]]:
    """Return (dotted key, value here, value there) for each condition that differs."""
    found: list[tuple[str, Any, Any]] = []
    for key in dict.fromkeys([*here, *there]):
        name = f"{prefix}{key}"
        if name.startswith(_OWN_KEYS) or here.get(key) == there.get(key):
            continue
        one, two = here.get(key), there.get(key)
        if isinstance(one, Mapping) and isinstance(two, Mapping):
            found += differences(one, two, f"{name}.")
        else:
            found.append((name, one, two))
    return found


def _short(value: Any) -> str:
    text = str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def better_of(metric: Metric, values: Sequence[float]) -> int | None:
    """Return the index of the best value; None without a direction, a rival, or a clear gap.

    A settling time that does not exist means "never settled" and loses against any that does.
    """
    ranked = [math.inf if _is_never(metric, value) else value for value in values]
    sign = -1.0 if metric.better == "higher" else 1.0
    order = sorted((sign * value, i) for i, value in enumerate(ranked) if not math.isnan(value))
    if metric.better == "neither" or len(order) < 2 or order[0][0] == order[1][0]:
        return None
    low, high = sorted(abs(ranked[order[k][1]]) for k in (0, 1))
    return order[0][1] if low == 0.0 or high / low >= _EQUAL_RATIO else None


def _is_never(metric: Metric, value: float) -> bool:
    return metric.name.startswith("settling") and math.isnan(value)


def best_entry(comparison: Comparison, metric: Metric) -> int | None:
    """Return the index of the entry that is better than all others in a figure; None without one."""
    places = [place for place, entry in enumerate(comparison.entries) if entry.judged]
    everyone = comparison.values(metric.name)
    best = better_of(metric, [everyone[place] for place in places])
    return None if best is None else places[best]


def findings(comparison: Comparison) -> list[str]:
    """Return plain sentences: who is better in each headline figure, by how much, how sure.

    Runs that ended early and replays are told of in the warnings; nothing is found from them.
    """
    if len(comparison.entries) == 1:
        return ["One run: nothing to compare it with."]
    judged = [entry for entry in comparison.entries if entry.judged]
    if len(judged) < 2:
        return [
            f"{len(judged)} of {len(comparison.entries)} runs came to their end in closed loop, 2 are "
            "needed: nothing can be concluded."
        ]
    if any(not math.isfinite(entry.figures.values["ise_m2_s"]) for entry in judged):
        return ["An error is not finite in at least one run: nothing can be concluded."]
    lines, wins, unknown = [], dict.fromkeys((entry.label for entry in judged), 0), 0
    for name, topic in HEADLINES.items():
        metric = BY_NAME[name]
        values = [entry.figures.values[name] for entry in judged]
        told = ", ".join(
            f"{entry.label} {'never' if _is_never(metric, value) else metric.text(value)}"
            for entry, value in zip(judged, values, strict=True)
        )
        index = better_of(metric, values)
        if sum(math.isfinite(value) or _is_never(metric, value) for value in values) < 2:
            verdict = "not recorded"
            unknown += 1
        elif index is None:
            verdict = "no clear difference"
        else:
            wins[judged[index].label] += 1
            verdict = f"{judged[index].label} is better{_factor(metric, values, index)}"
        lines.append(f"{topic[0].upper()}{topic[1:]} ({metric.label}): {told}; {verdict}.")
    score = ", ".join(f"{label} in {count}" for label, count in wins.items())
    equal = len(HEADLINES) - unknown - sum(wins.values())
    missing = f", not recorded {unknown}" if unknown else ""
    lines.append(
        f"Better of {len(HEADLINES)} headline figures: {score}, no clear difference in {equal}"
        f"{missing}. {_certainty(comparison)}"
    )
    return lines


def _certainty(comparison: Comparison) -> str:
    laws = [entry.run.manifest.outer for entry in comparison.entries]
    if len(set(laws)) == len(laws):
        return (
            "One run each, so these differences carry no interval: repeats are needed to be sure."
        )
    return "Runs of one law are listed apart, not averaged; the differences carry no interval."


def _factor(metric: Metric, values: Sequence[float], index: int) -> str:
    """Return " by a factor of ..." between the best value and the next one."""
    rivals = [v for i, v in enumerate(values) if i != index and math.isfinite(v)]
    if not rivals:
        return ""
    best = values[index]
    nearest = min(rivals) if metric.better == "lower" else max(rivals)
    low, high = sorted((best, nearest))
    return f" by a factor of {high / low:.2g}" if low > 0 else ""


def to_json(comparison: Comparison) -> dict[str, Any]:
    """Return the comparison as one JSON document."""
    return {
        "scenario": comparison.scenario_name,
        "warnings": list(comparison.warnings),
        "findings": findings(comparison),
        "requirements_hold": comparison.holds,
        "runs": [
            {
                "label": entry.label,
                "path": str(entry.run.path),
                "outer": entry.run.manifest.outer,
                "inner": entry.run.manifest.inner,
                "seed": entry.run.manifest.seed,
                "outcome": entry.run.manifest.outcome,
                **entry.figures.to_json(),
                "requirements": [verdict.to_json() for verdict in entry.verdicts],
            }
            for entry in comparison.entries
        ],
    }


def text_table(comparison: Comparison) -> Table:
    """Return the figures side by side for a terminal, the better value of each row in bold."""
    from rich.table import Table  # noqa: PLC0415 - terminals only; the report does without

    basis = " and ".join(sorted({entry.figures.basis for entry in comparison.entries}))
    table = Table(
        title=f"{shown_cell(comparison.scenario_name)}, errors from the {basis}",
        title_justify="left",
    )
    table.add_column("figure")
    for entry in comparison.entries:
        table.add_column(shown_cell(entry.label), justify="right")
    table.add_column("unit")
    for metric in comparison.metrics:
        values = comparison.values(metric.name)
        best = best_entry(comparison, metric)
        cells = [metric.text(value, with_unit=False) for value in values]
        if best is not None:
            cells[best] = f"[bold green]{cells[best]}[/]"
        table.add_row(shown_cell(metric.label), *cells, shown_cell(metric.shown_unit))
    table.add_section()
    marks = ["[green]pass[/]" if entry.holds else "[red]fail[/]" for entry in comparison.entries]
    table.add_row("requirements", *marks, "")
    return table


def shown_cell(text: str) -> str:
    """Return a text of others for a cell of a terminal's table: shown as it was typed."""
    from rich.markup import escape  # noqa: PLC0415 - terminals only

    return escape(visible(text))
