"""Several runs side by side in processes of their own: experiments and repeats."""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from queue import Empty
from random import Random
from typing import TYPE_CHECKING, Any

from hil.config.load import load_scenario
from hil.core.errors import BadInput, RigFault
from hil.record import layout
from hil.record.manifest import Manifest, read_manifest, replace_file
from hil.record.reader import altered_files
from hil.report.circle import CircleStudy
from hil.report.compare import compare_runs, refuse_other_task, to_json
from hil.report.repeats import Repeats, repeats_of
from hil.rigs.opening import SIMULATED
from hil.runs.execute import INNER_LAWS, RunSpec, camera_for
from hil.study import ideal_circle
from hil.study.work_folder import (
    LOCK,
    SET_ASIDE,
    Terminated,
    is_new,
    set_aside,
    sigterm_stops,
    sole_writer,
)
from hil.study.workers import when_parent_is_gone

if TYPE_CHECKING:
    from multiprocessing.queues import Queue
    from multiprocessing.synchronize import Event

    from hil.config.deck import Deck
    from hil.record.reader import RunRecord
    from hil.report.compare import Comparison

Update = Callable[[str, float], None]
PLAN = "experiment.json"
REPORT = "report.html"
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


@dataclass(frozen=True, slots=True)
class Conditions:
    """What all runs of an experiment share; `repeats` runs of each take seeds from `seed` up.

    `inner` is a wheel law or "both", which gives the 2 x 2 matrix of outer and inner law.
    """

    target: str
    camera: str | None
    inner: str
    seed: int
    repeats: int
    overrides: tuple[str, ...]
    command: str

    @property
    def inners(self) -> tuple[str, ...]:
        """Return the wheel laws."""
        return tuple(sorted(INNER_LAWS, reverse=True)) if self.inner == "both" else (self.inner,)


