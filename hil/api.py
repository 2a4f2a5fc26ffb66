"""The Python API: what the commands do, as functions; `import hil` has them all.

Values that the commands take with `--set` are keyword arguments: a dot of their dotted name is two
underscores (`robot__mass_kg=3.1`), or the name itself in a dictionary (`**{"robot.mass_kg": 3.1}`). Wrong
input raises `BadInput` with the line that the command would print. A run that a rig fault ended is a run
all the same: its `outcome` is "fault".
"""

from __future__ import annotations

import html
import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil.config import load
from hil.config.deck import Deck, load_deck
from hil.config.scenario import Scenario
from hil.core.errors import BadInput
from hil.core.registries import OUTER_LAWS
from hil.record.journal import arrow_table
from hil.record.reader import RunRecord, read_run
from hil.record.schema import FRAME_COLUMNS, SAMPLE_COLUMNS

if TYPE_CHECKING:
    import numpy as np
    import pyarrow as pa
    from numpy.typing import NDArray

    from hil.analysis.metrics import Verdict
    from hil.record.manifest import Manifest
    from hil.record.reader import Event
    from hil.replays.exact import ReplayReport
    from hil.runs.execute import RunSpec
    from hil.study.experiment import Study
    from hil.study.gym_env import HilEnv

# An outer law: a name, FILE.py or FILE.py:NAME, or the class that `hil.outer_law` decorated.
Law = str | Callable[..., Any]
AnyPath = str | os.PathLike[str]

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


@dataclass(frozen=True, slots=True)
class Run:
    """One recorded run. A notebook shows its report.

    Columns and their units are those of docs/run-record.md: SI units and radians, world frame.
    """

    record: RunRecord

    @property
    def path(self) -> Path | None:
        """Return the record's folder, None for a run that was kept in memory."""
        return None if self.record.path == Path() else self.record.path

    @property
    def manifest(self) -> Manifest:
        """Return what made the run: scenario, law, gains, seed, versions, outcome."""
        return self.record.manifest

    @property
    def outcome(self) -> str:
        """Return "complete", "fault", "interrupted", or "running" for a record that was cut off."""
        return self.record.manifest.outcome

    @property
    def detail(self) -> str:
        """Return the cause of an end before time, "" without one."""
        return self.record.manifest.outcome_detail

    @property
    def samples(self) -> Mapping[str, NDArray[np.float64]]:
        """Return the columns of the outer ticks by name, NaN where a value does not exist."""
        return self.record.samples

    @property
    def frames(self) -> Mapping[str, NDArray[np.float64]]:
        """Return the columns of the camera frames by name, NaN where a value does not exist."""
        return self.record.frames

    @property
    def events(self) -> tuple[Event, ...]:
        """Return what happened, with time (s), kind and text."""
        return self.record.events

    @property
    def figures(self) -> dict[str, float]:
        """Return every figure by name (docs/run-record.md), NaN where there is none."""
        return self.record.figures().values

    @property
    def requirements(self) -> tuple[Verdict, ...]:
        """Return the verdict on each requirement of the scenario."""
        return self.record.verdicts()

    @property
    def holds(self) -> bool:
        """Say whether the run came to its end and met every requirement."""
        return self.outcome == "complete" and all(item.holds for item in self.requirements)

    @property
    def problems(self) -> tuple[str, ...]:
        """Return a line for everything that is missing, cut off or altered in the record."""
        return self.record.problems

    def table(self) -> pa.Table:
        """Return the ticks as an Arrow table, null where a value does not exist.

        Each field's metadata has `unit`, `group` and `meaning`.
        """
        return _table(self.record.samples, SAMPLE_COLUMNS)

    def frames_table(self) -> pa.Table:
        """Return the camera frames as an Arrow table, as `table` does the ticks."""
        return _table(self.record.frames, FRAME_COLUMNS)

    def to_pandas(self) -> Any:
        """Return the ticks as a pandas DataFrame; raises BadInput where pandas is not installed."""
        return _to_pandas(self.table())

    def report(self, file: AnyPath) -> Path:
        """Write the HTML report of this run; return its path. Raises BadInput."""
        return _write(file, [self])

    def _repr_html_(self) -> str:
        return _inline([_study([self])])

    def __repr__(self) -> str:
        manifest = self.manifest
        verdict = "holds" if self.holds else "does not hold"
        return (
            f"<Run {manifest.scenario_name} on {manifest.target}, {manifest.outer} over "
            f"{manifest.inner}, seed {manifest.seed}: {self.outcome}, {verdict}>"
        )


