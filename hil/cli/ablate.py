"""`hil ablate`: what each part of a law is worth."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hil.cli.options import json_option, outers_option, plain_console, print_json

if TYPE_CHECKING:
    from hil.study.ablation import Worth


@click.command("ablate")
@click.argument("deck", default="suite")
@outers_option
@click.option("--cells", type=click.IntRange(2, 10_000), default=30, show_default=True,
              help="Cells of the deck's unseen half, spread over tasks and conditions.")  # fmt: skip
@click.option("--repeats", type=click.IntRange(1, 1000), default=1, show_default=True,
              help="Runs in each cell.")  # fmt: skip
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=1000, show_default=True,
              help="First seed of the runs.")  # fmt: skip
@click.option("--part", "only", multiple=True, metavar="PART",
              help="Only this part; may be repeated. [default: all of the law's]")  # fmt: skip
@click.option("--gains", type=click.Path(path_type=Path, exists=True, dir_okay=False), metavar="FILE",
              help="A gain set, as `hil tune` writes it. [default: the gains that ship]")  # fmt: skip
@click.option("--workers", type=click.IntRange(1, 1024),
              help="Processes on this machine; the result is the same. [default: one a core]")  # fmt: skip
@json_option
def command(
    deck: str,
    outers: tuple[str, ...],
    cells: int,
    repeats: int,
    seed: int,
    only: tuple[str, ...],
    gains: Path | None,
    workers: int | None,
    as_json: bool,
) -> None:
    """Switch each part of a law off in turn and run both, cell by cell, where no search has been.

    A score is 1 for PID as shipped on the same task, calm; lower is better. A row is the score without
    the part minus the score with it: above 0 the part helps. `*`: the difference stands among all of the
    table's (false discovery rate of 5 %) and its 95 % interval is free of 0. docs/verdict.md.
    """
    from hil.config.deck import load_deck
    from hil.config.gain_file import read_gain_file
    from hil.core.errors import BadInput
    from hil.core.registries import OUTER_LAWS
    from hil.study.ablation import ablate
    from hil.study.campaign.workers import Pool
    from hil.study.parts_off import parts_of
    from hil.study.suite import OnSuite, Yardstick, scenarios_of, spread_over

    laws = [OUTER_LAWS.get(name).name for name in outers or ("asg-ism",)]
    for part in only:
        known = list(dict.fromkeys(one for law in laws for one in parts_of(law)))
        if part not in known:
            raise BadInput(
                f"--part {part}: none of these laws has it; they have {', '.join(known)}"
            )
    chosen = load_deck(deck)
    where = spread_over(chosen.unseen_cells() or chosen.cells(), cells)
    scenarios = scenarios_of(chosen, where)
    given = None if gains is None else read_gain_file(gains, "--gains")
    with Pool(OnSuite(scenarios), workers or os.cpu_count() or 1) as pool:

        def make(jobs: Any) -> Any:
            return pool.map(jobs, lambda _place, _figures: None)

        tasks = list(dict.fromkeys(cell.scenario for cell in where))
        yard = Yardstick.measured(tasks, make)
        rows = ablate(
            dict.fromkeys(laws, given),
            [str(cell) for cell in where],
            range(seed, seed + repeats),
            yard,
            make,
            lambda law: [part for part in parts_of(law) if not only or part in only],
        )
    if as_json:
        names = [str(cell) for cell in where]
        print_json({"deck": deck, "cells": names, "rows": [row.to_json() for row in rows]})
        return
    _print(rows, len(where), repeats)


def _print(rows: list[Worth], cells: int, repeats: int) -> None:
    from rich.table import Table

    from hil.study.ablation import SCORES
    from hil.study.parts_off import MEANING

    table = Table(title=f"score without the part - score with it; {cells} cells x {repeats}")
    for head in ("law", "part", "what is off", *SCORES, "failed"):
        table.add_column(head, justify="right" if head in SCORES else "left")
    for row in rows:
        cells_of = []
        for score in SCORES:
            one = row.differences[score]
            star = " *" if row.found[score] and one.certain else ""
            ends = f"{one.interval.low:+.2f} to {one.interval.high:+.2f}"
            cells_of.append(f"{one.mean:+.3f}{star}\n{ends}")
        table.add_row(row.law, row.part, MEANING.get(row.part, ""), *cells_of, str(row.failed))
    plain_console().print(table)
