"""An experiment: which runs it is made of, which of them are still to do, and what they say."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any

from hil.board.wheel_laws import MATRIX
from hil.config.fit import check_fit
from hil.config.gains import only_gains_of
from hil.core.errors import BadInput
from hil.core.files import PART, replace_file
from hil.core.registries import source_digests
from hil.record.manifest import Manifest
from hil.report.circle import CircleStudy
from hil.report.compare import compare_runs, refuse_other_task, to_json
from hil.report.repeats import Repeats, repeats_of
from hil.rigs.opening import is_simulated
from hil.runs.execute import RunSpec, camera_for
from hil.study import ideal_circle
from hil.study.side_by_side import manifest_of, still_to_do
from hil.study.work_folder import (
    LOCK,
    SET_ASIDE,
    is_new,
    sigterm_stops,
    sole_writer,
)

if TYPE_CHECKING:
    from hil.config.deck import Deck
    from hil.record.reader import RunRecord
    from hil.report.compare import Comparison

PLAN = "experiment.json"
REPORT = "report.html"


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
        return MATRIX if self.inner == "both" else (self.inner,)


def deck_specs(deck: Deck, conditions: Conditions, folder: Path) -> list[RunSpec]:
    """Return one spec per scenario (in each condition), arm and repeat; all is checked before anything runs.

    On a simulated rig the order does not matter. On a real one the battery empties and the floor
    wears, so each repeat is a block in which the order is drawn, by `conditions.seed`.
    """
    scenarios = [deck.scenario_of(cell, conditions.overrides) for cell in deck.cells()]
    for scenario in scenarios:
        check_fit(scenario)
    _refuse_one_name_twice(deck, [scenario.name for scenario in scenarios])
    arms = [
        (scenario, law, inner)
        for scenario in scenarios
        for law in deck.laws
        for inner in conditions.inners
    ]
    simulated = is_simulated(conditions.target)
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
    for cell, name in zip(deck.cells(), names, strict=True):
        file = cell.scenario
        if name.casefold() in seen:
            raise BadInput(
                f"deck: scenarios {seen[name.casefold()]!r} and {file!r} are both named {name!r}; "
                "give each file a name of its own (key name)"
            )
        seen[name.casefold()] = file


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
    return still_to_do(specs, say)


def _identity(spec: RunSpec) -> dict[str, Any]:
    tree = json.dumps(_task(spec.scenario.model_dump(mode="json"), spec), sort_keys=True)
    return {
        "scenario": spec.scenario.name,
        "scenario_sha256": hashlib.sha256(tree.encode()).hexdigest(),
        "target": spec.target,
        "camera": spec.camera,
        "outer": spec.outer,
        "inner": spec.inner,
        "seed": spec.seed,
        "folder": spec.out.name,
    } | ({"texts": texts} if (texts := source_digests([spec.outer])) else {})


def _task(tree: dict[str, Any], spec: RunSpec) -> dict[str, Any]:
    return only_gains_of(tree, [spec.outer])


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
    ours = {PLAN, f"{PLAN}{PART}", SET_ASIDE, REPORT, LOCK, *runs}
    found = {item.name for item in folder.iterdir()} if folder.is_dir() else {""}
    records = [name for name in runs if name in found]
    if not found <= ours or not (records or PLAN in found):
        raise BadInput(
            f"--out {folder}: exists and is neither empty nor an experiment; name a new one"
        )
    for name in records:
        manifest = manifest_of(runs[name].out)
        if manifest is not None and not _is_of(manifest, runs[name]):
            raise BadInput(
                f"--out {folder}: its {PLAN} is damaged and its run {name!r} is not one of this "
                "command's; give the command that began it, or name a new folder"
            )


def _is_of(manifest: Manifest, spec: RunSpec) -> bool:
    names = ("target", "camera", "outer", "inner", "seed")
    same = all(getattr(manifest, name) == getattr(spec, name) for name in names)
    ours = json.loads(spec.scenario.model_dump_json())
    return same and _task(manifest.scenario, spec) == _task(ours, spec)


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