def deck_specs(deck: Deck, conditions: Conditions, folder: Path) -> list[RunSpec]:
    """Return one spec per scenario, arm and repeat; everything is checked before anything runs.

    On a simulated rig the order does not matter. On a real one the battery empties and the floor
    wears, so each repeat is a block in which the order is drawn, by `conditions.seed`.
    """
    scenarios = [load_scenario(name, conditions.overrides) for name in deck.scenarios]
    arms = [
        (scenario, law, inner)
        for scenario in scenarios
        for law in deck.laws
        for inner in conditions.inners
    ]
    simulated = conditions.target in SIMULATED
    rng = Random(f"{conditions.seed} order of runs")
    specs = []
    for seed in range(conditions.seed, conditions.seed + conditions.repeats):
        block = arms if simulated else rng.sample(arms, len(arms))
        for scenario, law, inner in block:
            over = f"-over-{inner}" if len(conditions.inners) > 1 else ""
            tail = f"-seed{seed}" if conditions.repeats > 1 else ""
            specs.append(
                RunSpec(
                    scenario=scenario,
                    target=conditions.target,
                    camera=camera_for(scenario, conditions.target, conditions.camera),
                    outer=law,
                    inner=inner,
                    seed=seed,
                    out=folder / f"{scenario.name}-{law}{over}{tail}",
                    # Half a second a run; `hil view` makes the file when somebody wants to look.
                    rerun=conditions.repeats == 1,
                    command=conditions.command,
                )
            )
    return specs


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Hold an experiment's folder for this process; raises BadInput when another one has it.

    SIGTERM is taken like Ctrl-C meanwhile: running robots are stopped and their records closed.
    """
    if not folder.is_dir():  # made, or refused, by `claim`
        claim(folder, [])
    with sole_writer(folder / LOCK, f"--out {folder}"), sigterm_stops():
        yield


def claim(
    folder: Path, specs: Sequence[RunSpec], say: Callable[[str], None] = lambda _text: None
) -> list[RunSpec]:
    """Make the experiment's folder, or take up an interrupted one; return the runs still to do.

    A run that did not come to its end, or whose record was damaged since, is set aside and done
    anew; `say` is told of the latter. Raises BadInput when the folder holds anything else than this
    very experiment (more repeats than before are welcome).
    """
    plan = {"format": "hil-experiment-1", "runs": [_identity(spec) for spec in specs]}
    path = folder / PLAN
    if is_new(folder, PLAN):
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BadInput(f"--out {folder}: cannot be made: {error.strerror}") from None
    else:
        _refuse_other_plan(folder, plan, specs, say)
    replace_file(path, json.dumps(plan, indent=1).encode() + b"\n")
    return _to_do(specs, say)


def _to_do(specs: Sequence[RunSpec], say: Callable[[str], None]) -> list[RunSpec]:
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


def _identity(spec: RunSpec) -> dict[str, Any]:
    tree = json.dumps(spec.scenario.model_dump(mode="json"), sort_keys=True)
    return {
        "scenario": spec.scenario.name,
        "scenario_sha256": hashlib.sha256(tree.encode()).hexdigest(),
        "target": spec.target,
        "camera": spec.camera,
        "outer": spec.outer,
        "inner": spec.inner,
        "seed": spec.seed,
        "folder": spec.out.name,
    }


def _refuse_other_plan(
    folder: Path, plan: dict[str, Any], specs: Sequence[RunSpec], say: Callable[[str], None]
) -> None:
    known = plan["runs"]
    try:
        old = json.loads((folder / PLAN).read_bytes())["runs"]
    except (OSError, ValueError, KeyError, TypeError):
        _refuse_other_records(folder, specs)
        say(f"{folder / PLAN}: damaged or lost, made anew from the records beside it")
        return
    for run in old:
        if run not in known:
            raise BadInput(
                f"--out {folder}: is another experiment (its run {run.get('folder')!r} is not one "
                "of this command's); give the command that began it, or name a new folder"
            )


def _refuse_other_records(folder: Path, specs: Sequence[RunSpec]) -> None:
    """Raise BadInput unless the folder holds records of these specs and nothing else."""
    runs = {spec.out.name: spec for spec in specs}
    ours = {PLAN, f"{PLAN}.part", SET_ASIDE, REPORT, LOCK, *runs}
    found = {item.name for item in folder.iterdir()} if folder.is_dir() else {""}
    records = [name for name in runs if name in found]
    if not found <= ours or not (records or PLAN in found):
        raise BadInput(
            f"--out {folder}: exists and is neither empty nor an experiment; name a new one"
        )
    for name in records:
        manifest = _manifest(runs[name].out)
        if manifest is not None and not _is_of(manifest, runs[name]):
            raise BadInput(
                f"--out {folder}: its {PLAN} is damaged and its run {name!r} is not one of this "
                "command's; give the command that began it, or name a new folder"
            )


def _is_of(manifest: Manifest, spec: RunSpec) -> bool:
    names = ("target", "camera", "outer", "inner", "seed")
    same = all(getattr(manifest, name) == getattr(spec, name) for name in names)
    return same and manifest.scenario == json.loads(spec.scenario.model_dump_json())


def _manifest(folder: Path) -> Manifest | None:
    try:
        return read_manifest(folder)
    except BadInput:
        return None


def _unfinished(folder: Path) -> str | None:
    """Return why the run of a folder has to be done, None when it is there whole."""
    manifest = _manifest(folder)
    if manifest is None:
        return f"{layout.MANIFEST} is missing or damaged"
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
    simulated = all(spec.target in SIMULATED for spec in specs)
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
            todo = _to_do(todo, lambda _text: None)
    return [spec.out for spec in specs]


def _run_side_by_side(specs: Sequence[RunSpec], update: Update, workers: int) -> None:
    context = multiprocessing.get_context("spawn")
    news: Queue[tuple[str, float]] = context.Queue()
    stop = context.Event()
    pool = ProcessPoolExecutor(min(workers, len(specs)), context, _start_worker, (news, stop))
    try:
        futures = [pool.submit(_work, spec) for spec in specs]
        _follow(futures, news, update)
        for future in futures:
            future.result()
    except Terminated:  # Ctrl-C reaches the workers by itself
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
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # the parent passes it on by `stop`
    when_parent_is_gone(_stop_run)
    threading.Thread(target=_stop_when_told, args=(stop,), daemon=True).start()


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


@dataclass(frozen=True, slots=True)
class Study:
    """One scenario of an experiment: runs to look at side by side, and what all repeats say."""

    comparison: Comparison
    repeats: Repeats | None

    def to_json(self) -> dict[str, Any]:
        """Return the study for a JSON document; `statistics` is null without repeats."""
        statistics = self.repeats.to_json() if self.repeats else None
        return to_json(self.comparison) | {"statistics": statistics}


def study(runs: Sequence[RunRecord]) -> Study:
    """Return the study of runs of one scenario; raises BadInput when their tasks differ.

    With repeats, the runs side by side are those of the first seed that all arms have.
    """
    repeats = repeats_of(runs)
    if repeats is None:
        return Study(compare_runs(runs), None)
    for run in runs[1:]:
        refuse_other_task(runs[0], run)
    first = [run for run in runs if run.manifest.seed == repeats.seeds[0]]
    return Study(compare_runs(first), repeats)


def study_by_scenario(records: Sequence[RunRecord]) -> list[Study]:
    """Return one study per scenario, in the order in which the scenarios first come."""
    groups: dict[str, list[RunRecord]] = {}
    for record in records:
        groups.setdefault(record.manifest.scenario_name, []).append(record)
    return [study(group) for group in groups.values()]


def circle_study() -> CircleStudy:
    """Return section 8.9 with both laws, disturbed and ideally sensed (a few seconds)."""
    xi = ideal_circle.Disturbances()
    return CircleStudy.of(
        {law: ideal_circle.run_circle(law, xi) for law in ("pid", "asg-ism")},
        ideal_circle.CIRCLE_GAINS.asg_ism.eps_min_m_s2,
        f"{xi.a1_m_s2:g} sin({xi.w1_rad_s:g} t) m/s² on the forward acceleration, "
        f"{xi.a2_m_s2:g} sin({xi.w2_rad_s:g} t) m/s² on the lateral acceleration",
    )
