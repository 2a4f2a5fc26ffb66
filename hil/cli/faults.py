"""`hil faults`: every fault at every instant with both laws on the twin, and a page of it."""

from __future__ import annotations

from pathlib import Path

import click

from hil.cli.options import json_option, plain_console, print_json, seed_option
from hil.cli.progress import job_progress


@click.command("faults")
@click.option("--fault", "faults", multiple=True, metavar="NAME", help="Only this row; repeatable.")
@click.option("--at", "instants", multiple=True, metavar="INSTANT",
              help="Only this instant; repeatable.")  # fmt: skip
@click.option("--outer", "laws", multiple=True, metavar="LAW", help="Only this law; repeatable.")
@click.option("--fault-free", type=click.IntRange(0, 100_000), default=0, show_default=True,
              help="Also so many runs without a fault: how many are stopped or diagnosed.")  # fmt: skip
@seed_option
@click.option("--out", type=click.Path(path_type=Path), default=Path("runs/faults"),
              show_default=True, metavar="DIR",
              help="Folder of the page; the same command goes on where it was stopped.")  # fmt: skip
@json_option
def command(
    faults: tuple[str, ...],
    instants: tuple[str, ...],
    laws: tuple[str, ...],
    fault_free: int,
    seed: int,
    out: Path,
    as_json: bool,
) -> int:
    """Break everything once: each fault x instant x law, on the twin.

    A cell is met when the robot is stopped in time or recovers, its speed and travel stay bounded, the
    fault is told by its name, and the record (at speed) replays bit for bit. Exit status 1 when one is
    not, or more than one in 1,000 runs without a fault was stopped or diagnosed.
    """
    from hil.core.errors import BadInput
    from hil.core.files import replace_file
    from hil.report.fault_page import fault_page
    from hil.study.fault_campaign import run_fault_free, run_matrix
    from hil.study.fault_kinds import INSTANTS, ROWS
    from hil.study.fault_matrix import LAWS, cells

    for option, given, known in (
        ("--fault", faults, [row.name for row in ROWS]),
        ("--at", instants, list(INSTANTS)),
        ("--outer", laws, list(LAWS)),
    ):
        for name in given:
            if name not in known:
                raise BadInput(f"{option} {name!r}: no such one; there are: {', '.join(known)}")
    with job_progress("faults") as update:
        done = run_matrix(cells(faults, instants, laws), seed, out, update)
    free = None
    if fault_free:
        with job_progress("without a fault") as update:
            free = run_fault_free(fault_free, seed, out, update)
    page = out / "faults.html"
    replace_file(page, fault_page(done, free).encode())
    bad = [cell for cell in done if not cell["met"]]
    met = not bad and (free is None or free["met"])
    tree = {"met": met, "cells": done, "fault_free": free, "page": str(page)}
    if as_json:
        print_json(tree)
    else:
        console = plain_console()
        for cell in bad:
            where = f"{cell['fault']}, {cell['instant']}, {cell['law']}"
            console.print(f"NOT MET  {where}: {'; '.join(cell['flaws'])}")
        if free:
            for text in free["said"]:
                console.print(f"ALARM    {text}")
            console.print(
                f"{free['alarms']} alarms in {free['runs']} runs without a fault: with 95 % confidence "
                f"below 1 in {1.0 / free['most_ratio']:.0f}"
            )
        console.print(f"{len(done) - len(bad)} of {len(done)} cells are met; page: {page}")
    return 0 if met else 1
