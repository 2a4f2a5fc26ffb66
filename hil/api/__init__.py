"""The Python API: what the commands do, as functions; `import hil` has them all.

Values that the commands take with `--set` are keyword arguments: a dot of their dotted name is two
underscores (`robot__mass_kg=3.1`), or the name itself in a dictionary (`**{"robot.mass_kg": 3.1}`). Wrong
input raises `BadInput` with the line that the command would print. A run that a rig fault ended is a run
all the same: its `outcome` is "fault".
"""

from __future__ import annotations

import operator
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil.api.results import AnyPath, Comparison, Experiment, Run, study_of
from hil.config import load
from hil.config.deck import Deck, load_deck
from hil.config.scenario import Scenario
from hil.core.errors import BadInput
from hil.core.registries import OUTER_LAWS
from hil.core.toml_text import toml_value
from hil.record.reader import RunRecord, read_run

if TYPE_CHECKING:
    from hil.replays.exact import ReplayReport
    from hil.runs.execute import RunSpec
    from hil.study.gym_env import HilEnv

# An outer law: a name, FILE.py or FILE.py:NAME, or the class that `hil.outer_law` decorated.
Law = str | os.PathLike[str] | Callable[..., Any]
# As `--camera` names it, the index of a camera, or a video.
Camera = str | int | os.PathLike[str]

__all__ = [
    "Comparison",
    "Experiment",
    "Run",
    "compare",
    "experiment",
    "load_scenario",
    "make_env",
    "open_record",
    "replay",
    "run",
]


def load_scenario(scenario: Scenario | AnyPath, **overrides: Any) -> Scenario:
    """Return a scenario with every value resolved: a built-in name or a file, and what is changed in it.

    Raises BadInput.
    """
    texts = _overrides(overrides)
    if isinstance(scenario, Scenario):
        return load.with_overrides(scenario, texts)
    return load.load_scenario(os.fspath(scenario), texts)


def run(
    scenario: Scenario | AnyPath,
    outer: Law | None = None,
    seed: int = 1,
    *,
    inner: str = "asg-ism",
    on: str = "twin",
    camera: Camera | None = None,
    out: AnyPath | None = None,
    in_memory: bool = False,
    record_camera: bool = False,
    **overrides: Any,
) -> Run:
    """Run a scenario once and return its record, as `hil run` does.

    `outer` is the scenario's own law unless another one is named; `on` and `camera` are the target and
    camera as `--on` and `--camera` name them. The record goes to `out`, which must not exist or be empty
    (a new folder in runs/ without it), or nowhere with `in_memory`. Raises BadInput before anything moves,
    KeyboardInterrupt after Ctrl-C, when the robot stands and the record is closed.
    """
    from hil.runs.execute import execute, execute_in_memory, new_folder  # noqa: PLC0415 - loads the rigs

    spec = _spec(load_scenario(scenario, **overrides), outer, inner, on, camera, seed)
    if in_memory:
        if out is not None or record_camera:
            raise BadInput("run: in_memory keeps no files; leave out and record_camera away")
        return _unless_interrupted(execute_in_memory(spec))
    folder = Path(out) if out is not None else new_folder(f"{spec.scenario.name}-{spec.outer}")
    return _unless_interrupted(execute(replace(spec, out=folder, record_camera=record_camera)))


