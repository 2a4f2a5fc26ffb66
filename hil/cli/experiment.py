"""`hil experiment`: every scenario of a deck with every law of it, and one report."""

from __future__ import annotations

from pathlib import Path

import click

from hil.cli.compare import print_tables
from hil.cli.options import (
    camera_option,
    inner_option,
    json_option,
    out_option,
    print_json,
    seed_option,
    set_option,
    target_option,
)
from hil.cli.progress import run_progress


@click.command("experiment")
@click.argument("deck", default="thesis")
@target_option
@inner_option
@camera_option
@click.option("--repeats", type=click.IntRange(1, 10_000), default=1, show_default=True,
              help="Runs of each scenario and law, with seeds counting up from --seed.")  # fmt: skip
@seed_option
@set_option
@out_option
@json_option
def command(
    deck: str,
    target: str,
    inner: str,
    camera: str | None,
    repeats: int,
    seed: int,
    overrides: tuple[str, ...],
    out: Path | None,
    as_json: bool,
) -> int:
    """Run every scenario of DECK with both laws and write one report.

    DECK is the built-in deck `thesis` (the three experiments) or a TOML file with `scenarios` and
    `laws`. Both laws of a scenario get the same seed: the same noise, delays and losses.
    """
    from hil.config.deck import load_deck
    from hil.experiment import (
        Conditions,
        circle_study,
        compare_by_scenario,
        deck_specs,
        run_all,
        run_name,
    )
    from hil.record.manifest import command_line
    from hil.record.reader import read_run
    from hil.report.compare import to_json
    from hil.report.html import write_report
    from hil.run import exit_status, new_folder

    conditions = Conditions(target, camera, inner, seed, repeats, overrides, command_line())
    folder = out or new_folder("experiment")
    specs = deck_specs(load_deck(deck), conditions, folder)
    with run_progress({run_name(spec): spec.scenario.duration_s for spec in specs}) as update:
        paths = run_all(specs, update)
    records = [read_run(path) for path in paths]
    report = folder / "report.html"
    comparisons = compare_by_scenario(records)
    write_report(report, comparisons, command=conditions.command, circle=circle_study())
    if as_json:
        print_json({"report": str(report), "comparisons": [to_json(item) for item in comparisons]})
    else:
        print_tables(comparisons)
        click.echo(f"report: {report}")
    return max(exit_status(record) for record in records)
