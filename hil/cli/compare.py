"""`hil compare`: recorded runs side by side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from hil.cli.ci import junit_file, junit_option, tell_ci
from hil.cli.options import (
    OutFile,
    different_files,
    figure_option,
    figures_option,
    json_option,
    print_json,
)
from hil.core.text import visible

if TYPE_CHECKING:
    from hil.study.experiment import Study


@click.command("compare")
@click.argument("runs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RUN...")
@click.option("--report", type=OutFile(), metavar="FILE.html",
              help="Write an HTML report that opens without a network.")  # fmt: skip
@click.option("--csv", "csv_file", type=OutFile(),
              metavar="FILE.csv", help="Write every run's figures as CSV.")  # fmt: skip
@click.option("--rerun", type=OutFile(), metavar="FILE.rrd",
              help="Write all runs as one recording for the viewer, on a common timeline.")  # fmt: skip
@figure_option
@figures_option
@junit_option
@json_option
def command(
    runs: tuple[Path, ...],
    report: Path | None,
    csv_file: Path | None,
    rerun: Path | None,
    own_figures: tuple[str, ...],
    figures: Path | None,
    junit: Path | None,
    as_json: bool,
) -> int:
    """Compare two or more run records of one scenario.

    Runs of two or more seeds per law, the same ones for each, are also compared as repeats: paired
    by seed, with 95 % intervals. A --figure is computed from the records, whenever they were made.
    """
    from hil.core.figures import metric_of
    from hil.record.manifest import command_line
    from hil.record.reader import read_run
    from hil.report.csv_table import write_csv
    from hil.report.html import render, write_report
    from hil.report.paper import figures_kept
    from hil.runs.execute import judged_status
    from hil.study.experiment import study

    different_files(report=report, csv=csv_file, rerun=rerun, junit=junit)
    with junit_file(junit, "compare"):
        more = [metric_of(name) for name in own_figures]
        records = [read_run(run).with_own_figures(more) for run in runs]
    found = study(records)
    repeats = [found.repeats] if found.repeats else []
    with figures_kept(figures):
        if report is not None:
            write_report(report, [found.comparison], command=command_line(), repeats=repeats)
        elif figures is not None:
            render([found.comparison], command=command_line(), repeats=repeats)
    if csv_file is not None:
        write_csv(csv_file, records)
    if rerun is not None:
        from hil.record.rrd import write_rrd

        write_rrd(rerun, records)
    tell_ci(records, "hil compare", junit=junit, report=report)
    if as_json:
        print_json(found.to_json())
        return judged_status(records)
    print_study(found)
    for name, path in (
        ("report", report),
        ("csv", csv_file),
        ("rerun", rerun),
        ("figures", figures),
    ):
        if path is not None:
            click.echo(f"{name}: {visible(str(path))}")
    return judged_status(records)


def print_study(study: Study) -> None:
    """Write the table of a scenario, its warnings and findings, and its statistics to stdout."""
    from rich.console import Console
    from rich.markup import escape

    from hil.core.figures import BY_NAME
    from hil.report.compare import HEADLINES, findings, text_table
    from hil.report.repeats import text_tables

    console = Console(highlight=False)
    comparison, repeats = study.comparison, study.repeats
    console.print(text_table(comparison))
    for line in comparison.warnings:
        console.print(f"[yellow]note:[/yellow] {escape(visible(line))}")
    if repeats is None:
        for line in findings(comparison):
            console.print(f"- {escape(visible(line))}")
    else:
        console.print(f"Above: seed {repeats.seeds[0]} alone. All {len(repeats.seeds)} seeds:")
        for arm, count in repeats.complete.items():
            console.print(
                f"- {escape(visible(arm))}: {count} of {len(repeats.seeds)} runs met every requirement"
            )
        for line in repeats.warnings:
            console.print(f"[yellow]note:[/yellow] {escape(visible(line))}")
        own = [metric.name for metric in repeats.metrics if metric.name not in BY_NAME]
        for table in text_tables(repeats, [*HEADLINES, *own]):
            console.print(table)
    console.print()
