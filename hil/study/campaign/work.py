"""Does the jobs of a campaign: runs in memory, side by side, and the loop that hands them out."""

from __future__ import annotations

import os
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.config.fit import check_fit
from hil.core.errors import BadInput, RigFault
from hil.study.campaign.cluster import PROGRAM, on_dask
from hil.study.campaign.plan import Campaign, Job
from hil.study.campaign.results import CAMPAIGN, ERROR, ResultStore, Row, row_of
from hil.study.campaign.workers import in_processes
from hil.study.work_folder import LOCK, is_new, sigterm_stops, sole_writer
from hil.study.workers import group_size

if TYPE_CHECKING:
    from hil.config.scenario import Scenario
    from hil.record.reader import RunRecord
    from hil.runs.spec import RunSpec
    from hil.runs.together import Result
    from hil.study.campaign.merge import Results

Progress = Callable[[int, int], None]
_FLUSH_PERIOD_S = 15.0


@dataclass(frozen=True, slots=True)
class Done:
    """A row, and how long its worker was busy with it."""

    row: Row
    busy_s: float


@dataclass(frozen=True, slots=True)
class Totals:
    """How a campaign went; `workers` is None on a cluster, whose size may change meanwhile."""

    runs: int
    runs_now: int
    workers: int | None
    wall_s: float
    busy_s: float

    @property
    def efficiency(self) -> float | None:
        """Return busy time / (workers x wall time), start of the workers included."""
        if not self.workers or not self.runs_now:
            return None
        return self.busy_s / (self.workers * self.wall_s)


class Worker:
    """Runs jobs of one campaign; goes to a worker whole with each job (a few kB)."""

    def __init__(self, campaign: Campaign) -> None:
        self._campaign = campaign

    def __call__(self, job: Job) -> Done:
        """Run the job; a run that ends early has no figures."""
        return self.many([job])[0]

    def many(self, jobs: Sequence[Job]) -> list[Done]:
        """Run the jobs side by side."""
        start_s = time.perf_counter()
        rows = run_jobs(self._campaign, jobs)
        busy_s = (time.perf_counter() - start_s) / len(jobs)
        return [Done(row, busy_s) for row in rows]


def run_jobs(campaign: Campaign, jobs: Sequence[Job]) -> list[Row]:
    """Run jobs in memory, side by side, and return their rows; whatever a run does is its row's outcome."""
    from hil.runs.together import execute_together  # noqa: PLC0415 - in the worker only

    specs = [_spec(campaign, job) for job in jobs]
    found = iter(execute_together([spec for spec in specs if not isinstance(spec, Exception)]))
    made = [spec if isinstance(spec, Exception) else next(found) for spec in specs]
    return [_row(job, result) for job, result in zip(jobs, made, strict=True)]


def _spec(campaign: Campaign, job: Job) -> RunSpec | Exception:
    """Return what is to be run, or why it cannot be."""
    from hil.runs.spec import RunSpec  # noqa: PLC0415 - in the worker only

    file = campaign.file
    try:
        scenario = _scenario(campaign, job.point)
        check_fit(scenario)
        return RunSpec(
            scenario, file.target, file.camera, job.outer, job.inner, job.seed, Path(),
            rerun=False, command="hil sweep",
        )  # fmt: skip
    except Exception as error:
        return error


def _row(job: Job, made: Result) -> Row:
    try:
        if isinstance(made, BaseException):
            raise made
        return _row_of_run(job, made)
    except BadInput as error:  # a combination of values, each of them allowed by itself
        return row_of(job, "refused", str(error), False, 0.0, [])
    except RigFault:  # the target cannot be had on this machine, for no job
        raise
    except Exception as error:
        return row_of(job, ERROR, _where(error), False, 0.0, [])


def _row_of_run(job: Job, record: RunRecord) -> Row:
    manifest, t_s = record.manifest, record.samples["t_s"]
    end_s = float(t_s[-1]) if t_s.size else 0.0
    if manifest.outcome != "complete":
        return row_of(job, manifest.outcome, manifest.outcome_detail, False, end_s, [])
    holds = all(verdict.holds for verdict in record.verdicts())
    return row_of(job, "complete", "", holds, end_s, list(record.figures().values.items()))


