"""`hil experiment`: every scenario of a deck with every law of it, and one report."""

from __future__ import annotations

from pathlib import Path

import click

from hil.cli.options import (
    camera_option,
    inner_option,
    json_option,
    out_option,
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
    camera: str,
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
    from hil.experiment import Conditions, deck_specs, run_all, run_name
    from hil.record.manifest import command_line
    from hil.record.reader import read_run
    from hil.run import exit_status, new_folder

    conditions = Conditions(target, camera, inner, seed, repeats, overrides, command_line())
    folder = out or new_folder("experiment")
    specs = deck_specs(load_deck(deck), conditions, folder)
    with run_progress({run_name(spec): spec.scenario.duration_s for spec in specs}) as update:
        paths = run_all(specs, update)
    records = [read_run(path) for path in paths]
    return max(exit_status(record) for record in records)
