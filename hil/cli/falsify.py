"""`hil falsify`: the run that most violates a requirement, within a box."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hil.cli.options import (
    INNER_LAWS,
    json_option,
    outer_option,
    plain_console,
    print_json,
    seed_option,
    set_option,
)
from hil.core.text import visible

if TYPE_CHECKING:
    from hil.study.falsify.box import Box
    from hil.study.falsify.search import Found, Trial


@click.command("falsify")
@click.argument("scenario")
@outer_option
@click.option("--against", metavar="LAW",
              help="Look for where the first law fails and this one does not.")  # fmt: skip
@click.option("--box", "box_name", default="default", show_default=True, metavar="FILE",
              help="What may be changed, and between which bounds.")  # fmt: skip
@click.option("--runs", type=click.IntRange(11, 1_000_000), default=201, show_default=True,
              help="Runs of the search; the reduction takes some tens more.")  # fmt: skip
@click.option("--search-seed", type=click.IntRange(1, 2**31 - 1), default=1, show_default=True,
              help="Draws the points that are tried.")  # fmt: skip
@click.option("--inner", type=INNER_LAWS, default="asg-ism", show_default=True,
              help="Wheel law, on the board.")  # fmt: skip
@seed_option
@set_option
@click.option("--keep", type=click.Path(path_type=Path, file_okay=False), metavar="DIR",
              default=Path("counterexamples"), show_default=True,
              help="Folder of counterexamples: scenario files, and a deck that runs them.")  # fmt: skip
@click.option("--workers", type=click.IntRange(1, 1024),
              help="Processes on this machine; the result is the same. [default: one a core]")  # fmt: skip
@json_option
def command(
    scenario: str,
    outer: str | None,
    against: str | None,
    box_name: str,
    runs: int,
    search_seed: int,
    inner: str,
    seed: int,
    overrides: tuple[str, ...],
    keep: Path,
    workers: int | None,
    as_json: bool,
) -> int:
    """Search a box around SCENARIO for the run that most violates one of its requirements.

    The objective is the signed margin of the requirement that is met worst (CMA-ES). What is found is
    reduced to the fewest and smallest departures that still violate it, and kept as a scenario file
    that `hil run` replays and a deck that `hil experiment` runs later. Exit status 1 when there is a
    counterexample, 0 when the search found none.
    """
    from hil.config.load import load_scenario
    from hil.core.errors import BadInput
    from hil.core.registries import OUTER_LAWS
    from hil.study.campaign.workers import Pool
    from hil.study.falsify.box import load_box
    from hil.study.falsify.keep import Asked, add_to_deck, claim_folder, write_scenario
    from hil.study.falsify.margin import OneRun
    from hil.study.falsify.search import falsify

    task = load_scenario(scenario, overrides)
    law = OUTER_LAWS.get(outer or task.control.outer).name
    other = OUTER_LAWS.get(against).name if against else None
    if law == other:
        raise BadInput(f"--against {against}: is the law itself; name another")
    if not task.requirements:
        raise BadInput(f"{scenario}: has no [[requirements]], so nothing can be violated; add one")
    box = load_box(box_name, task)
    with Pool(OneRun(inner), workers or os.cpu_count() or 1) as pool:
        found = falsify(box, _run(pool, box, law, other, seed), runs=runs, seed=search_seed)
    file = deck = None
    if found.reduced is not None:
        claim_folder(keep)
        asked = Asked(law, seed, inner, other)
        file = write_scenario(keep, scenario, box, found.reduced, asked)
        deck = add_to_deck(keep, file, asked)
    if as_json:
        print_json(_document(box, found, law, other, seed, file, deck))
    else:
        _print(box, found, law, other, file, deck)
    return 0 if found.reduced is None else 1


def _run(pool: Any, box: Box, law: str, other: str | None, seed: int) -> Any:
    """Return what runs the points of a box, with both laws where there are two."""
    from hil.core.errors import BadInput
    from hil.study.falsify.margin import FURTHEST, Outcome
    from hil.study.falsify.search import Trial

    laws = [law] if other is None else [law, other]

    def run(points: Sequence[tuple[float, ...]]) -> list[Trial]:
        jobs, places = [], []
        outcomes: dict[tuple[int, str], Outcome] = {}
        for place, point in enumerate(points):
            try:
                scenario = box.at(point)
            except BadInput as error:
                for name in laws:
                    outcomes[place, name] = Outcome(FURTHEST, str(error), refused=True)
                continue
            jobs += [(scenario, name, seed) for name in laws]
            places += [(place, name) for name in laws]
        found = pool.map(jobs, lambda *_: None) if jobs else []
        outcomes |= dict(zip(places, found, strict=True))
        return [
            Trial(tuple(point), outcomes[i, law], outcomes[i, other] if other else None)
            for i, point in enumerate(points)
        ]

    return run


def _document(
    box: Box,
    found: Found,
    law: str,
    other: str | None,
    seed: int,
    file: Path | None,
    deck: Path | None,
) -> dict[str, Any]:
    def told(trial: Trial) -> dict[str, Any]:
        return {
            "margin": trial.outcome.margin,
            "requirement": trial.outcome.why,
            "against_margin": None if trial.against is None else trial.against.margin,
            "departures": box.departures(trial.point),
        }

    return {
        "scenario": box.scenario.name,
        "law": law,
        "against": other,
        "seed": seed,
        "runs": found.runs,
        "refused": found.refused,
        "axes": [
            {"key": axis.key, "low": axis.low, "high": axis.high, "usual": axis.usual}
            for axis in box.axes
        ],
        "found": found.reduced is not None,
        "usual": told(found.usual),
        "worst": told(found.worst),
        "counterexample": None if found.reduced is None else told(found.reduced),
        "file": None if file is None else str(file),
        "deck": None if deck is None else str(deck),
    }


def _print(
    box: Box, found: Found, law: str, other: str | None, file: Path | None, deck: Path | None
) -> None:
    console = plain_console()
    console.print(
        f"{box.scenario.name}, {law}: margin {found.usual.outcome.margin:+.3f} as it stands"
    )
    worst = found.worst.outcome
    console.print(f"worst of {found.runs} runs: margin {worst.margin:+.3f} ({worst.why})")
    if found.reduced is None:
        said = "no run violates a requirement" if other is None else f"none that {other} meets"
        console.print(f"no counterexample: {said}; more --runs or a wider --box search further")
        return
    console.print(
        f"reduced to margin {found.reduced.outcome.margin:+.3f} ({found.reduced.outcome.why}):"
    )
    axes = {axis.key: axis for axis in box.axes}
    for key, value in box.departures(found.reduced.point).items():
        console.print(f"  {key} = {value:g} (usual {axes[key].usual:g})")
    click.echo(f"scenario: {visible(str(file))}; deck: {visible(str(deck))}")
