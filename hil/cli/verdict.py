"""`hil verdict`: all laws on tasks that no search has seen, from one command."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hil.cli.options import OutFile, json_option, outers_option, plain_console, print_json
from hil.core.text import visible

if TYPE_CHECKING:
    from hil.study.suite import Figures, Job, Make


@click.command("verdict")
@click.argument("deck", default="suite")
@outers_option
@click.option("--short", is_flag=True, help="A small budget, for CI: minutes, and little evidence.")
@click.option("--candidates", type=click.IntRange(4, 100_000),
              help="Candidates of each law and search seed. [default: 72; short: 8]")  # fmt: skip
@click.option("--search-cells", type=click.IntRange(1, 1000),
              help="Cells each candidate runs. [default: 5; short: 2]")  # fmt: skip
@click.option("--search-seed", "search_seeds", type=click.IntRange(1, 2**31 - 1), multiple=True,
              help="Seed of the search itself; may be repeated. [default: 1 2 3; short: 1 2]")  # fmt: skip
@click.option("--points", type=click.IntRange(2, 50),
              help="Candidates of each front that are judged. [default: 4; short: 2]")  # fmt: skip
@click.option("--unseen-cells", type=click.IntRange(2, 1000),
              help="Unseen cells they are judged in. [default: 30; short: 5]")  # fmt: skip
@click.option("--repeats", type=click.IntRange(1, 1000), help="Runs of each. [default: 1]")
@click.option("--ablation-cells", type=click.IntRange(2, 1000),
              help="Unseen cells of the ablation. [default: 30; short: 3]")  # fmt: skip
@click.option("--ablation/--no-ablation", "ablated", default=True, help="Switch parts off in turn.")
@click.option("--workers", type=click.IntRange(1, 1024),
              help="Processes on this machine; the result is the same. [default: one a core]")  # fmt: skip
@click.option("--out", type=OutFile(), metavar="FILE",
              help="Where the data go. [default: verdict.json in a new folder of runs/]")  # fmt: skip
@click.option("--kept", metavar="FILE",
              help="No run: what the data of an earlier verdict say; shipped: those of README.")  # fmt: skip
@click.option("--task", metavar="FILE",
              help="No search: kept fronts (--kept, else shipped) on a task of your own.")  # fmt: skip
@json_option
def command(
    deck: str,
    outers: tuple[str, ...],
    short: bool,
    kept: str | None,
    task: str | None,
    out: Path | None,
    workers: int | None,
    ablated: bool,
    as_json: bool,
    **asked: Any,
) -> None:
    """Search, judge and compare all laws on DECK; write data, report and the README's table.

    Searches see one half of the deck's tasks and conditions, the verdict is spoken on the other half
    (docs/verdict.md). Every law gets the same budget. Laws are compared at equal calm: how accurate
    each is at the same variation of commands and PWM. With several seeds of the search, a difference
    that one of them does not show is no difference shown. With --outer PID is judged beside the laws named.

    The data are written after each seed of the search, so that an early end leaves those.

    With --task the points of the fronts are run on a scenario of your own, and it is said whether it ranks
    the laws as the verdict does.
    """
    from hil.core.errors import BadInput
    from hil.core.files import replace_file
    from hil.record.manifest import command_line, git_revision
    from hil.runs.execute import new_folder
    from hil.study import verdict_page
    from hil.study.campaign.workers import Pool
    from hil.study.front_search import require_optuna
    from hil.study.parts_off import parts_of
    from hil.study.suite import OnSuite
    from hil.study.verdict import SHORT, Field, VerdictPlan, verdict_data

    if task is not None:
        _own_task(task, deck, outers, _read(kept or "shipped"), workers, as_json)
        return
    if kept is not None:
        _say_all(_read(kept), as_json, None)
        return
    if out is not None and out.exists():
        raise BadInput(f"--out {out}: exists already; name a new file")
    plan = SHORT if short else VerdictPlan()
    names = {"points": "picked"}
    given = {names.get(key, key): value for key, value in asked.items() if value}
    plan = replace(plan, **given)
    field = Field.of(deck, plan, outers)
    require_optuna()
    file = out or new_folder("verdict") / "verdict.json"
    file.parent.mkdir(parents=True, exist_ok=True)
    data: dict[str, Any] = {}
    with Pool(OnSuite(field.scenarios), workers or os.cpu_count() or 1) as pool:
        for data in verdict_data(
            field,
            plan,
            _make(pool),
            revision=git_revision(),
            command=command_line(),
            say=lambda text: click.echo(text, err=True),
            parts=parts_of if ablated else lambda _law: (),
        ):
            replace_file(file, json.dumps(data, indent=1, ensure_ascii=False).encode() + b"\n")
    verdict_page.write(file.with_suffix(".html"), data)
    _say_all(data, as_json, file)


def _own_task(
    file: str,
    deck: str,
    laws: Sequence[str],
    data: dict[str, Any],
    workers: int | None,
    as_json: bool,
) -> None:
    """Run the kept fronts on a task of one's own and say how it ranks the laws."""
    from hil.config.deck import load_deck
    from hil.study import own_task
    from hil.study import verdict_words as words
    from hil.study.campaign.workers import Pool
    from hil.study.suite import OnSuite

    data = own_task.only_laws(data, laws)
    task = own_task.OwnTask.of(file, load_deck(deck), data)
    with Pool(OnSuite(task.scenarios), workers or os.cpu_count() or 1) as pool:
        told = own_task.judged_on(task, data, _make(pool))
    found = own_task.Agreement.of(told, data)
    if as_json:
        print_json(found.to_json() | {"data": told})
        return
    console = plain_console()
    console.print(
        f"at a calm of {words.MAIN_LEVEL:g}, in {len(task.cells)} conditions no search has seen:"
    )
    for law, score in found.own.items():
        console.print(f"  {law}: accuracy {score:.2f} (verdict {found.verdict[law]:.2f})")
    console.print(found.text())


