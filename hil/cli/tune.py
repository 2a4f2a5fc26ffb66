"""`hil tune`: the gains of outer laws by one search, one cost and one budget."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hil.cli.options import (
    OutFile,
    figure_option,
    json_option,
    outers_option,
    print_json,
    set_option,
    with_figures,
)
from hil.core.text import visible

if TYPE_CHECKING:
    from rich.table import Table

    from hil.analysis.costs import Figures
    from hil.analysis.stats import Paired
    from hil.cli.progress import Stage
    from hil.config.gains import Gains
    from hil.core.figures import Metric
    from hil.study.tune import Plan, Trial
    from hil.study.tune_work import Journal, Tasks
    from hil.study.tuning_verdict import Verdict


@click.command("tune")
@click.argument("tasks", nargs=-1, metavar="[SCENARIO...]")
@click.option("--robot", metavar="FILE",
              help="Robot in place of each scenario's own: a TOML file, or built in.")  # fmt: skip
@outers_option
@set_option
@figure_option
@click.option("--cost", "cost_name", default="usual", show_default=True, metavar="COST",
              help="What is minimised: a name of `hil list costs`, FILE.py or FILE.py:NAME.")  # fmt: skip
@click.option("--candidates", type=click.IntRange(11, 100_000), default=301, show_default=True,
              help="Candidates for each law; each runs every case with every seed.")  # fmt: skip
@click.option("--seed", type=click.IntRange(1, 2**31 - 1), default=1, show_default=True,
              help="Draws the candidates; the cases have seeds of their own.")  # fmt: skip
@click.option("--held-out", "repeats", type=click.IntRange(2, 10_000), default=100,
              show_default=True, help="Runs of each scenario and law that judge the result.")  # fmt: skip
@click.option("--camera", type=click.Choice(["pose", "rendered"]), default="pose",
              show_default=True, help="What the twin sees with.")  # fmt: skip
@click.option("--workers", type=click.IntRange(1, 1024),
              help="Processes on this machine; the result is the same. [default: one a core]")  # fmt: skip
@click.option("--out", type=OutFile(), default=Path("tuned.toml"),
              show_default=True, metavar="FILE", help="Where the gain set goes.")  # fmt: skip
@json_option
def command(
    tasks: tuple[str, ...],
    robot: str | None,
    outers: tuple[str, ...],
    overrides: tuple[str, ...],
    own_figures: tuple[str, ...],
    cost_name: str,
    candidates: int,
    seed: int,
    repeats: int,
    camera: str,
    workers: int | None,
    out: Path,
    as_json: bool,
) -> None:
    """Tune outer laws on the twin with the same budget, cases and cost (docs/control.md).

    ASG-ISM and PID, or those that --outer names: what is searched is the box that the law declares. A
    law named so is judged beside both built-in ones, with the gains they have.

    SCENARIO... are the tasks: built-in names, TOML files, or one deck; the three scenarios of the
    thesis when none is given. Each is run calm, pushed, late and, where it goes to a point, beside it.

    A deck with conditions (`suite`) is split: the search sees one half of its tasks and conditions, and is
    judged on the other (docs/verdict.md). Without one, the result is judged on the same tasks with
    seeds no candidate has seen, which says nothing of other tasks.

    The result is a gain set with its origin, judged at once, all laws under the same seeds. Some
    minutes of two cores; a search that is interrupted keeps its runs in FILE.search, and the same command
    goes on.
    """
    from hil.analysis.costs import cost_of
    from hil.core.errors import BadInput
    from hil.study.campaign.results import program
    from hil.study.tune import SEARCH, Plan, boxes_of, write_gain_set
    from hil.study.tune_work import Journal, identity_of, load_tasks
    from hil.study.work_folder import sigterm_stops, sole_writer

    if out.exists():
        raise BadInput(f"--out {out}: exists already; name a new file")
    if not os.access(out.absolute().parent, os.W_OK):
        raise BadInput(f"--out {out}: no folder {out.absolute().parent} that can be written to")
    cost = cost_of(cost_name)
    laws = tuple(boxes_of(outers)) or tuple(SEARCH)
    asked = load_tasks(tasks, robot, with_figures(overrides, own_figures))
    plan = Plan(cases=asked.cases(), candidates=candidates, search_seed=seed, cost=cost)
    with sole_writer(out.with_name(f"{out.name}.lock"), f"--out {out}"), sigterm_stops():
        identity = identity_of(asked, plan, camera, program(), laws)
        kept = out.with_name(f"{out.name}.search")
        with Journal(kept, identity, every_figure=not cost.is_usual) as journal:
            for note in journal.notes:
                click.echo(f"note: {note}", err=True)
            if len(journal):
                click.echo(f"{len(journal)} runs are there already", err=True)
            try:
                gains, verdicts = _searched(asked, plan, laws, repeats, camera, workers, journal)
            except KeyboardInterrupt:
                click.echo(f"kept in {journal.path}; the same command goes on", err=True)
                raise
            write_gain_set(out, gains)
            journal.remove()
    if as_json:
        told = [verdict.to_json() for verdict in verdicts]
        print_json({"gains": gains.model_dump(), "verdict": told[0], "verdicts": told})
    else:
        _print(out, gains, laws, verdicts)


def _searched(
    tasks: Tasks,
    plan: Plan,
    laws: Sequence[str],
    repeats: int,
    camera: str,
    workers: int | None,
    journal: Journal,
) -> tuple[Gains, list[Verdict]]:
    """Search, judge, and return the gains with both in their origin."""
    from hil.cli.progress import stage_progress
    from hil.record.manifest import git_revision
    from hil.study import tune
    from hil.study.campaign.workers import Pool
    from hil.study.tuning_verdict import held_out_trials, judge, pairs_of, with_verdict

    worker: Any = tune.OnTarget("twin", camera, dict(tasks.known) if tasks.own else {})
    if tasks.conditions and plan.cost.is_usual:
        worker = _by_task(tasks, worker, workers)
    with stage_progress() as stage, Pool(worker, workers or os.cpu_count() or 1) as pool:
        steps: dict[str, Stage] = {}

        def evaluate(trials: Sequence[Trial]) -> list[Figures]:
            law = trials[0].outer
            if law not in steps:
                steps[law] = stage(law, plan.trials)
            return journal.make(trials, pool.map, steps[law].advance)

        gains = tune.tune(
            tasks.base,
            evaluate,
            plan,
            target=f"twin, {camera} camera",
            revision=git_revision(),
            progress=lambda law, best: steps[law].best(best),
            more=tasks.origin,
            laws=laws,
        )
        pairs = pairs_of(laws)
        run = tuple(dict.fromkeys(law for pair in pairs for law in pair))
        trials = held_out_trials(gains, repeats, tasks.judged, run)
        step = stage("held-out tape", len(trials))
        figures = journal.make(trials, pool.map, step.advance)
    verdicts = [judge(trials, figures, pair, cost=plan.cost) for pair in pairs]
    for verdict in verdicts[::-1]:
        gains = with_verdict(gains, verdict)
    return gains, verdicts


def _by_task(tasks: Tasks, worker: Any, workers: int | None) -> Any:
    """Return a worker whose costs are normalised by what the yardstick gives on each task, calm."""
    from hil.config.control import ControlConfig
    from hil.study import suite
    from hil.study.campaign.workers import Pool
    from hil.study.tune import Case, Trial

    gains = ControlConfig().active_gains
    names = list(tasks.calm)
    trials = [
        Trial(suite.YARDSTICK_LAW, gains, Case(name, "calm", "asg-ism"), suite.YARDSTICK_SEED)
        for name in names
    ]
    with Pool(worker, workers or os.cpu_count() or 1) as pool:
        found = pool.map(trials, lambda _place, _figures: None)
    usual = {name.partition("-in-")[0]: f for name, f in zip(names, found, strict=True)}
    return suite.ByTask(worker, suite.Yardstick.of(usual))


def _print(out: Path, gains: Gains, laws: Sequence[str], verdicts: Sequence[Verdict]) -> None:
    """Write what was found and how it was judged to stdout."""
    from rich.console import Console

    from hil.study.tune import near_bounds

    console = Console(highlight=False)
    for law in laws:
        cost, start = gains.origin[f"cost_{law}"], gains.origin[f"start_cost_{law}"]
        console.print(f"{law}: cost {cost}, {start} at the start")
    for verdict in verdicts:
        console.print(_table(verdict))
    for line in near_bounds(gains, laws):
        console.print(f"[yellow]note:[/yellow] at the edge of the search: {line}")
    failed = {law: count for verdict in verdicts for law, count in verdict.failed.items()}
    for law, count in failed.items():
        if count:
            console.print(f"[yellow]note:[/yellow] {law}: {count} runs failed")
    click.echo(f"gain set: {visible(str(out))}")


def _table(verdict: Verdict) -> Table:
    """Return the paired differences, a row per figure and a column per scenario."""
    from rich.table import Table

    from hil.core.figures import BY_NAME
    from hil.study.tuning_verdict import ALL_SCENARIOS

    seeds = f"seeds {verdict.seeds[0]} to {verdict.seeds[-1]}"
    table = Table(
        title=f"{verdict.title}, held-out {seeds}, 95 % intervals",
        title_justify="left",
        show_lines=True,
    )
    table.add_column("figure")
    columns = [name for name in verdict.differences if name != ALL_SCENARIOS]
    for name in (*columns, ALL_SCENARIOS):
        table.add_column(name, justify="right")
    for figure in verdict.differences[ALL_SCENARIOS]:
        metric = BY_NAME.get(figure)
        label = f"{metric.label}, {metric.shown_unit}" if metric else figure
        cells = [
            _cell(verdict.differences[name][figure], metric) for name in (*columns, ALL_SCENARIOS)
        ]
        table.add_row(label, *cells)
    return table


def _cell(result: Paired, metric: Metric | None) -> str:
    """Return a difference above its interval; green is better, red is worse, plain is unsure."""
    if result.pairs == 0:  # a law without such a figure
        return "–"

    def text(value: float) -> str:
        number = metric.text(abs(value), with_unit=False) if metric else f"{abs(value):.3f}"
        return f"{'-' if value < 0 else '+'}{number}"

    shown = f"{text(result.mean)}\n{text(result.interval.low)} to {text(result.interval.high)}"
    return f"[{'green' if result.mean < 0 else 'red'}]{shown}[/]" if result.certain else shown
