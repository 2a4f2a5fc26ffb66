"""`hil experiment`: every scenario of a deck with every law of it, and one report."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hil.cli.ci import junit_file, junit_option, tell_ci
from hil.cli.compare import print_study
from hil.cli.options import (
    INNER_LAWS,
    camera_option,
    figure_option,
    figures_option,
    json_option,
    out_option,
    outers_option,
    print_json,
    seed_option,
    set_option,
    target_option,
    warn_unfinished,
    with_figures,
)
from hil.cli.progress import run_progress
from hil.core.text import visible

if TYPE_CHECKING:
    from hil.record.reader import RunRecord
    from hil.runs.spec import RunSpec
    from hil.study.experiment import Study
    from hil.study.until import Until

UNTIL_MOST = 1000


@click.command("experiment")
@click.argument("deck", default="thesis")
@target_option
@outers_option
@click.option("--inner", type=click.Choice([*INNER_LAWS.choices, "both"]), default="asg-ism",
              show_default=True, help="Wheel law, on the board; both gives the 2 x 2 matrix.")  # fmt: skip
@camera_option
@click.option("--repeats", type=click.IntRange(1, 10_000), default=1, show_default=True,
              help="Runs of each scenario and law, with seeds counting up from --seed.")  # fmt: skip
@click.option("--until-interval", type=click.FloatRange(min=0.0, min_open=True), metavar="X",
              help="Repeat until half the 95 % interval of each paired difference is at most X, in the "
              "unit of --until-figure; --repeats is then the most. [default most: 1000]")  # fmt: skip
@click.option("--until-figure", default="iae_m_s", show_default=True, metavar="FIGURE",
              help="The figure that --until-interval looks at.")  # fmt: skip
@seed_option
@set_option
@figure_option
@out_option
@figures_option
@junit_option
@json_option
def command(
    deck: str,
    target: str,
    outers: tuple[str, ...],
    inner: str,
    camera: str | None,
    repeats: int,
    until_interval: float | None,
    until_figure: str,
    seed: int,
    overrides: tuple[str, ...],
    own_figures: tuple[str, ...],
    out: Path | None,
    figures: Path | None,
    junit: Path | None,
    as_json: bool,
) -> int:
    """Run every scenario of DECK with every law and write one report.

    DECK is the built-in deck `thesis` (the three experiments) or a TOML file with `scenarios` and
    `laws`; --outer puts other laws in their place. All laws of a scenario get the same seeds: the
    same noise, delays and losses. With --repeats the report gives paired differences with 95 % intervals.

    The same command with the same --out takes an interrupted experiment up where it stopped; a run
    that was cut off, or whose record is damaged, is moved to set-aside/ and done anew.
    """
    from hil.config.deck import load_deck
    from hil.record.manifest import command_line
    from hil.runs.execute import exit_status, new_folder
    from hil.study.experiment import REPORT, Conditions, deck_specs, study_by_scenario, writing
    from hil.study.until import Until

    overrides = with_figures(overrides, own_figures)
    until = None if until_interval is None else Until.of(until_figure, until_interval, target)
    most = repeats if until is None or repeats > 1 else UNTIL_MOST
    conditions = Conditions(target, camera, inner, seed, most, overrides, command_line())
    folder = out or new_folder("experiment")
    specs = deck_specs(load_deck(deck, outers), conditions, folder)
    warn_unfinished({spec.scenario.name: spec.scenario for spec in specs}.values())
    with junit_file(junit, f"experiment.{deck}"), writing(folder):
        parts = [specs] if until is None else until.parts(specs, seed, most)
        records = _records(parts, folder, until)
    report = folder / REPORT
    studies = study_by_scenario(records)
    _write(report, studies, conditions.command, figures)
    tell_ci(records, f"hil experiment {deck}", junit=junit, report=report)
    if as_json:
        print_json({"report": str(report), "comparisons": [item.to_json() for item in studies]})
    else:
        for item in studies:
            print_study(item)
        click.echo(f"report: {visible(str(report))}")
    return max(exit_status(record) for record in records)


def _records(
    parts: Iterable[Sequence[RunSpec]], folder: Path, until: Until | None
) -> list[RunRecord]:
    """Make the runs of one part after the other until `until` is reached; return all records."""
    from hil.record.reader import read_run
    from hil.study.experiment import claim
    from hil.study.side_by_side import run_all, run_name

    records: list[RunRecord] = []
    for wanted in parts:
        todo = claim(folder, wanted, _say)
        if len(todo) < len(wanted):
            _say(f"{len(wanted) - len(todo)} of {len(wanted)} runs are there already")
        with run_progress({run_name(spec): spec.scenario.duration_s for spec in todo}) as update:
            run_all(todo, update)
        records = [read_run(spec.out) for spec in wanted]
        if until is not None and until.reached(records, _say):
            break
    return records


def _write(report: Path, studies: Sequence[Study], command_text: str, figures: Path | None) -> None:
    """Write the report, and its figures where they are wanted."""
    from hil.report.html import write_report
    from hil.report.paper import figures_kept
    from hil.study.experiment import circle_study

    with figures_kept(figures):
        write_report(
            report,
            [item.comparison for item in studies],
            command=command_text,
            circle=circle_study(),
            repeats=[item.repeats for item in studies if item.repeats],
        )


def _say(text: str) -> None:
    click.echo(visible(text), err=True)