def experiment(
    deck: str | Deck | Sequence[str] = "thesis",
    laws: Iterable[Law] | Law | None = None,
    seed: int = 1,
    *,
    repeats: int = 1,
    inner: str = "asg-ism",
    on: str = "twin",
    camera: Camera | None = None,
    out: AnyPath | None = None,
    workers: int | None = None,
    circle: bool = True,
    **overrides: Any,
) -> Experiment:
    """Run every scenario of a deck with every law of it and write one report, as `hil experiment` does.

    `deck` is a built-in name, a TOML file, or a list of scenarios; `laws` (names or files) replace the
    deck's. Runs go side by side in `workers` processes (one a core without it); a script that calls this
    needs the usual `if __name__ == "__main__":`. With `workers=1` they go one after another in this
    process. `circle` adds the section on ideal sensing to the report (a few seconds). The same call with
    the same `out` takes an interrupted experiment up. Raises BadInput.
    """
    from hil.report.html import write_report  # noqa: PLC0415 - loads the figures
    from hil.runs.execute import execute, new_folder  # noqa: PLC0415 - loads the rigs
    from hil.study import experiment as many  # noqa: PLC0415
    from hil.study import side_by_side  # noqa: PLC0415

    if repeats < 1 or (workers is not None and workers < 1):
        raise BadInput(f"experiment: repeats = {repeats}, workers = {workers}: at least 1 each")
    chosen = _deck(deck, laws)
    conditions = many.Conditions(
        on,
        _camera(camera),
        inner,
        _seed(seed),
        repeats,
        tuple(_overrides(overrides)),
        "hil.experiment",
    )
    folder = Path(out) if out is not None else new_folder("experiment")
    specs = many.deck_specs(chosen, conditions, folder)
    with many.writing(folder):
        todo = many.claim(folder, specs, lambda _text: None)
        if workers == 1:
            for spec in todo:
                _unless_interrupted(execute(spec))
        else:
            side_by_side.run_all(todo, lambda _name, _t_s: None, workers)
    records = [read_run(spec.out) for spec in specs]
    studies = many.study_by_scenario(records)
    write_report(
        folder / many.REPORT,
        [item.comparison for item in studies],
        command=conditions.command,
        circle=many.circle_study() if circle else None,
        repeats=[item.repeats for item in studies if item.repeats],
    )
    return Experiment(folder, tuple(Run(record) for record in records), tuple(studies))


def compare(*runs: Run | RunRecord | AnyPath) -> Comparison:
    """Return two or more runs of one scenario side by side, as `hil compare` does.

    Runs, or the folders of records. Raises BadInput when the runs had different tasks.
    """
    found = tuple(_run(item) for item in runs)
    return Comparison(found, study_of(found, least=2))


def replay(
    run: Run | AnyPath, outer: Law | None = None, *, recorded_code: bool = False, **overrides: Any
) -> ReplayReport:
    """Send a record through the host's loop again, as `hil replay` does.

    Without changes the result's `identical` says whether every channel came out bit for bit. With
    `outer` or changed values it is a shadow: what would have been commanded in each recorded state.
    Raises BadInput.
    """
    from hil.replays import exact  # noqa: PLC0415 - loads the rigs

    folder = run.path if isinstance(run, Run) else Path(run)
    if folder is None:
        raise BadInput("replay: this run was kept in memory; make it with a record")
    law = None if outer is None else os.fspath(outer) if isinstance(outer, os.PathLike) else outer
    if law is not None and not isinstance(law, str):
        law = _law_name(law)
    return exact.replay(folder, law, _overrides(overrides), recorded_code=recorded_code)


def open_record(path: AnyPath) -> Run:
    """Return the run recorded in a folder; raises BadInput when it is no record.

    What is intact is used, the rest is in `problems`.
    """
    return Run(read_run(Path(path)))


def make_env(
    scenario: Scenario | AnyPath,
    seed: int = 1,
    *,
    inner: str = "asg-ism",
    on: str = "twin",
    camera: Camera | None = None,
    cost: str = "usual",
    **overrides: Any,
) -> HilEnv:
    """Return a scenario as a Gymnasium environment (`hil.study.gym_env.HilEnv` says what is what).

    One step is one outer tick, the action is forward speed and turn rate, the rewards add up to minus
    the cost that `hil tune --cost COST` minimises. Raises BadInput, also without the extra `gym`.
    """
    try:
        from hil.study.gym_env import HilEnv  # noqa: PLC0415 - needs an extra
    except ModuleNotFoundError as error:
        raise BadInput(
            f"make_env: {error.name} is not installed; pip install 'skid-steer-hil[gym]'"
        ) from None
    from hil.analysis.costs import cost_of  # noqa: PLC0415

    spec = _spec(load_scenario(scenario, **overrides), None, inner, on, camera, seed)
    return HilEnv(spec, cost_of(cost))


