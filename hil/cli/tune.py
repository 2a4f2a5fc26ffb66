"""`hil tune`: the gains of both outer laws by one search, one cost and one budget."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


@click.command("tune")
@click.option("--candidates", type=click.IntRange(11, 100_000), default=301, show_default=True,
              help="Candidates for each law; each runs every case over both wheel laws.")  # fmt: skip
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=1, show_default=True,
              help="Draws the candidates; the cases have seeds of their own.")  # fmt: skip
@click.option("--camera", type=click.Choice(["pose", "rendered"]), default="pose",
              show_default=True, help="What the twin sees with.")  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), default=Path("tuned.toml"),
              show_default=True, metavar="FILE", help="Where the gain set goes.")  # fmt: skip
def command(candidates: int, seed: int, camera: str, out: Path) -> None:
    """Tune ASG-ISM and PID on the twin with the same budget, cases and cost (docs/control.md).

    Both searches run side by side, one process each. The result is a gain set with its origin, to
    be judged on seeds it has not seen: `hil experiment --repeats 100 --seed 1000 --camera pose`.
    """
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    from hil.config.control import ControlConfig
    from hil.errors import BadInput
    from hil.record.manifest import git_revision
    from hil.tune import SEARCH, OnTarget, Plan, search, with_origin, write_gain_set

    if out.exists():
        raise BadInput(f"--out {out}: exists already; name a new file")
    base = ControlConfig().active_gains
    plan = Plan(candidates=candidates, search_seed=seed)
    evaluate = OnTarget("twin", camera)
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with (
        Progress(*columns, console=Console(stderr=True)) as bars,
        ProcessPoolExecutor(len(SEARCH), get_context("spawn")) as pool,
    ):
        runs = candidates * len(plan.cases)
        futures = {}
        for law in SEARCH:
            bar = bars.add_task(f"{law}: {candidates} candidates, {runs} runs", total=1)
            futures[law] = pool.submit(search, law, base, evaluate, plan)
            futures[law].add_done_callback(partial(_finish, bars, bar))
        found = {law: future.result() for law, future in futures.items()}
    gains = with_origin(base, found, plan, target=f"twin, {camera} camera", revision=git_revision())
    write_gain_set(out, gains)
    for law, result in found.items():
        click.echo(f"{law}: cost {result.cost:.4f}, {result.start_cost:.4f} at the start")
    click.echo(f"gain set: {out}")


def _finish(bars: Progress, bar: TaskID, _done: Any) -> None:
    """Fill a bar whose search has ended."""
    bars.update(bar, completed=1)
