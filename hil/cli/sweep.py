"""`hil sweep`: a campaign of many runs over grids, lists and distributions of values."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hil.cli.options import json_option, print_json, warn_unfinished
from hil.core.text import visible

if TYPE_CHECKING:
    from hil.study.campaign.merge import Table
    from hil.study.campaign.plan import Campaign
    from hil.study.campaign.work import Totals


@click.command("sweep")
@click.argument("file")
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR",
              help="Folder for the results; that of the same campaign goes on where it stopped. "
              "[default: a new one in runs/]")  # fmt: skip
@click.option("--workers", type=click.IntRange(1, 1024),
              help="Processes on this machine. [default: one a core]")  # fmt: skip
@click.option("--dask", metavar="ADDRESS", help="Dask scheduler to use instead of own processes.")
@json_option
def command(
    file: str, out: Path | None, workers: int | None, dask: str | None, as_json: bool
) -> int:
    """Run the campaign of FILE (TOML, or built in: limits, layer) and draw what depends on what.

    Every combination of the values in [grid] and [[together]], `draws` draws of [random], `seeds`
    seeds and all laws; runs are kept in memory, one row each goes to results.parquet.

    However a campaign was stopped, the same command with the same --out goes on; a row that was lost
    with a damaged file is made again.

    Exit status: 0 when every run met its requirements, 1 when one did not, 3 when one ended early
    by a fault (outside the fence, robot not seen, board stopped).
    """
    from hil.cli.progress import job_progress
    from hil.record.manifest import command_line
    from hil.runs.execute import new_folder
    from hil.study.campaign.findings import documents, outcomes_of, sentences
    from hil.study.campaign.maps import write_page
    from hil.study.campaign.plan import load_campaign
    from hil.study.campaign.results import PAGE
    from hil.study.campaign.work import run_campaign

    campaign = load_campaign(file)
    warn_unfinished([campaign.scenario(())])
    folder = out or new_folder(f"sweep-{campaign.file.name}")
    with job_progress(campaign.file.name) as update:
        table, totals = run_campaign(campaign, folder, workers, dask, update, _say)
    outcomes = outcomes_of(campaign, table)
    page = folder / PAGE
    document = _document(campaign, totals, table, folder) | {"answers": list(documents(outcomes))}
    notes = [*ending_lines(document["endings"], totals.runs), *program_lines(document["programs"])]
    made = (f"Made by {name}." for name in document["programs"])
    write_page(page, outcomes, command_line(), [*notes, *made])
    if as_json:
        print_json(document)
    else:
        _print(document, notes, sentences(outcomes))
    if {"fault", "error"} & set(document["endings"]):
        return 3
    return int(document["requirements_hold"] < totals.runs)


def _document(campaign: Campaign, totals: Totals, table: Table, folder: Path) -> dict[str, Any]:
    """Return how a campaign went, for `--json`."""
    from hil.study.campaign.results import PAGE, RESULTS, early_ends, programs

    efficiency, ends = totals.efficiency, early_ends(table)
    return {
        "campaign": campaign.file.name,
        "sha256": campaign.digest,
        "results": str(folder / RESULTS),
        "report": str(folder / PAGE),
        "runs": totals.runs,
        "runs_now": totals.runs_now,
        "requirements_hold": int(table.column("holds").to_numpy().sum()),
        "ended_early": sum(end["runs"] for end in ends.values()),
        "wall_s": round(totals.wall_s, 3),
        "workers": totals.workers,
        "parallel_efficiency": round(efficiency, 4) if efficiency is not None else None,
        "endings": ends,
        "programs": programs(table),
    }


def _print(document: dict[str, Any], notes: Sequence[str], found: Sequence[str]) -> None:
    """Write the same for a person."""
    efficiency, runs = document["parallel_efficiency"], document["runs"]
    told = f", {efficiency:.0%} of the workers' time spent on runs" if efficiency else ""
    click.echo(
        f"{runs} runs, {document['runs_now']} of them now in {document['wall_s']:.1f} s{told}"
    )
    held, early = document["requirements_hold"], document["ended_early"]
    click.echo(f"{held} of {runs} runs met every requirement, {early} ended early")
    for line in notes:
        click.echo(f"note: {visible(line)}")
    for line in found:
        click.echo(f"- {visible(line)}")
    click.echo(f"results: {visible(document['results'])}\nreport: {visible(document['report'])}")


def _say(text: str) -> None:
    click.echo(f"note: {visible(text)}", err=True)


def ending_lines(ends: dict[str, dict[str, Any]], runs: int) -> list[str]:
    """Return a line on each way in which runs ended without figures, with its commonest cause."""
    how = {"fault": "ended in a fault", "refused": "were refused", "error": "failed in the program"}
    return [
        f"{end['runs']} of {runs} runs {how.get(outcome, f'ended {outcome}')} "
        f"({'' if end['runs'] == 1 else 'most often: '}{end['commonest_cause']})"
        for outcome, end in ends.items()
    ]


def program_lines(made_by: dict[str, int]) -> list[str]:
    """Return a warning when the rows are not all of one program."""
    if len(made_by) < 2:
        return []
    parts = ", ".join(f"{count} by {name}" for name, count in made_by.items())
    return [f"rows of {len(made_by)} programs are mixed: {parts}; a new --out has one only"]