@dataclass(frozen=True, slots=True)
class Comparison:
    """Runs of one scenario side by side. A notebook shows the report."""

    runs: tuple[Run, ...]
    study: Study

    @property
    def holds(self) -> bool:
        """Say whether every run came to its end and met every requirement."""
        return all(run.holds for run in self.runs)

    def to_json(self) -> dict[str, Any]:
        """Return what `hil compare --json` prints."""
        return self.study.to_json()

    def report(self, file: AnyPath) -> Path:
        """Write the HTML report; return its path. Raises BadInput."""
        return _write(file, self.runs)

    def _repr_html_(self) -> str:
        return _inline([self.study])


@dataclass(frozen=True, slots=True)
class Experiment:
    """Every run of a deck, in the order of scenarios and laws, and the report of all."""

    path: Path
    runs: tuple[Run, ...]
    studies: tuple[Study, ...]

    @property
    def report_path(self) -> Path:
        """Return the HTML report that was written."""
        return self.path / "report.html"

    @property
    def holds(self) -> bool:
        """Say whether every run came to its end and met every requirement."""
        return all(run.holds for run in self.runs)

    def _repr_html_(self) -> str:
        return _frame(self.report_path.read_text(encoding="utf-8"))


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
    camera: str | None = None,
    out: AnyPath | None = None,
    in_memory: bool = False,
    record_camera: bool = False,
    **overrides: Any,
) -> Run:
    """Run a scenario once and return its record, as `hil run` does.

    `outer` is the scenario's own law unless another one is named; `on` and `camera` are the target and
    camera as `--on` and `--camera` name them. The record goes to `out`, which must not exist or be empty
    (a new folder in runs/ without it), or nowhere with `in_memory`. Raises BadInput before anything moves.
    """
    from hil.runs.execute import execute, execute_in_memory, new_folder  # noqa: PLC0415 - loads the rigs

    spec = _spec(load_scenario(scenario, **overrides), outer, inner, on, camera, seed)
    if in_memory:
        if out is not None or record_camera:
            raise BadInput("run: in_memory keeps no files; leave out and record_camera away")
        return Run(execute_in_memory(spec))
    folder = Path(out) if out is not None else new_folder(f"{spec.scenario.name}-{spec.outer}")
    return Run(execute(replace(spec, out=folder, record_camera=record_camera)))


def experiment(
    deck: str | Deck | Sequence[str] = "thesis",
    laws: Iterable[str] | None = None,
    seed: int = 1,
    *,
    repeats: int = 1,
    inner: str = "asg-ism",
    on: str = "twin",
    camera: str | None = None,
    out: AnyPath | None = None,
    workers: int | None = None,
    **overrides: Any,
) -> Experiment:
    """Run every scenario of a deck with every law of it and write one report, as `hil experiment` does.

    `deck` is a built-in name, a TOML file, or a list of scenarios; `laws` (names or files) replace the
    deck's. Runs go side by side in `workers` processes (one a core without it); a script that calls this
    needs the usual `if __name__ == "__main__":`. With `workers=1` they go one after another in this
    process. The same call with the same `out` takes an interrupted experiment up. Raises BadInput.
    """
    from hil.report.html import write_report  # noqa: PLC0415 - loads the figures
    from hil.runs.execute import execute, new_folder  # noqa: PLC0415 - loads the rigs
    from hil.study import experiment as many  # noqa: PLC0415

    if repeats < 1 or (workers is not None and workers < 1):
        raise BadInput(f"experiment: repeats = {repeats}, workers = {workers}: at least 1 each")
    _check_seed(seed)
    chosen = _deck(deck, laws)
    conditions = many.Conditions(
        on, camera, inner, seed, repeats, tuple(_overrides(overrides)), "hil.experiment"
    )
    folder = Path(out) if out is not None else new_folder("experiment")
    specs = many.deck_specs(chosen, conditions, folder)
    todo = many.claim(folder, specs)
    if workers == 1:
        for spec in todo:
            execute(spec)
    else:
        many.run_all(todo, lambda _name, _t_s: None, workers)
    records = [read_run(spec.out) for spec in specs]
    studies = many.study_by_scenario(records)
    write_report(
        folder / "report.html",
        [item.comparison for item in studies],
        command=conditions.command,
        circle=many.circle_study(),
        repeats=[item.repeats for item in studies if item.repeats],
    )
    return Experiment(folder, tuple(Run(record) for record in records), tuple(studies))


def compare(*runs: Run | RunRecord | AnyPath) -> Comparison:
    """Return two or more runs of one scenario side by side, as `hil compare` does.

    Runs, or the folders of records. Raises BadInput when the runs had different tasks.
    """
    found = tuple(_run(item) for item in runs)
    return Comparison(found, _study(found, least=2))


