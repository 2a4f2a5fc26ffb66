"""Who does the jobs of a campaign: processes of this machine, or a Dask cluster by its address.

Both give results as they come, in any order, and outlive a worker that is killed: its jobs are
given to another. A job is a small picklable value; the function is one of this package's.
"""

from __future__ import annotations

import importlib
import itertools
import multiprocessing
import signal
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any, Self, TypeVar

from hil.core.errors import BadInput, RigFault

Job = TypeVar("Job")
Result = TypeVar("Result")

# Jobs handed out ahead per worker: enough that none waits, few enough that little is redone.
_AHEAD = 3
_MOST_CRASHES = 5
_CONNECT_S = 10


def in_processes(
    function: Callable[[Job], Result], jobs: Iterable[Job], workers: int
) -> Iterator[Result]:
    """Yield the results of all jobs; raises RigFault when one job's worker dies again and again."""
    todo = deque(jobs)
    crashes: Counter[str] = Counter()
    while todo:
        pool = _workers(min(workers, len(todo)))
        running: dict[Future[Result], Job] = {}
        try:
            yield from _hand_out(pool, function, todo, running, _AHEAD * workers)
        except BrokenProcessPool:
            for future, job in running.items():
                if future.done() and future.exception() is None:
                    yield future.result()
                    continue
                crashes[repr(job)] += 1
                if crashes[repr(job)] >= _MOST_CRASHES:
                    raise RigFault(
                        f"job {job}: its worker died {crashes[repr(job)]} times; out of memory?"
                    ) from None
                todo.appendleft(job)
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _hand_out(
    pool: ProcessPoolExecutor,
    function: Callable[[Job], Result],
    todo: deque[Job],
    running: dict[Future[Result], Job],
    most: int,
) -> Iterator[Result]:
    """Keep `most` jobs running until none is left; what is in `running` has not been yielded."""
    while todo or running:
        while todo and len(running) < most:
            future = pool.submit(function, todo[0])  # raises when the pool is broken
            running[future] = todo.popleft()
        done, _ = wait(running, return_when=FIRST_COMPLETED)
        for future in done:
            result = future.result()
            del running[future]
            yield result


class Pool:
    """Worker processes that do one list of jobs after the other and keep its order."""

    def __init__(self, function: Callable[[Job], Result], workers: int) -> None:
        self._function = function
        self._pool = _workers(workers)

    def __enter__(self) -> Self:
        """Return the pool."""
        return self

    def __exit__(self, *_exc: object) -> None:
        """Give up what is not done and end the workers."""
        self._pool.shutdown(wait=True, cancel_futures=True)

    def map(self, jobs: Iterable[Job], done: Callable[[], None]) -> list[Any]:
        """Return the results in the order of the jobs; `done` is called for each."""
        results = []
        try:
            for result in self._pool.map(self._function, jobs):
                results.append(result)
                done()
        except BrokenProcessPool:
            raise RigFault(
                "a worker process died; out of memory? fewer --workers need less"
            ) from None
        return results


def _workers(count: int) -> ProcessPoolExecutor:
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(count, context, _leave_ctrl_c_to_parent)


def _leave_ctrl_c_to_parent() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def on_dask(
    function: Callable[[Job], Result], jobs: Iterable[Job], address: str
) -> Iterator[Result]:
    """Yield the results of all jobs from the cluster whose scheduler is at `address`."""
    try:
        dask: Any = importlib.import_module("distributed")  # an optional package
    except ImportError:
        raise BadInput(
            "--dask: the package distributed is missing; pip install 'skid-steer-hil[cluster]'"
        ) from None
    try:
        client = dask.Client(address, timeout=_CONNECT_S)
    except (OSError, ValueError, TimeoutError) as error:
        raise BadInput(f"--dask {address}: no scheduler answers there ({error})") from None
    with client:
        source = iter(jobs)
        most = _AHEAD * max(1, sum(client.nthreads().values()))

        def submit(count: int) -> list[Any]:
            # A job is not kept under a name made of its content: two campaigns may share jobs.
            return [
                client.submit(function, job, pure=False) for job in itertools.islice(source, count)
            ]

        waiting = dask.as_completed(submit(most))
        for future in waiting:
            yield future.result()
            for more in submit(1):
                waiting.add(more)