# The newest point and its scenario: runs of one point follow each other, and none can change it.
_newest: list[tuple[Campaign, str, Scenario]] = []


def _scenario(campaign: Campaign, point: Sequence[tuple[str, Any]]) -> Scenario:
    """Return the scenario at a point; raises BadInput."""
    key = repr(point)  # 1 and 1.0 are not the same everywhere
    if not _newest or _newest[0][0] is not campaign or _newest[0][1] != key:
        _newest[:] = [(campaign, key, campaign.scenario(point))]
    return _newest[0][2]


def _where(error: Exception) -> str:
    """Return what an error of the program itself says, and the line that raised it."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    said = str(error).partition("\n")[0]
    return f"{type(error).__name__}: {said} ({Path(frame.filename).name}:{frame.lineno})"


def _lost(job: Job, reason: str) -> Done:
    return Done(row_of(job, ERROR, reason, False, 0.0, []), 0.0)


def run_campaign(
    campaign: Campaign,
    folder: Path,
    workers: int | None = None,
    dask: str | None = None,
    progress: Progress | None = None,
    say: Callable[[str], None] = lambda _text: None,
) -> tuple[Results, Totals]:
    """Do what is still to do of a campaign and return all its rows, sorted.

    `workers` processes of this machine (one a core), or the Dask cluster at address `dask`. `say`
    is told what was found damaged, and what is waited for. Raises BadInput for a folder that is not
    this campaign's or has a writer already, RigFault when the workers or the cluster go away; what
    came until then is kept.
    """
    if not is_new(folder, CAMPAIGN) and not (folder / CAMPAIGN).exists():
        ResultStore(folder, campaign)  # refuses it before a lock is put there
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"--out {folder}: cannot be made: {error.strerror}") from None
    with sole_writer(folder / LOCK, f"--out {folder}"), sigterm_stops():
        return _go_on(ResultStore(folder, campaign), campaign, workers, dask, progress, say)


def _group(campaign: Campaign, jobs: int, workers: int) -> int:
    """Return how many jobs go to a worker at once: runs with poses; pictures are drawn for one at a time."""
    return group_size(Worker, jobs, workers) if campaign.file.camera == "pose" else 1


def _go_on(
    store: ResultStore,
    campaign: Campaign,
    workers: int | None,
    dask: str | None,
    progress: Progress | None,
    say: Callable[[str], None],
) -> tuple[Results, Totals]:
    for note in store.notes:
        say(note)
    jobs = campaign.jobs()
    before = int(store.done.sum())
    left = len(jobs) - before
    todo = (jobs[index] for index in np.flatnonzero(~store.done).tolist())
    count = workers or os.cpu_count() or 1
    worker = Worker(campaign)
    start_s = time.perf_counter()
    results: Iterator[Done]
    native = ("sim_twin._pil",) if campaign.file.target == "pil" else ()
    if dask:
        needed = (*PROGRAM, *native)
        results = on_dask(worker, todo, dask, _lost, say, needed, _group(campaign, left, count))
    else:
        if native:  # said once here; else each run would be refused for it
            from sim_twin.pil import pil_is_missing  # noqa: PLC0415 - for this target only

            if missing := pil_is_missing():
                raise BadInput(missing)
        results = in_processes(worker, todo, count, _lost, _group(campaign, left, count))
    busy_s, flushed_s = 0.0, start_s
    try:
        for number, done in enumerate(results, start=1):
            store.add(done.row)
            busy_s += done.busy_s
            if (now_s := time.perf_counter()) - flushed_s > _FLUSH_PERIOD_S:
                flushed_s = now_s
                store.flush()
            if progress is not None:
                progress(before + number, len(jobs))
    finally:
        store.flush()
    wall_s = time.perf_counter() - start_s
    return store.finish(), Totals(
        len(jobs), len(jobs) - before, None if dask else count, wall_s, busy_s
    )
