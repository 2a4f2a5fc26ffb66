"""The campaign file: which values are varied how, and the list of runs that follows from it."""

from __future__ import annotations

import copy
import hashlib
import itertools
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Annotated, Any, Literal, Self, overload

from pydantic import AfterValidator, Field, ValidationError, model_validator

from hil.board.wheel_laws import WHEEL_LAWS, require_wheel_law
from hil.config.base import PlainName, Section
from hil.config.control import OuterLawName
from hil.config.gains import only_gains_of
from hil.config.load import build, load_scenario, put_value, read_tree
from hil.config.scenario import Scenario
from hil.core import figures
from hil.core.errors import BadInput
from hil.core.figures import BY_NAME, Metric
from hil.core.registries import FIGURES, Sources, adopt_sources, file_sources, source_digests
from hil.study.campaign.axes import Axis, Distribution, Range, spread_evenly

Point = dict[str, Any]


def _wheel_law(name: str) -> str:
    try:
        return require_wheel_law(name)
    except BadInput as error:
        raise ValueError(str(error)) from None


InnerLawName = Annotated[
    str, AfterValidator(_wheel_law), Field(json_schema_extra={"enum": list(WHEEL_LAWS)})
]


# Columns of the results beside what is varied and the figures.
ROW_COLUMNS = frozenset(
    {"index", "draw", "seed", "outer", "inner", "outcome", "detail", "holds", "t_end_s", "program"}
)
# Unlike the figures of a run, every run has it, also one that ended early.
HOLDS = Metric(
    "holds",
    "",
    "runs that met every requirement",
    "1 for a run that came to its end and met every requirement, else 0",
    "higher",
    shown=("%", 1e2),
)


def metric_of(figure: str) -> Metric:
    """Return a figure that a campaign can draw; raises BadInput with near names when unknown."""
    return HOLDS if figure == HOLDS.name else figures.metric_of(figure)


def _drawn(figure: str) -> str:
    try:
        return metric_of(figure).name
    except BadInput as error:
        raise ValueError(str(error)) from None


DrawnFigure = Annotated[str, AfterValidator(_drawn)]


class CampaignFile(Section):
    """A campaign: the grid's points x draws x seeds x laws; draws and seeds are common to all."""

    name: PlainName = Field(min_length=1, max_length=80, description="names the results' folder")
    scenario: str = Field(description="built-in name or TOML file")
    set: tuple[str, ...] = Field((), description="KEY=VALUE in force in every run")
    target: Literal["twin", "pil"] = Field("twin", description="simulated target")
    camera: Literal["pose", "rendered"] = Field("pose", description="drawn poses or pictures")
    outer: tuple[OuterLawName, ...] = Field(
        ("pid", "asg-ism"), min_length=1, description="outer laws"
    )
    inner: tuple[InnerLawName, ...] = Field(("asg-ism",), min_length=1, description="wheel laws")
    seed: int = Field(1, ge=0, description="first seed")
    seeds: int = Field(1, ge=1, le=100_000, description="seeds a point")
    draws: int = Field(1, ge=1, le=1_000_000, description="draws of `random` a point")
    sampling: Literal["random", "sobol", "latin"] = Field(
        "random",
        description="how `random` is drawn: independently, or spread evenly (scipy.stats.qmc)",
    )
    grid: dict[str, Axis] = Field(default_factory=dict, description="every combination")
    together: tuple[dict[str, list[Any]], ...] = Field(
        (), description="lists of equal length, taken in step"
    )
    random: dict[str, Distribution] = Field(
        default_factory=dict, description="values drawn by dotted key"
    )
    figures: tuple[DrawnFigure, ...] = Field(
        ("ise_m2_s", "pwm_variation_counts"), min_length=1,
        description="figures drawn: names, FILE.py[:NAME], or holds",
    )  # fmt: skip

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        names = [*self.grid, *self.random, *itertools.chain(*self.together)]
        _refuse_overlap(names, [text.partition("=")[0].strip() for text in self.set])
        lists = [*self.grid.items(), *itertools.chain(*(table.items() for table in self.together))]
        for name, values in lists:
            if isinstance(values, list) and not values:
                raise ValueError(f"{name} = []: at least one value is needed; give some or drop it")
        for table in self.together:
            if len({len(values) for values in table.values()}) != 1:
                raise ValueError(
                    f"together {', '.join(table)}: lists differ in length"
                    if table
                    else "together: an empty table; name lists in it or drop it"
                )
        for key in ("outer", "inner", "figures"):
            given = getattr(self, key)
            for value in given:
                if given.count(value) > 1:
                    raise ValueError(f"{key}: {value} is named twice; name it once")
        if self.draws > 1 and not self.random:
            raise ValueError("draws: there is nothing to draw without a table `random`")
        return self


