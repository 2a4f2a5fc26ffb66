"""`hil sweep`: a campaign of many runs over grids, lists and distributions of values."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from hil.cli.options import json_option, print_json, warn_unfinished
from hil.core.text import visible


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
    from hil.study.campaign.results import PAGE, early_ends, programs
    from hil.study.campaign.work import run_campaign

    campaign = load_campaign(file)
    warn_unfinished([campaign.scenario(())])
    folder = out or new_folder(f"sweep-{campaign.file.name}")
    with job_progress(campaign.file.name) as update:
        table, totals = run_campaign(campaign, folder, workers, dask, update, _say)
    ends, made_by = early_ends(table), programs(table)
    notes = [*ending_lines(ends, totals.runs), *program_lines(made_by)]
    outcomes = outcomes_of(campaign, table)
    page = folder / PAGE
    write_page(page, outcomes, command_line(), [*notes, *(f"Made by {name}." for name in made_by)])
    held = int(table.column("holds").to_numpy().sum())
    early = sum(end["runs"] for end in ends.values())
    status = 3 if {"fault", "error"} & set(ends) else int(held < totals.runs)
    efficiency = totals.efficiency
    document: dict[str, Any] = {
        "campaign": campaign.file.name,
        "sha256": campaign.digest,
        "results": str(folder / "results.parquet"),
        "report": str(page),
        "runs": totals.runs,
        "runs_now": totals.runs_now,
        "requirements_hold": held,
        "ended_early": early,
        "wall_s": round(totals.wall_s, 3),
        "workers": totals.workers,
        "parallel_efficiency": round(efficiency, 4) if efficiency is not None else None,
        "endings": ends,
        "programs": made_by,
        "answers": list(documents(outcomes)),
    }
    if as_json:
        print_json(document)
        return status
    told = f", {efficiency:.0%} of the workers' time spent on runs" if efficiency else ""
    click.echo(f"{totals.runs} runs, {totals.runs_now} of them now in {totals.wall_s:.1f} s{told}")
    click.echo(f"{held} of {totals.runs} runs met every requirement, {early} ended early")
    for line in notes:
        click.echo(f"note: {visible(line)}")
    for line in sentences(outcomes):
        click.echo(f"- {visible(line)}")
    click.echo(f"results: {visible(document['results'])}\nreport: {visible(str(page))}")
    return status


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
