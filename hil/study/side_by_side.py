"""The runs of an experiment side by side, in processes of their own."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from queue import Empty
from typing import TYPE_CHECKING

from hil.core.errors import BadInput, RigFault, Stopped
from hil.record import layout
from hil.record.manifest import Manifest, read_manifest
from hil.record.reader import altered_files
from hil.rigs.opening import is_simulated
from hil.runs.execute import RunSpec
from hil.study.work_folder import set_aside
from hil.study.workers import submit, take_ctrl_c, when_parent_is_gone

if TYPE_CHECKING:
    from multiprocessing.queues import Queue
    from multiprocessing.synchronize import Event

Update = Callable[[str, float], None]
_REPORT_PERIOD_S = 0.5
_POLL_S = 0.1
# Tries of a simulated run whose worker is killed, and what a run has to stop when its parent is gone.
_MOST_TRIES = 3
_STOP_S = 10.0


# Files whose loss costs a look at a run and not the run.
_TO_LOOK_AT = (layout.RERUN, layout.CAMERA, layout.PICTURES)
_news: Queue[tuple[str, float]] | None = None
_idle = threading.Event()
_interrupted = threading.Event()


def manifest_of(folder: Path) -> Manifest | None:
    """Return the manifest of a record, None where there is none that can be read."""
    try:
        return read_manifest(folder)
    except BadInput:
        return None


def still_to_do(specs: Sequence[RunSpec], say: Callable[[str], None]) -> list[RunSpec]:
    """Return the runs that are not there whole; what is there of them is set aside."""
    todo = []
    for spec in specs:
        reason = _unfinished(spec.out)
        if reason is None:
            continue
        todo.append(spec)
        if spec.out.exists():
            aside = set_aside(spec.out, spec.out.parent)
            say(f"{spec.out}: {reason}; moved to {aside}, done anew")
    return todo


def _unfinished(folder: Path) -> str | None:
    """Return why the run of a folder has to be done, None when it is there whole."""
    manifest = manifest_of(folder)
    if manifest is None:
        return f"{layout.MANIFEST} is missing or damaged"
    if manifest.outcome == "fault" and not manifest.files:
        return "its record could not be finished"
    if manifest.outcome not in {"complete", "fault"}:
        return "cut off before its end" if manifest.outcome == "running" else manifest.outcome
    damaged = [line for line in altered_files(folder, manifest) if not line.startswith(_TO_LOOK_AT)]
    return damaged[0] if damaged else None


def run_name(spec: RunSpec) -> str:
    """Return the name of a run within its experiment; its folder has the same."""
    return spec.out.name


def run_all(specs: Sequence[RunSpec], update: Update, workers: int | None = None) -> list[Path]:
    """Run every spec, `workers` at a time (one a core; a real rig: one), return their folders.

    An error in one run ends the others and is raised here. Simulated runs whose worker process is
    killed are done again; on a real rig, or when that does not help, RigFault is raised.
    """
    simulated = all(is_simulated(spec.target) for spec in specs)
    todo = list(specs)
    for tried in range(_MOST_TRIES):
        if not todo:
            break
        try:
            _run_side_by_side(todo, update, (workers or os.cpu_count() or 1) if simulated else 1)
            break
        except BrokenProcessPool:
            if not simulated or tried + 1 == _MOST_TRIES:
                raise RigFault(
                    "a worker process died; out of memory? Finished runs are kept, the same "
                    "command goes on"
                ) from None
            todo = still_to_do(todo, lambda _text: None)
    return [spec.out for spec in specs]


def _run_side_by_side(specs: Sequence[RunSpec], update: Update, workers: int) -> None:
    context = multiprocessing.get_context("spawn")
    news: Queue[tuple[str, float]] = context.Queue()
    stop = context.Event()
    pool = ProcessPoolExecutor(min(workers, len(specs)), context, _start_worker, (news, stop))
    try:
        futures = [submit(pool, _work, spec) for spec in specs]
        _follow(futures, news, update)
        for future in futures:
            future.result()
    except Stopped as stopped:
        if stopped.number != signal.SIGINT:  # Ctrl-C reaches the workers by itself
            stop.set()
        raise
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


def _start_worker(news: Queue[tuple[str, float]], stop: Event) -> None:
    """Set a worker process up: progress goes to `news`; it ends with its parent, in good order."""
    global _news  # noqa: PLW0603 - the pool hands an initialiser's findings on in no other way
    _news = news
    _idle.set()
    for name in ("SIGTERM", "SIGHUP"):  # the parent passes them on by `stop`
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    take_ctrl_c(_on_ctrl_c)
    when_parent_is_gone(_stop_run)
    threading.Thread(target=_stop_when_told, args=(stop,), daemon=True).start()


def _on_ctrl_c(_number: int, _frame: object) -> None:
    """Stop the run there is; between two of them no other is begun."""
    _interrupted.set()
    if not _idle.is_set():
        raise KeyboardInterrupt


def _stop_when_told(stop: Event) -> None:
    stop.wait()
    _stop_run()


def _stop_run() -> None:
    """Stop the run of this process as Ctrl-C does, the robot first, and wait for its record."""
    _interrupted.set()
    if not _idle.is_set():
        os.kill(os.getpid(), signal.SIGINT)
        _idle.wait(_STOP_S)


def _work(spec: RunSpec) -> Path:
    """Run one spec in this process; none any more after one was interrupted."""
    from hil.runs.execute import execute  # noqa: PLC0415 - in the worker only

    last_s = [0.0]

    def progress(t_s: float) -> None:
        if _news is not None and t_s >= last_s[0]:
            last_s[0] = t_s + _REPORT_PERIOD_S
            _news.put((run_name(spec), t_s))

    _idle.clear()
    try:
        if _interrupted.is_set():
            raise KeyboardInterrupt
        record = execute(spec, progress)
    finally:
        _idle.set()
    if record.manifest.outcome == "interrupted":
        _interrupted.set()
    return record.path