def _make(pool: Any) -> Make:
    """Return what makes runs side by side."""

    def make(jobs: Sequence[Job]) -> Sequence[Figures]:
        found: Sequence[Figures] = pool.map(jobs, lambda _place, _figures: None)
        return found

    return make


def _read(name: str) -> dict[str, Any]:
    from hil.core.errors import BadInput
    from hil.study.verdict import FORMAT, shipped_text

    try:
        text = shipped_text() if name == "shipped" else Path(name).read_text(encoding="utf-8")
        data: dict[str, Any] = json.loads(text)
        known = data["format"] == FORMAT
    except (OSError, ValueError, KeyError, TypeError):
        known = False
    if not known:
        raise BadInput(
            f"--kept {name}: is no data of `hil verdict`; give the verdict.json that it wrote"
        )
    return data


def _say_all(data: dict[str, Any], as_json: bool, file: Path | None) -> None:
    from hil.study import verdict_words as words

    if as_json:
        print_json({"file": None if file is None else str(file), "data": data, "says": _says(data)})
        return
    console = plain_console()
    console.print(words.first_line(data))
    for line in words.readme_table(data):
        console.print(line)
    others = words.other_rankings(data)
    if others:
        console.print(f"another law is first on: {', '.join(others)}")
    if data["ablation"]:
        for line in words.ablation_table(data):
            console.print(line)
    if file is not None:
        click.echo(f"data: {visible(str(file))}; report: {visible(str(file.with_suffix('.html')))}")


def _says(data: dict[str, Any]) -> dict[str, Any]:
    from hil.study import verdict_words as words

    return {
        "first_line": words.first_line(data),
        "at_equal_calm": [
            {"law": row.law, "calm": row.level, "stands": row.stands, "text": row.text()}
            for row in words.table_of(data)
        ],
        "other_first_place": words.other_rankings(data),
    }
