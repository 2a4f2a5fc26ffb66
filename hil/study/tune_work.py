"""What a search is about, and what it keeps on disk so that it can be stopped and gone on with.

FILE.search beside the gain set FILE has one line per run that was made, as it came; the search is
deterministic, so that the same command, given them back, goes on where it was stopped and ends with
the same gain set. It is removed when the gain set is written.
"""

from __future__ import annotations

import hashlib
import json
import zlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import IO, Any, Self

from hil.analysis.costs import COST_WEIGHTS, Figures
from hil.config.control import ControlConfig, PointReference
from hil.config.deck import CALM, Cell, Deck, load_deck
from hil.config.gains import Gains, only_gains_of
from hil.config.load import builtin_names, load_scenario
from hil.config.scenario import Scenario
from hil.core.errors import BadInput
from hil.core.files import read_toml
from hil.core.registries import OUTER_LAWS, TUNING_COSTS, source_digests
from hil.core.toml_text import toml_value
from hil.study.suite import refuse_seen, spread_over
from hil.study.tune import (
    CASES,
    SEARCH,
    Case,
    Plan,
    Trial,
    Variant,
    boxes_of,
)
from hil.study.tuning_verdict import ALL_SCENARIOS, HELD_OUT_SCENARIOS, JUDGED

_FORMAT = "hil-tune-1"
_KEPT = frozenset((*COST_WEIGHTS, *JUDGED))  # enough for the usual cost
# Cells of a deck that each candidate runs, spread over its tasks and conditions.
SEARCHED_CELLS = 8
_VARIANTS: tuple[Variant, ...] = ("calm", "pushed", "late", "beside")


@dataclass(frozen=True, slots=True)
class Tasks:
    """The scenarios that gains are searched and judged on; `own` where they are not the usual ones."""

    scenarios: Mapping[str, Scenario]
    own: bool
    robot: str | None
    unseen: Mapping[str, Scenario] = field(default_factory=dict)
    calm: Mapping[str, Scenario] = field(default_factory=dict)
    conditions: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Return the scenarios' names."""
        return tuple(self.scenarios)

    @property
    def judged(self) -> tuple[str, ...]:
        """Return the names of what the result is judged on: unseen tasks, where a deck has them."""
        return tuple(self.unseen) or self.names

    @property
    def known(self) -> dict[str, Scenario]:
        """Return every scenario that is run: searched, judged, or that costs are normalised by."""
        return {**self.scenarios, **self.unseen, **self.calm}

    @property
    def base(self) -> Gains:
        """Return the gains that hold what is not searched."""
        first = next(iter(self.scenarios.values()))
        return first.control.active_gains if self.own else ControlConfig().active_gains

    @property
    def origin(self) -> dict[str, str]:
        """Return what a gain set says of tasks of its own."""
        if not self.own:
            return {}
        first = next(iter(self.scenarios.values()))
        trees = [only_gains_of(tree, ()) for tree in self.trees.values()]
        return {"robot": first.robot.name, "tasks_sha256": _digest(trees)}

    @property
    def trees(self) -> dict[str, Any]:
        """Return every resolved value of the scenarios."""
        return _trees(self.scenarios)

    def cases(self) -> tuple[Case, ...]:
        """Return the runs of a candidate: the usual ones, or each task in all its variants.

        A task whose reference is no point has no place beside it. The variants of a task go over
        the two wheel laws in turn.
        """
        if self.names == HELD_OUT_SCENARIOS:
            return CASES
        found = []
        if self.conditions:  # the deck says in which conditions a task is run
            return tuple(
                Case(name, "calm", ("asg-ism", "pid")[i % 2]) for i, name in enumerate(self.names)
            )
        for i, (name, task) in enumerate(self.scenarios.items()):
            point = isinstance(task.reference, PointReference)
            variants = _VARIANTS if point else _VARIANTS[:-1]
            found += [
                Case(name, variant, ("asg-ism", "pid")[(i + j) % 2])
                for j, variant in enumerate(variants)
            ]
        return tuple(found)


