"""Several runs side by side in processes of their own: experiments and repeats."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import Empty
from typing import TYPE_CHECKING

from hil import ideal
from hil.config.load import load_scenario
from hil.errors import BadInput
from hil.report.circle import CircleStudy
from hil.report.compare import compare_runs
from hil.run import RunSpec, camera_for

if TYPE_CHECKING:
    from multiprocessing.queues import Queue

    from hil.config.deck import Deck
    from hil.record.reader import RunRecord
    from hil.report.compare import Comparison

Update = Callable[[str, float], None]
_REPORT_PERIOD_S = 0.5
_POLL_S = 0.1

_news: Queue[tuple[str, float]] | None = None


@dataclass(frozen=True, slots=True)
class Conditions:
    """What all runs of an experiment share; `repeats` runs of each take seeds from `seed` up."""

    target: str
    camera: str | None
    inner: str
    seed: int
    repeats: int
    overrides: tuple[str, ...]
    command: str


def deck_specs(deck: Deck, conditions: Conditions, folder: Path) -> list[RunSpec]:
    """Return one spec per scenario, law and repeat; everything is checked before anything runs."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise BadInput(f"--out {folder}: exists and is not an empty folder; name a new one")
    specs = []
    for name in deck.scenarios:
        scenario = load_scenario(name, conditions.overrides)
        for law in deck.laws:
            for seed in range(conditions.seed, conditions.seed + conditions.repeats):
                tail = f"-seed{seed}" if conditions.repeats > 1 else ""
                specs.append(
                    RunSpec(
                        scenario=scenario,
                        target=conditions.target,
                        camera=camera_for(scenario, conditions.target, conditions.camera),
                        outer=law,
                        inner=conditions.inner,
                        seed=seed,
                        out=folder / f"{scenario.name}-{law}{tail}",
                        command=conditions.command,
                    )
                )
    return specs


def run_name(spec: RunSpec) -> str:
    """Return the name of a run within its experiment; its folder has the same."""
    return spec.out.name


def run_all(specs: Sequence[RunSpec], update: Update, workers: int | None = None) -> list[Path]:
    """Run every spec, `workers` at a time (one a core; a real rig: one), return their folders.

    An error in one run ends the others and is raised here.
    """
    context = multiprocessing.get_context("spawn")
    news: Queue[tuple[str, float]] = context.Queue()
    simulated = all(not spec.target.startswith("serial") for spec in specs)
    count = min((workers or os.cpu_count() or 1) if simulated else 1, len(specs))
    pool = ProcessPoolExecutor(count, context, _start_worker, (news,))
    try:
        futures = [pool.submit(_work, spec) for spec in specs]
        _follow(futures, news, update)
        return [future.result() for future in futures]
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _follow(
    futures: Sequence[Future[Path]], news: Queue[tuple[str, float]], update: Update
) -> None:
    """Pass on progress until all are done or one has failed."""
    while not all(future.done() for future in futures):
        if any(future.done() and future.exception() is not None for future in futures):
            return
        try:
            update(*news.get(timeout=_POLL_S))
        except Empty:
            continue


def _start_worker(news: Queue[tuple[str, float]]) -> None:
    """Set a worker process up: progress goes to `news`."""
    global _news  # noqa: PLW0603 - the pool hands an initialiser's findings on in no other way
    _news = news


def _work(spec: RunSpec) -> Path:
    """Run one spec in this process."""
    from hil.run import execute  # noqa: PLC0415 - in the worker only

    last_s = [0.0]

    def progress(t_s: float) -> None:
        if _news is not None and t_s >= last_s[0]:
            last_s[0] = t_s + _REPORT_PERIOD_S
            _news.put((run_name(spec), t_s))

    return execute(spec, progress).path


def compare_by_scenario(records: Sequence[RunRecord]) -> list[Comparison]:
    """Return one comparison per scenario, in the order in which the scenarios first come."""
    groups: dict[str, list[RunRecord]] = {}
    for record in records:
        groups.setdefault(record.manifest.scenario_name, []).append(record)
    return [compare_runs(group) for group in groups.values()]


def circle_study() -> CircleStudy:
    """Return section 8.9 with both laws, disturbed and ideally sensed (a few seconds)."""
    xi = ideal.Disturbances()
    return CircleStudy.of(
        {law: ideal.run_circle(law, xi) for law in ("pid", "asg-ism")},
        ideal.CIRCLE_GAINS.asg_ism.eps_min_m_s2,
        f"{xi.a1_m_s2:g} sin({xi.w1_rad_s:g} t) m/s² on the forward acceleration, "
        f"{xi.a2_m_s2:g} sin({xi.w2_rad_s:g} t) m/s² on the lateral acceleration",
    )
