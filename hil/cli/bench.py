"""`hil bench`: the speed figures of the harness on this machine."""

from __future__ import annotations

import click

from hil.cli.options import json_option, print_json


@click.command("bench")
@click.option("--runs", type=click.IntRange(1, 100), default=5, show_default=True,
              help="Counted runs of each figure, after one that is not counted.")  # fmt: skip
@json_option
def command(runs: int, as_json: bool) -> None:
    """Measure the speed of the harness: medians of several runs, with least and largest."""
    from hil import bench

    found = bench.figures(runs)
    if as_json:
        print_json(bench.as_document(found))
        return
    from rich.console import Console
    from rich.table import Table

    table = Table("figure", "median", "least", "largest", "unit", "goal")
    for figure in found:
        values = (f"{value:.3g}" for value in (figure.median, figure.least, figure.largest))
        table.add_row(figure.name, *values, figure.unit, figure.goal)
    Console().print(table)
