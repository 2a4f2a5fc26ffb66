"""`hil experiment`: every scenario of a deck with every law of it, and one report."""

from __future__ import annotations

from pathlib import Path

import click

from hil.cli.compare import print_study
from hil.cli.options import (
    INNER_LAWS,
    camera_option,
    figures_option,
    json_option,
    out_option,
    print_json,
    seed_option,
    set_option,
    target_option,
    warn_unfinished,
)
from hil.cli.progress import run_progress
from hil.core.text import visible


@click.command("experiment")
@click.argument("deck", default="thesis")
@target_option
@click.option("--inner", type=click.Choice([*INNER_LAWS.choices, "both"]), default="asg-ism",
              show_default=True, help="Wheel law, on the board; both gives the 2 x 2 matrix.")  # fmt: skip
@camera_option
@click.option("--repeats", type=click.IntRange(1, 10_000), default=1, show_default=True,
              help="Runs of each scenario and law, with seeds counting up from --seed.")  # fmt: skip
@seed_option
@set_option
@out_option
@figures_option
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
    figures: Path | None,
    as_json: bool,
) -> int:
    """Run every scenario of DECK with both laws and write one report.

    DECK is the built-in deck `thesis` (the three experiments) or a TOML file with `scenarios` and
    `laws`. Both laws of a scenario get the same seeds: the same noise, delays and losses. With
    --repeats the report gives paired differences with 95 % intervals.

    The same command with the same --out takes an interrupted experiment up where it stopped; a run
    that was cut off, or whose record is damaged, is moved to set-aside/ and done anew.
    """
    from hil.config.deck import load_deck
    from hil.record.manifest import command_line
    from hil.record.reader import read_run
    from hil.report.html import write_report
    from hil.report.paper import figures_kept
    from hil.runs.execute import exit_status, new_folder
    from hil.study.experiment import (
        REPORT,
        Conditions,
        circle_study,
        claim,
        deck_specs,
        study_by_scenario,
        writing,
    )
    from hil.study.side_by_side import run_all, run_name

    conditions = Conditions(target, camera, inner, seed, repeats, overrides, command_line())
    folder = out or new_folder("experiment")
    specs = deck_specs(load_deck(deck), conditions, folder)
    warn_unfinished({spec.scenario.name: spec.scenario for spec in specs}.values())
    with writing(folder):
        todo = claim(folder, specs, _say)
        if len(todo) < len(specs):
            _say(f"{len(specs) - len(todo)} of {len(specs)} runs are there already")
        with run_progress({run_name(spec): spec.scenario.duration_s for spec in todo}) as update:
            run_all(todo, update)
    records = [read_run(spec.out) for spec in specs]
    report = folder / REPORT
    studies = study_by_scenario(records)
    with figures_kept(figures):
        write_report(
            report,
            [item.comparison for item in studies],
            command=conditions.command,
            circle=circle_study(),
            repeats=[item.repeats for item in studies if item.repeats],
        )
    if as_json:
        print_json({"report": str(report), "comparisons": [item.to_json() for item in studies]})
    else:
        for item in studies:
            print_study(item)
        click.echo(f"report: {visible(str(report))}")
    return max(exit_status(record) for record in records)


def _say(text: str) -> None:
    click.echo(visible(text), err=True)