def _trees(scenarios: Mapping[str, Scenario]) -> dict[str, Any]:
    return {name: task.model_dump(mode="json") for name, task in scenarios.items()}


def load_tasks(names: Sequence[str], robot: str | None, overrides: Sequence[str] = ()) -> Tasks:
    """Return the tasks of scenario names or files, or of one deck; the usual ones without any.

    `robot` is a built-in robot or a file, which takes the place of each scenario's own, as `--set
    robot.file` does: with its board and gains, below what else is set and below a deck's conditions. Raises
    BadInput.
    """
    if robot is not None:
        if twice := [text for text in overrides if text.partition("=")[0].strip() == "robot.file"]:
            raise BadInput(
                f"--robot {robot}, --set {twice[0]}: both name the robot; give one of them"
            )
        overrides = (f"robot.file={toml_value(robot)}", *overrides)
    if len(names) == 1 and _is_deck(names[0]):
        deck = load_deck(names[0])
        if deck.conditions:
            return _of_deck(deck, names[0], robot, overrides)
        names = deck.scenarios
    own = bool(names or robot or overrides)
    scenarios: dict[str, Scenario] = {}
    for name in names or HELD_OUT_SCENARIOS:
        task = load_scenario(name, overrides)
        if task.name in scenarios or task.name == ALL_SCENARIOS:
            raise BadInput(
                f"{name}: its name = {task.name!r} is taken; give each scenario a name of its own"
            )
        scenarios[task.name] = task
    return Tasks(scenarios, own, robot)


def _of_deck(deck: Deck, name: str, robot: str | None, overrides: Sequence[str]) -> Tasks:
    """Return the tasks of a deck with conditions: what a search sees, and what judges it."""
    if deck.search is None:
        raise BadInput(
            f"{name}: has conditions and no [search], so every task would be searched and judged alike; "
            "say in [search] which scenarios and conditions a search may see"
        )
    seen = spread_over(deck.search_cells(), SEARCHED_CELLS)
    refuse_seen(deck.unseen_cells(), deck.search_cells())

    def loaded(cells: Sequence[Cell]) -> dict[str, Scenario]:
        found = (deck.scenario_of(cell, overrides) for cell in cells)
        return {task.name: task for task in found}

    calm = loaded([Cell(scenario=name, condition=CALM) for name in deck.scenarios])
    return Tasks(loaded(seen), True, robot, loaded(deck.unseen_cells()), calm, conditions=True)


def _is_deck(name: str) -> bool:
    if name in builtin_names("decks"):
        return True
    with suppress(BadInput):
        return "scenarios" in read_toml(Path(name))
    return False