def _refuse_overlap(varied: Sequence[str], fixed: Sequence[str]) -> None:
    """Raise ValueError when a value would be put over another: what is recorded were not in force."""
    paths = [(name, _parts(name)) for name in varied]
    for pair in itertools.combinations(paths, 2):
        (outer, short), (inner, long) = sorted(pair, key=lambda item: len(item[1]))
        if long == short:
            raise ValueError(f"{outer} is varied twice")
        if long[: len(short)] == short:
            raise ValueError(
                f"{inner} lies in {outer}, and both are varied: the one would replace the other; "
                f"give {outer} whole, with {inner} in it, or vary its values one by one"
            )
    for name, parts in paths:
        for key in fixed:
            if _parts(key)[: len(parts)] == parts:
                raise ValueError(f"set: {key} is varied as {name}; drop one of them")


def _parts(name: str) -> tuple[str | int, ...]:
    """Return the parts of a dotted name, indices as numbers."""
    return tuple(int(part) if part.isdecimal() else part for part in name.split("."))


def column_of(axis: str) -> str:
    """Return the column of the results that holds a varied value: its name, where no other column has that.

    `duration_s` as it was asked for is `scenario.duration_s`; the figure is how long a run lasted.
    """
    return f"scenario.{axis}" if axis in BY_NAME or axis in ROW_COLUMNS else axis


@dataclass(frozen=True, slots=True)
class Job:
    """One run of a campaign: its number, its values, its laws and its seed."""

    index: int
    point: tuple[tuple[str, Any], ...]
    draw: int
    seed: int
    outer: str
    inner: str


@dataclass(frozen=True, slots=True)
class Campaign:
    """A checked campaign with its scenario resolved, so that a worker needs no files."""

    file: CampaignFile
    base: dict[str, Any]

    def __reduce__(self) -> Any:
        """Pickle with the texts of what came from files: a worker gets to know it by them."""
        return _unpickled, (self.file.model_dump(mode="json"), self.base, file_sources())

    @property
    def digest(self) -> str:
        """Return what two campaigns share exactly when their runs are the same."""
        base = only_gains_of(self.base, self.file.outer)
        tree = {"file": self.file.model_dump(mode="json"), "base": base}
        own = [name for name in self.figures if name not in BY_NAME]
        texts = source_digests(self.file.outer) | source_digests(own, FIGURES)
        tree |= {"texts": texts} if texts else {}
        return hashlib.sha256(json.dumps(tree, sort_keys=True).encode()).hexdigest()

    @property
    def axes(self) -> tuple[str, ...]:
        """Return the dotted names of everything that is varied."""
        tied = itertools.chain(*self.file.together)
        return (*self.file.grid, *tied, *self.file.random)

    @property
    def figures(self) -> tuple[str, ...]:
        """Return the names of the figures that every run gives, the built-in ones first."""
        required = [item["metric"] for item in self.base["requirements"]]
        return tuple(dict.fromkeys((*BY_NAME, *self.base["figures"], *required)))

    def grid_points(self) -> list[Point]:
        """Return every combination of grid and lists."""
        axes: list[list[Point]] = [
            [{name: value} for value in _values(axis)] for name, axis in self.file.grid.items()
        ]
        for table in self.file.together:
            rows = zip(*table.values(), strict=True)
            axes.append([dict(zip(table, row, strict=True)) for row in rows])
        return [dict(itertools.chain(*(d.items() for d in c))) for c in itertools.product(*axes)]

    def drawn(self, draw: int) -> Point:
        """Return draw number `draw`, the same at every point of the grid."""
        if self.file.sampling != "random":
            shares = spread_evenly(
                self.file.sampling, len(self.file.random), self.file.draws, self.file.seed
            )
            return {
                name: distribution.quantile(shares[draw][place])
                for place, (name, distribution) in enumerate(self.file.random.items())
            }
        return {
            name: distribution.draw(Random(f"{self.file.seed} {name} {draw}"))
            for name, distribution in self.file.random.items()
        }

    def jobs(self) -> Jobs:
        """Return all runs in their order; laws of one seed stand beside each other."""
        return Jobs(self)

    def scenario(self, point: Sequence[tuple[str, Any]]) -> Scenario:
        """Return the scenario at a point; raises BadInput when a value is out of its bounds."""
        tree = copy.deepcopy(self.base)
        for name, value in point:
            put_value(tree, name, value)
        return build(Scenario, tree, self.file.name)


