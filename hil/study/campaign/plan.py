"""The campaign file: which values are varied how, and the list of runs that follows from it."""

from __future__ import annotations

import copy
import hashlib
import itertools
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationError, model_validator

from hil.config.base import PlainName, Section
from hil.config.control import OuterLawName
from hil.config.limits import check_board
from hil.config.load import build, load_scenario, put_value, read_tree
from hil.config.scenario import Scenario
from hil.core.errors import BadInput
from hil.core.figures import BY_NAME, Metric, require_known

Point = dict[str, Any]
InnerLawName = Literal["asg-ism", "pid"]


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
    return HOLDS if figure == HOLDS.name else BY_NAME[require_known(figure)]


class Range(Section):
    """Evenly spaced points from `first` to `last`, or in equal ratios."""

    first: float = Field(description="first point")
    last: float = Field(description="last point")
    count: int = Field(ge=2, le=10_000, description="points, both ends among them")
    scale: Literal["linear", "log"] = Field("linear", description="equal steps or equal ratios")

    @model_validator(mode="after")
    def _positive(self) -> Self:
        if self.scale == "log" and not (self.first > 0 and self.last > 0):
            raise ValueError("scale log needs first and last above 0")
        return self

    def points(self) -> list[float]:
        """Return the points; both ends are among them."""
        shares = [i / (self.count - 1) for i in range(self.count)]
        if self.scale == "log":
            return [self.first * (self.last / self.first) ** share for share in shares]
        return [self.first + (self.last - self.first) * share for share in shares]


class Distribution(Section):
    """One value drawn per draw: uniform or log-uniform in low..high, or normal within them."""

    kind: Literal["uniform", "loguniform", "normal"] = Field(description="of the distribution")
    low: float = Field(-math.inf, description="least value")
    high: float = Field(math.inf, description="largest value")
    mean: float = Field(0.0, description="of a normal one")
    sd: float = Field(1.0, gt=0, description="standard deviation of a normal one")

    model_config = Section.model_config | {"allow_inf_nan": True}

    @model_validator(mode="after")
    def _bounded(self) -> Self:
        if not self.low < self.high:
            raise ValueError("low must be below high")
        if self.kind != "normal" and not (math.isfinite(self.low) and math.isfinite(self.high)):
            raise ValueError(f"{self.kind} needs low and high")
        if self.kind == "loguniform" and self.low <= 0:
            raise ValueError("loguniform needs low above 0")
        return self

    def draw(self, rng: Random) -> float:
        """Return one value."""
        if self.kind == "uniform":
            return rng.uniform(self.low, self.high)
        if self.kind == "loguniform":
            return math.exp(rng.uniform(math.log(self.low), math.log(self.high)))
        return min(max(rng.gauss(self.mean, self.sd), self.low), self.high)


Axis = Annotated[Range | list[Any], Field(union_mode="left_to_right")]


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
    grid: dict[str, Axis] = Field(default_factory=dict, description="every combination")
    together: tuple[dict[str, list[Any]], ...] = Field(
        (), description="lists of equal length, taken in step"
    )
    random: dict[str, Distribution] = Field(
        default_factory=dict, description="values drawn by dotted key"
    )
    figures: tuple[str, ...] = Field(
        ("ise_m2_s", "pwm_variation_counts"), min_length=1, description="figures drawn, or holds"
    )

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        names = [*self.grid, *self.random, *itertools.chain(*self.together)]
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise ValueError(f"{sorted(twice)[0]} is varied twice")
        for table in self.together:
            if len({len(values) for values in table.values()}) != 1:
                raise ValueError(f"together {', '.join(table)}: lists differ in length")
        if self.draws > 1 and not self.random:
            raise ValueError("draws: there is nothing to draw without a table `random`")
        return self


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

    @property
    def digest(self) -> str:
        """Return what two campaigns share exactly when their runs are the same."""
        tree = {"file": self.file.model_dump(mode="json"), "base": self.base}
        return hashlib.sha256(json.dumps(tree, sort_keys=True).encode()).hexdigest()

    @property
    def axes(self) -> tuple[str, ...]:
        """Return the dotted names of everything that is varied."""
        tied = itertools.chain(*self.file.together)
        return (*self.file.grid, *tied, *self.file.random)

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
        return {
            name: distribution.draw(Random(f"{self.file.seed} {name} {draw}"))
            for name, distribution in self.file.random.items()
        }

    def jobs(self) -> list[Job]:
        """Return all runs in their order; laws of one seed stand beside each other."""
        file = self.file
        seeds = range(file.seed, file.seed + file.seeds)
        draws = [self.drawn(draw) for draw in range(file.draws)]
        runs = itertools.product(
            self.grid_points(), range(file.draws), seeds, file.outer, file.inner
        )
        return [
            Job(index, tuple((point | draws[draw]).items()), draw, seed, outer, inner)
            for index, (point, draw, seed, outer, inner) in enumerate(runs)
        ]

    def scenario(self, point: Sequence[tuple[str, Any]]) -> Scenario:
        """Return the scenario at a point; raises BadInput when a value is out of its bounds."""
        tree = copy.deepcopy(self.base)
        for name, value in point:
            put_value(tree, name, value)
        scenario = build(Scenario, tree, self.file.name)
        check_board(scenario.board)
        return scenario


def load_campaign(name_or_path: str) -> Campaign:
    """Return a built-in campaign or that of a file, every varied value checked; raises BadInput."""
    path = Path(name_or_path)
    tree = read_tree(name_or_path, "campaigns")
    for table in ("grid", "random"):
        if isinstance(tree.get(table), Mapping):
            tree[table] = _flat(tree[table])
    tree.setdefault("name", path.stem)
    file = _checked(tree, path)
    for figure in file.figures:
        metric_of(figure)
    name = file.scenario
    if name.endswith(".toml") and not Path(name).is_absolute():
        name = str(path.parent / name)
    base = load_scenario(name, file.set).model_dump(mode="json")
    campaign = Campaign(file, base)
    for axis, values in _all_values(campaign).items():
        for value in values:
            campaign.scenario([(axis, value)])
    return campaign


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
