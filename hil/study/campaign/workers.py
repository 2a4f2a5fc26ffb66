"""Who does the jobs of a campaign on this machine: worker processes.

They give results as they come, in any order, and outlive a worker that is killed: its jobs are
given to another. A job is a small picklable value; the function is one of this package's. Jobs go to a worker
in groups, which it does side by side where the function can; those of a group that was lost go one by one.
"""

from __future__ import annotations

import itertools
import multiprocessing
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, as_completed, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any, Generic, Self, TypeVar

from hil.core.errors import RigFault
from hil.study.workers import (
    OfGroups,
    group_size,
    groups_of,
    leave_ctrl_c_to_parent,
    submit,
)

Job = TypeVar("Job")
Result = TypeVar("Result")

# Jobs handed out ahead per worker: enough that none waits, few enough that little is redone.
AHEAD = 3
# Deaths after which a job is tried by itself, and after which it is given up.
_SUSPECT_DEATHS = 2
_MOST_DEATHS = 5
# Jobs given up without a result in between: then it is not the job.
MOST_LOST = 3


class Waiting(Generic[Job]):
    """Jobs that wait: those given back first, then the others as they are asked for."""

    def __init__(self, jobs: Iterable[Job]) -> None:
        self._rest = iter(jobs)
        self._front: deque[Job] = deque()

    def ahead(self, most: int) -> int:
        """Return how many wait, counted up to `most`."""
        self._front.extend(itertools.islice(self._rest, max(most - len(self._front), 0)))
        return len(self._front)

    def __bool__(self) -> bool:
        """Say whether one waits."""
        return self.ahead(1) > 0

    @property
    def first(self) -> Job:
        """The next one; there must be one."""
        self.ahead(1)
        return self._front[0]

    def popleft(self) -> Job:
        """Take the next one."""
        self.ahead(1)
        return self._front.popleft()

    def appendleft(self, job: Job) -> None:
        """Put one back to be the next."""
        self._front.appendleft(job)


def in_processes(
    function: Callable[[Job], Result],
    jobs: Iterable[Job],
    workers: int,
    lost: Callable[[Job, str], Result] | None = None,
    side_by_side: int = 1,
) -> Iterator[Result]:
    """Yield the results of all jobs, which go to a worker in groups of `side_by_side`.

    A job whose worker dies again and again, in the end with no other job beside it, is given up:
    `lost` makes its result of the job and the reason. Raises RigFault without `lost`, and when
    several jobs in a row are lost.
    """
    work = OfGroups(function)
    todo, suspects = Waiting(groups_of(jobs, side_by_side)), Waiting[tuple[Job, ...]](())
    deaths: Counter[str] = Counter()
    lost_in_a_row = 0
    while todo or suspects:
        queue, most = (suspects, 1) if suspects else (todo, AHEAD * workers)
        pool = _workers(min(workers, most, queue.ahead(most)))
        running: dict[Future[list[Result]], tuple[Job, ...]] = {}
        try:
            for results in _hand_out(pool, work, queue, running, most):
                lost_in_a_row = 0
                yield from results
        except BrokenProcessPool:
            broken: list[Job] = []
            for future, group in running.items():
                if future.done() and future.exception() is None:
                    yield from future.result()
                else:
                    broken += group
            for job in broken:
                deaths[repr(job)] += 1
                if deaths[repr(job)] < _SUSPECT_DEATHS:
                    todo.appendleft((job,))
                elif deaths[repr(job)] < _MOST_DEATHS:
                    suspects.appendleft((job,))
                else:
                    lost_in_a_row += 1
                    yield _given_up(job, deaths[repr(job)], lost, lost_in_a_row)
        except (KeyboardInterrupt, GeneratorExit):  # nobody wants the rest
            _end_workers()
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _given_up(
    job: Job, deaths: int, lost: Callable[[Job, str], Result] | None, lost_in_a_row: int
) -> Result:
    reason = f"its worker died {deaths} times; out of memory?"
    if lost is None:
        raise RigFault(f"job {job}: {reason}")
    if lost_in_a_row >= MOST_LOST:
        raise RigFault(
            f"{lost_in_a_row} runs one after the other: {reason} Rows so far are kept, the same "
            "command goes on; fewer --workers need less memory"
        )
    return lost(job, reason)


def _hand_out(
    pool: ProcessPoolExecutor,
    function: Callable[[Job], Result],
    todo: Waiting[Job],
    running: dict[Future[Result], Job],
    most: int,
) -> Iterator[Result]:
    """Keep `most` jobs running until none is left; what is in `running` has not been yielded."""
    while todo or running:
        while todo and len(running) < most:
            future = submit(pool, function, todo.first)  # raises when the pool is broken
            running[future] = todo.popleft()
        done, _ = wait(running, return_when=FIRST_COMPLETED)
        for future in done:
            result = future.result()
            del running[future]
            yield result


class Pool:
    """Worker processes that do one list of jobs after the other and keep its order.

    A function that can do several side by side is given them in groups.
    """

    def __init__(self, function: Callable[[Job], Result], workers: int) -> None:
        self._function = function
        self._work = OfGroups(function)
        self._count = workers
        self._pool = _workers(workers)

    def __enter__(self) -> Self:
        """Return the pool."""
        return self

    def __exit__(self, kind: object, *_exc: object) -> None:
        """Give up what is not done and end the workers."""
        if kind is not None:
            _end_workers()
        self._pool.shutdown(wait=True, cancel_futures=True)

    def map(self, jobs: Sequence[Any], done: Callable[[int, Any], None]) -> list[Any]:
        """Return the results in the order of the jobs; `done` gets each as it comes, with its place.

        The jobs of a worker that is killed are done again; raises RigFault when that does not help.
        """
        results: dict[int, Any] = {}
        size = group_size(self._function, len(jobs), self._count)
        for _ in range(_MOST_DEATHS):
            left = (place for place in range(len(jobs)) if place not in results)
            try:
                futures = {
                    submit(self._pool, self._work, [jobs[i] for i in places]): places
                    for places in groups_of(left, size)
                }
                for future in as_completed(futures):
                    for place, result in zip(futures[future], future.result(), strict=True):
                        results[place] = result
                        done(place, result)
                return [results[place] for place in range(len(jobs))]
            except BrokenProcessPool:
                size = 1
                self._pool.shutdown(wait=True, cancel_futures=True)
                self._pool = _workers(self._count)
        raise RigFault(
            f"worker processes died {_MOST_DEATHS} times; out of memory? fewer --workers need less. "
            "What was found is kept, the same command goes on"
        )


def _end_workers() -> None:
    """End this process's workers at once: their jobs leave nothing behind."""
    for process in multiprocessing.active_children():
        process.terminate()


def _workers(count: int) -> ProcessPoolExecutor:
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(count, context, leave_ctrl_c_to_parent)
