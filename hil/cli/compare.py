"""`hil compare`: recorded runs side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hil.cli.options import json_option, print_json

if TYPE_CHECKING:
    from hil.report.compare import Comparison


@click.command("compare")
@click.argument("runs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RUN...")
@click.option("--report", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE.html",
              help="Write an HTML report that opens without a network.")  # fmt: skip
@json_option
def command(runs: tuple[Path, ...], report: Path | None, as_json: bool) -> None:
    """Compare two or more run records of one scenario."""
    from hil.record.manifest import command_line
    from hil.record.reader import read_run
    from hil.report.compare import compare_runs, to_json

    comparison = compare_runs([read_run(run) for run in runs])
    if report is not None:
        from hil.report.html import write_report

        write_report(report, [comparison], command=command_line())
    if as_json:
        print_json(to_json(comparison))
        return
    print_tables([comparison])
    if report is not None:
        click.echo(f"report: {report}")


def print_tables(comparisons: Sequence[Comparison]) -> None:
    """Write a table per scenario, its warnings and its findings to stdout."""
    from rich.console import Console

    from hil.report.compare import findings, text_table

    console = Console(highlight=False)
    for comparison in comparisons:
        console.print(text_table(comparison))
        for line in comparison.warnings:
            console.print(f"[yellow]note:[/yellow] {line}")
        for line in findings(comparison):
            console.print(f"- {line}")
        console.print()