class Jobs(Sequence[Job]):
    """All runs of a campaign, each made when it is asked for: there may be a million."""

    def __init__(self, campaign: Campaign) -> None:
        file = campaign.file
        self._points = campaign.grid_points()
        self._draws = [campaign.drawn(draw) for draw in range(file.draws)]
        self._seeds = range(file.seed, file.seed + file.seeds)
        self._arms = list(itertools.product(file.outer, file.inner))

    def __len__(self) -> int:
        """Return how many runs there are."""
        return len(self._points) * len(self._draws) * len(self._seeds) * len(self._arms)

    @overload
    def __getitem__(self, place: int) -> Job: ...
    @overload
    def __getitem__(self, place: slice) -> list[Job]: ...
    def __getitem__(self, place: int | slice) -> Job | list[Job]:
        """Return one run, or some."""
        if isinstance(place, slice):
            return [self._job(index) for index in range(len(self))[place]]
        return self._job(range(len(self))[place])

    def _job(self, index: int) -> Job:
        rest, arm = divmod(index, len(self._arms))
        rest, seed = divmod(rest, len(self._seeds))
        point, draw = divmod(rest, len(self._draws))
        values = self._points[point] | self._draws[draw]
        return Job(index, tuple(values.items()), draw, self._seeds[seed], *self._arms[arm])


def _unpickled(file: dict[str, Any], base: dict[str, Any], sources: Sources) -> Campaign:
    adopt_sources(sources)
    return Campaign(CampaignFile.model_validate(file), base)


def load_campaign(name_or_path: str) -> Campaign:
    """Return a built-in campaign or that of a file, every varied value checked; raises BadInput."""
    path = Path(name_or_path)
    tree = read_tree(name_or_path, "campaigns")
    for table in ("grid", "random"):
        if isinstance(tree.get(table), Mapping):
            tree[table] = _flat(tree[table])
    tree.setdefault("name", path.stem)
    file = _checked(tree, path)
    name = file.scenario
    if name.endswith(".toml") and not Path(name).is_absolute():
        name = str(path.parent / name)
    scenario = load_scenario(name, file.set)
    own = (name for name in file.figures if name != HOLDS.name and name not in BY_NAME)
    asked = tuple(dict.fromkeys((*scenario.figures, *own)))
    base = scenario.model_copy(update={"figures": asked}).model_dump(mode="json")
    campaign = Campaign(file, base)
    _refuse_taken_names(campaign, path)
    for axis, values in _all_values(campaign).items():
        for value in values:
            campaign.scenario([(axis, value)])
    for axis, grid in file.grid.items():
        _refuse_twice(campaign, [[(axis, value)] for value in _values(grid)], path)
    for lists in file.together:
        rows = zip(*lists.values(), strict=True)
        _refuse_twice(campaign, [list(zip(lists, row, strict=True)) for row in rows], path)
    return campaign


def _refuse_taken_names(campaign: Campaign, path: Path) -> None:
    """Raise BadInput where a varied value has the name of a figure of one's own."""
    for name in campaign.axes:
        if column_of(name) in campaign.figures:
            raise BadInput(
                f"{path}: {name}: cannot be varied beside a figure of this name: the two would be one "
                "column; rename the figure"
            )


def _refuse_twice(
    campaign: Campaign, points: Sequence[Sequence[tuple[str, Any]]], path: Path
) -> None:
    """Raise BadInput when two of the points are one: their runs would be copies of each other."""
    seen: dict[str, Sequence[tuple[str, Any]]] = {}
    for point in points:
        try:
            key = campaign.scenario(point).model_dump_json()
        except BadInput:  # refused together only: such rows say so by themselves
            continue
        if key in seen:
            told = " and ".join(
                ", ".join(f"{name} = {value}" for name, value in one) for one in (seen[key], point)
            )
            raise BadInput(
                f"{path}: {told} are the same; give each value once, more seeds for more runs"
            )
        seen[key] = point


def _checked(tree: dict[str, Any], path: Path) -> CampaignFile:
    try:
        return CampaignFile.model_validate(tree)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        said = first["msg"].removeprefix("Value error, ")
        raise BadInput(f"{path}: {key or 'campaign'}: {said[:1].lower()}{said[1:]}") from None


def _flat(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return nested tables under dotted names: [grid.link] latency_s is grid."link.latency_s"."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        name = f"{prefix}{key}"
        leaf = not isinstance(value, Mapping) or "kind" in value or "first" in value
        found |= {name: value} if leaf else _flat(value, f"{name}.")
    return found


def _values(axis: Range | list[Any]) -> list[Any]:
    return axis.points() if isinstance(axis, Range) else axis


def _all_values(campaign: Campaign) -> dict[str, list[Any]]:
    """Return every value of each axis, and of each distribution the first draws."""
    values = {name: _values(axis) for name, axis in campaign.file.grid.items()}
    for table in campaign.file.together:
        values |= table
    for draw in range(min(campaign.file.draws, 20)):
        for name, value in campaign.drawn(draw).items():
            values.setdefault(name, []).append(value)
    return values