# -- inside ------------------------------------------------------------------------------------------


def _spec(
    scenario: Scenario,
    outer: Law | None,
    inner: str,
    on: str,
    camera: Camera | None,
    seed: int,
) -> RunSpec:
    from hil.board.wheel_laws import require_wheel_law  # noqa: PLC0415
    from hil.runs.execute import RunSpec, camera_for  # noqa: PLC0415 - loads the rigs

    require_wheel_law(inner)
    return RunSpec(
        scenario=scenario,
        target=on,
        camera=camera_for(scenario, on, _camera(camera)),
        outer=_law_name(scenario.control.outer if outer is None else outer),
        inner=inner,
        seed=_seed(seed),
        out=Path(),
        command="hil.run",
    )


def _seed(seed: Any) -> int:
    """Return a seed, also one of NumPy's, as an int; raises BadInput."""
    try:
        number = int(seed) if float(seed).is_integer() and not isinstance(seed, str | bool) else -1
    except (TypeError, ValueError, OverflowError):
        number = -1
    if not 0 <= number < 2**31:
        raise BadInput(f"seed = {seed!r}: must be a whole number from 0 to {2**31 - 1}")
    return number


def _camera(camera: Camera | None) -> str | None:
    """Return a camera as `--camera` names it: 0 is the first camera, a path a video."""
    if camera is None or isinstance(camera, str):
        return camera
    if isinstance(camera, os.PathLike):
        return os.fspath(camera)
    try:
        return str(operator.index(camera))
    except TypeError:
        raise BadInput(
            f"camera = {camera!r}: rendered, pose, a camera's index, a video file or twin:SOCKET is needed"
        ) from None


def _law_name(outer: Law) -> str:
    if isinstance(outer, str | os.PathLike):
        return OUTER_LAWS.get(os.fspath(outer)).name
    for entry in OUTER_LAWS.entries():
        if entry.factory is outer:
            return entry.name
    name = getattr(outer, "__name__", repr(outer))
    raise BadInput(f"outer = {name}: not a registered law; decorate it: @hil.outer_law({name!r})")


def _deck(deck: str | Deck | Sequence[str], laws: Iterable[Law] | Law | None) -> Deck:
    if isinstance(deck, str):
        chosen = load_deck(deck)
    elif isinstance(deck, Deck):
        chosen = deck
    else:
        chosen = load.build(Deck, {"scenarios": list(deck)}, "deck")
    if laws is None:
        return chosen
    named = laws if isinstance(laws, Iterable) and not isinstance(laws, str) else [laws]
    tree = chosen.model_dump(mode="json") | {"laws": [_law_name(law) for law in named]}
    return load.build(Deck, tree, "deck")


def _overrides(values: Mapping[str, Any]) -> list[str]:
    """Return KEY=VALUE texts; a value is written as TOML."""
    return [f"{key.replace('__', '.')}={_toml(key, value)}" for key, value in values.items()]


def _toml(key: str, value: Any) -> str:
    try:
        return toml_value(value)
    except TypeError:
        raise BadInput(
            f"{key} = {value!r}: a number, text, true or false, or a list or table of them is needed"
        ) from None


def _unless_interrupted(record: RunRecord) -> Run:
    if record.manifest.outcome == "interrupted":
        raise KeyboardInterrupt
    return Run(record)


def _run(item: Run | RunRecord | AnyPath) -> Run:
    if isinstance(item, Run):
        return item
    return Run(item) if isinstance(item, RunRecord) else open_record(item)