def replay(
    run: Run | AnyPath, outer: str | None = None, *, recorded_code: bool = False, **overrides: Any
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
    return exact.replay(folder, outer, _overrides(overrides), recorded_code=recorded_code)


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
    camera: str | None = None,
    **overrides: Any,
) -> HilEnv:
    """Return a scenario as a Gymnasium environment (`hil.study.gym_env.HilEnv` says what is what).

    One step is one outer tick, the action is forward speed and turn rate, the rewards add up to minus
    the cost that `hil tune` minimises. Raises BadInput, also without the extra `gym`.
    """
    try:
        from hil.study.gym_env import HilEnv  # noqa: PLC0415 - needs an extra
    except ModuleNotFoundError as error:
        raise BadInput(
            f"make_env: {error.name} is not installed; pip install 'skid-steer-hil[gym]'"
        ) from None
    return HilEnv(_spec(load_scenario(scenario, **overrides), None, inner, on, camera, seed))


# -- inside ------------------------------------------------------------------------------------------


def _spec(
    scenario: Scenario, outer: Law | None, inner: str, on: str, camera: str | None, seed: int
) -> RunSpec:
    from hil.runs.execute import INNER_LAWS, RunSpec, camera_for  # noqa: PLC0415 - loads the rigs

    if inner not in INNER_LAWS:
        raise BadInput(f"inner = {inner!r}: no such wheel law; choose {' or '.join(INNER_LAWS)}")
    _check_seed(seed)
    return RunSpec(
        scenario=scenario,
        target=on,
        camera=camera_for(scenario, on, camera),
        outer=_law_name(scenario.control.outer if outer is None else outer),
        inner=inner,
        seed=seed,
        out=Path(),
        command="hil.run",
    )


def _check_seed(seed: int) -> None:
    if not 0 <= seed < 2**31:
        raise BadInput(f"seed = {seed}: must be from 0 to {2**31 - 1}")


def _law_name(outer: Law) -> str:
    if isinstance(outer, str):
        return OUTER_LAWS.get(outer).name
    for entry in OUTER_LAWS.entries():
        if entry.factory is outer:
            return entry.name
    name = getattr(outer, "__name__", repr(outer))
    raise BadInput(f"outer = {name}: not a registered law; decorate it: @hil.outer_law({name!r})")


def _deck(deck: str | Deck | Sequence[str], laws: Iterable[str] | None) -> Deck:
    if isinstance(deck, str):
        chosen = load_deck(deck)
    elif isinstance(deck, Deck):
        chosen = deck
    else:
        chosen = load.build(Deck, {"scenarios": list(deck)}, "deck")
    if laws is None:
        return chosen
    tree = {"scenarios": chosen.scenarios, "laws": [_law_name(law) for law in laws]}
    return load.build(Deck, tree, "deck")


def _overrides(values: Mapping[str, Any]) -> list[str]:
    """Return KEY=VALUE texts; a value is written as TOML."""
    return [f"{key.replace('__', '.')}={_toml(key, value)}" for key, value in values.items()]


def _toml(key: str, value: Any) -> str:
    if hasattr(value, "tolist"):  # NumPy's
        value = value.tolist()
    if isinstance(value, tuple):
        value = list(value)
    if not isinstance(value, str | bool | int | float | list):
        raise BadInput(
            f"{key} = {value!r}: a number, text, true or false, or a list of them is needed"
        )
    return json.dumps(value)  # of these, the text is the same in TOML


def _run(item: Run | RunRecord | AnyPath) -> Run:
    if isinstance(item, Run):
        return item
    return Run(item) if isinstance(item, RunRecord) else open_record(item)


def _study(runs: Sequence[Run], least: int = 1) -> Study:
    from hil.study.experiment import study  # noqa: PLC0415 - loads the rigs

    return study([run.record for run in runs], least)


def _write(file: AnyPath, runs: Sequence[Run]) -> Path:
    from hil.report.html import write_report  # noqa: PLC0415 - loads the figures

    found = _study(runs)
    repeats = [found.repeats] if found.repeats else []
    write_report(Path(file), [found.comparison], command="hil", repeats=repeats)
    return Path(file)


def _inline(studies: Sequence[Study]) -> str:
    from hil.report.html import render  # noqa: PLC0415 - loads the figures

    repeats = [item.repeats for item in studies if item.repeats]
    page = render([item.comparison for item in studies], command="hil", repeats=repeats)
    return _frame(page)


def _frame(page: str) -> str:
    """Return a page as a frame of its own, so that its styles and the notebook's stay apart."""
    return (
        f'<iframe srcdoc="{html.escape(page)}" title="report" loading="lazy" '
        'style="width:100%;height:40em;border:1px solid #ccc"></iframe>'
    )


def _table(columns: Mapping[str, NDArray[np.float64]], schema: Sequence[Any]) -> pa.Table:
    return arrow_table(dict(columns), [column for column in schema if column.name in columns])


def _to_pandas(table: pa.Table) -> Any:
    try:
        return table.to_pandas()
    except ModuleNotFoundError:
        raise BadInput("to_pandas: pandas is not installed; pip install pandas") from None
