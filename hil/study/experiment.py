"""Several runs side by side in processes of their own: experiments and repeats."""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import Empty
from random import Random
from typing import TYPE_CHECKING, Any

from hil.config.fit import check_fit
from hil.config.load import load_scenario
from hil.core.errors import BadInput
from hil.core.files import replace_file
from hil.record import layout
from hil.record.manifest import read_manifest
from hil.report.circle import CircleStudy
from hil.report.compare import compare_runs, refuse_other_task, to_json
from hil.report.repeats import Repeats, repeats_of
from hil.rigs.opening import SIMULATED
from hil.runs.execute import INNER_LAWS, RunSpec, camera_for
from hil.study import ideal_circle

if TYPE_CHECKING:
    from multiprocessing.queues import Queue

    from hil.config.deck import Deck
    from hil.record.reader import RunRecord
    from hil.report.compare import Comparison

Update = Callable[[str, float], None]
PLAN = "experiment.json"
_REPORT_PERIOD_S = 0.5
_POLL_S = 0.1

_news: Queue[tuple[str, float]] | None = None


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
    for scenario in scenarios:
        check_fit(scenario)
    _refuse_one_name_twice(deck, [scenario.name for scenario in scenarios])
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


def _refuse_one_name_twice(deck: Deck, names: Sequence[str]) -> None:
    """Raise BadInput when two scenarios have one name: their records would share a folder.

    Names that differ in case only share it too, on some file systems.
    """
    seen: dict[str, str] = {}
    for file, name in zip(deck.scenarios, names, strict=True):
        if name.casefold() in seen:
            raise BadInput(
                f"deck: scenarios {seen[name.casefold()]!r} and {file!r} are both named {name!r}; "
                "give each file a name of its own (key name)"
            )
        seen[name.casefold()] = file


def claim(folder: Path, specs: Sequence[RunSpec]) -> list[RunSpec]:
    """Make the experiment's folder, or take up an interrupted one; return the runs still to do.

    A run that did not come to its end is set aside and done anew. Raises BadInput when the folder
    holds anything else than this very experiment (more repeats than before are welcome).
    """
    plan = {"format": "hil-experiment-1", "runs": [_identity(spec) for spec in specs]}
    path = folder / PLAN
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        _refuse_other_plan(folder, plan)
    else:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BadInput(f"--out {folder}: cannot be made: {error.strerror}") from None
    replace_file(path, json.dumps(plan, indent=1).encode() + b"\n")
    todo = [spec for spec in specs if not _ended(spec)]
    for spec in todo:
        _set_aside(spec.out)
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


def _refuse_other_plan(folder: Path, plan: dict[str, Any]) -> None:
    try:
        old = json.loads((folder / PLAN).read_bytes())["runs"]
    except (OSError, ValueError, KeyError, TypeError):
        raise BadInput(
            f"--out {folder}: exists and is neither empty nor an experiment; name a new one"
        ) from None
    known = plan["runs"]
    for run in old:
        if run not in known:
            raise BadInput(
                f"--out {folder}: is another experiment (its run {run.get('folder')!r} is not one "
                "of this command's); give the command that began it, or name a new folder"
            )


def _ended(spec: RunSpec) -> bool:
    """Say whether the run of a spec is there and came to an end of its own."""
    if not (spec.out / layout.MANIFEST).is_file():
        return False
    return read_manifest(spec.out).outcome in {"complete", "fault"}


def _set_aside(folder: Path) -> None:
    if not folder.exists():
        return
    aside = folder.parent / "set-aside"
    aside.mkdir(exist_ok=True)
    number = 1
    while (target := aside / f"{folder.name}-{number}").exists():
        number += 1
    folder.rename(target)


def run_name(spec: RunSpec) -> str:
    """Return the name of a run within its experiment; its folder has the same."""
    return spec.out.name


def run_all(specs: Sequence[RunSpec], update: Update, workers: int | None = None) -> list[Path]:
    """Run every spec, `workers` at a time (one a core; a real rig: one), return their folders.

    An error in one run ends the others and is raised here.
    """
    if not specs:
        return []
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
    from hil.runs.execute import execute  # noqa: PLC0415 - in the worker only

    last_s = [0.0]

    def progress(t_s: float) -> None:
        if _news is not None and t_s >= last_s[0]:
            last_s[0] = t_s + _REPORT_PERIOD_S
            _news.put((run_name(spec), t_s))

    return execute(spec, progress).path


@dataclass(frozen=True, slots=True)
class Study:
    """One scenario of an experiment: runs to look at side by side, and what all repeats say."""

    comparison: Comparison
    repeats: Repeats | None

    def to_json(self) -> dict[str, Any]:
        """Return the study for a JSON document; `statistics` is null without repeats."""
        statistics = self.repeats.to_json() if self.repeats else None
        return to_json(self.comparison) | {"statistics": statistics}


def study(runs: Sequence[RunRecord], least: int = 2) -> Study:
    """Return the study of `least` or more runs of one scenario; BadInput when their tasks differ.

    With repeats, the runs side by side are those of the first seed that all arms have.
    """
    repeats = repeats_of(runs)
    if repeats is None:
        return Study(compare_runs(runs, least), None)
    for run in runs[1:]:
        refuse_other_task(runs[0], run)
    first = [run for run in runs if run.manifest.seed == repeats.seeds[0]]
    return Study(compare_runs(first), repeats)


def study_by_scenario(records: Sequence[RunRecord]) -> list[Study]:
    """Return one study per scenario, in the order in which the scenarios first come."""
    groups: dict[str, list[RunRecord]] = {}
    for record in records:
        groups.setdefault(record.manifest.scenario_name, []).append(record)
    return [study(group, least=1) for group in groups.values()]


def circle_study() -> CircleStudy:
    """Return section 8.9 with both laws, disturbed and ideally sensed (a few seconds)."""
    xi = ideal_circle.Disturbances()
    return CircleStudy.of(
        {law: ideal_circle.run_circle(law, xi) for law in ("pid", "asg-ism")},
        ideal_circle.CIRCLE_LAYER_M_S2,
        f"{xi.a1_m_s2:g} sin({xi.w1_rad_s:g} t) m/s² on the forward acceleration, "
        f"{xi.a2_m_s2:g} sin({xi.w2_rad_s:g} t) m/s² on the lateral acceleration",
    )