class Journal:
    """The runs of a search on disk, by what they were runs of."""

    def __init__(
        self, path: Path, identity: Mapping[str, Any], *, every_figure: bool = False
    ) -> None:
        self.path = path
        self._every_figure = every_figure
        self.notes: list[str] = []
        self._known: dict[str, Figures] = {}
        fresh = not self._take_up(dict(identity))
        self._file: IO[str] = path.open("w" if fresh else "a", encoding="utf-8")
        if fresh:
            self._write({"format": _FORMAT, "identity": dict(identity)})

    def __enter__(self) -> Self:
        """Return the journal."""
        return self

    def __exit__(self, *_exc: object) -> None:
        """Close it; what is in it stays."""
        self._file.close()

    def __len__(self) -> int:
        """Return the runs that are there already."""
        return len(self._known)

    def _take_up(self, identity: dict[str, Any]) -> bool:
        """Read what an interrupted search left; say whether there is one of the same identity."""
        if not self.path.exists():
            return False
        lines = self.path.read_text(encoding="utf-8", errors="replace").splitlines()
        trees = [_parsed(line) for line in lines]
        head = trees[0] if trees else None
        if head is None or head.get("format") != _FORMAT:
            aside = self.path.replace(self.path.with_name(f"{self.path.name}.damaged"))
            self.notes.append(f"{self.path}: damaged at its beginning; kept as {aside}, begun anew")
            return False
        for key, value in identity.items():
            if head["identity"].get(key) != value:
                raise BadInput(
                    f"{self.path}: is what another search left (its {key} differs: "
                    f"{_short(head['identity'].get(key))}, now {_short(value)}); give the command "
                    "that began it, delete the file, or name another --out"
                )
        damaged = sum(tree is None for tree in trees[1:])
        if damaged:
            self.notes.append(f"{self.path}: {damaged} damaged lines; their runs are made again")
        self._known = {tree["run"]: tree["figures"] for tree in trees[1:] if tree is not None}
        if lines and not self.path.read_bytes().endswith(b"\n"):
            with self.path.open("a", encoding="utf-8") as file:
                file.write("\n")
        return True

    def make(
        self,
        trials: Sequence[Trial],
        run: Callable[[Sequence[Trial], Callable[[int, Figures], None]], object],
        done: Callable[[], None],
    ) -> list[Figures]:
        """Return the figures of each trial; `run` makes those that are not there yet.

        `run` gets the trials to make and what to call with the place and figures of each; `done` is
        called for every trial.
        """
        keys = [_key(trial) for trial in trials]
        missing = [place for place, key in enumerate(keys) if key not in self._known]
        for _ in range(len(trials) - len(missing)):
            done()

        def made(place: int, figures: Figures) -> None:
            key = keys[missing[place]]
            self._known[key] = {
                name: figures[name] for name in figures if self._every_figure or name in _KEPT
            }
            self._write({"run": key, "figures": self._known[key]})
            done()

        if missing:
            run([trials[place] for place in missing], made)
        return [self._known[key] for key in keys]

    def _write(self, tree: Mapping[str, Any]) -> None:
        text = json.dumps(tree)
        self._file.write(f"{zlib.crc32(text.encode()):08x} {text}\n")
        self._file.flush()

    def remove(self) -> None:
        """Remove it: the gain set is written."""
        self._file.close()
        self.path.unlink(missing_ok=True)


def identity_of(
    tasks: Tasks, plan: Plan, camera: str, program: str, laws: Sequence[str] = tuple(SEARCH)
) -> dict[str, Any]:
    """Return what decides the runs of a search; a larger budget is the same search gone on with."""
    searched: dict[str, Any] = {
        "boxes": boxes_of(laws),
        "cost": COST_WEIGHTS if plan.cost.is_usual else plan.cost.name,
        "cases": [str(c) for c in plan.cases],
    }
    texts = source_digests(laws) | source_digests([plan.cost.name], TUNING_COSTS)
    searched |= {"texts": texts} if texts else {}
    return {
        "camera": camera,
        "seed": plan.search_seed,
        "seeds": list(plan.seeds),
        "population": plan.population,
        "tasks": _digest([only_gains_of(tree, laws) for tree in _trees(tasks.known).values()]),
        "gains kept": _digest(_tables_of(tasks.base, laws)),
        "procedure": _digest(searched),
        "program": program,
    }


def _key(trial: Trial) -> str:
    gains = _tables_of(trial.gains, [trial.outer])
    return _digest([trial.outer, gains, asdict(trial.case), trial.seed])[:24]


def _tables_of(gains: Gains, laws: Sequence[str]) -> dict[str, Any]:
    """Return the gains of some laws: which others are known differs from process to process."""
    return gains.model_dump(mode="json", include={OUTER_LAWS.get(name).key for name in laws})


def _digest(tree: object) -> str:
    return hashlib.sha256(json.dumps(tree, sort_keys=True).encode()).hexdigest()


def _parsed(line: str) -> dict[str, Any] | None:
    """Return a whole line's content, None for a torn or damaged one."""
    crc, _, text = line.partition(" ")
    if crc != f"{zlib.crc32(text.encode()):08x}":
        return None
    tree: dict[str, Any] = json.loads(text)
    return tree


def _short(value: object) -> str:
    return repr(value)[:60]
