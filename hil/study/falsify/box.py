"""The box: what a search for a counterexample may change, between which bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

from pydantic import Field, model_validator

from hil.config.base import Section, quantity
from hil.config.events import Disturbance, Shape, Target
from hil.config.load import build, dotted_names, put_value, read_tree
from hil.config.scenario import Scenario
from hil.core.errors import BadInput
from hil.study.falsify.moved import moved_requirements

DEFAULT = "default"


class Range(Section):
    """Between which bounds one value may lie."""

    low: float = quantity("", "least value, or least offset, in the key's unit")
    high: float = quantity("", "largest value, or largest offset, in the key's unit")
    offset: bool = Field(False, description="bounds count from the scenario's own value")

    @model_validator(mode="after")
    def _has_width(self) -> Self:
        if not self.low < self.high:
            raise ValueError(f"low = {self.low:g} must be below high = {self.high:g}")
        return self


class Push(Section):
    """A disturbance whose amplitude is searched; at 0 there is none."""

    target: Target = Field(description="what it acts on")
    shape: Shape = Field(description="its course in time")
    least: float = quantity("", "least amplitude, in the unit of the target", 0.0, le=0)
    largest: float = quantity("", "largest amplitude, in the unit of the target", gt=0, le=1000)
    start_s: float = quantity("s", "in force from then on", 0.0, ge=0, le=3600)
    end_s: float | None = quantity("s", "None: to the end of the run", None, gt=0, le=3600)
    frequency_hz: float = quantity("Hz", "of a sine, or top of a noise", 0.5, gt=0, le=200)

    def at(self, amplitude: float) -> dict[str, Any]:
        """Return the disturbance of an amplitude."""
        tree = self.model_dump(exclude={"least", "largest"}) | {"amplitude": amplitude}
        return Disturbance.model_validate(tree).model_dump(mode="json")


class BoxFile(Section):
    """What `hil falsify` may change: ranges of values by dotted name, and disturbances."""

    range: dict[str, Range] = Field(
        default_factory=dict, description="bounds by dotted name, as --set takes them"
    )
    disturbance: tuple[Push, ...] = Field((), description="disturbances that may be added")

    @model_validator(mode="after")
    def _holds_something(self) -> Self:
        if not self.range and not self.disturbance:
            raise ValueError("neither [range] nor [[disturbance]]: there is nothing to search")
        return self


@dataclass(frozen=True, slots=True)
class Axis:
    """One value that is searched: its bounds and what it is in the scenario as it stands."""

    key: str
    low: float
    high: float
    usual: float
    push: Push | None = None

    @property
    def usual_share(self) -> float:
        """Return where the usual value lies between the bounds, 0 to 1."""
        return (self.usual - self.low) / (self.high - self.low)

    def value(self, share: float) -> float:
        """Return the value at a share of the way between the bounds, to 4 digits; the usual at its own."""
        if share == self.usual_share:
            return self.usual
        return float(f"{self.low + min(max(share, 0.0), 1.0) * (self.high - self.low):.4g}")


@dataclass(frozen=True, slots=True)
class Box:
    """The axes of a scenario's box."""

    scenario: Scenario
    axes: tuple[Axis, ...]

    @property
    def usual(self) -> tuple[float, ...]:
        """Return the scenario itself as a point of the box."""
        return tuple(axis.usual_share for axis in self.axes)

    def departures(self, point: Sequence[float]) -> dict[str, float]:
        """Return what a point changes: value by key."""
        return {
            axis.key: axis.value(share)
            for axis, share in zip(self.axes, point, strict=True)
            if axis.value(share) != axis.usual
        }

    def tree_at(self, point: Sequence[float]) -> dict[str, Any]:
        """Return the scenario's tree at a point; requirements on where it begins move with its start."""
        usual = self.scenario.model_dump(mode="json")
        tree = self.scenario.model_dump(mode="json")
        for axis, share in zip(self.axes, point, strict=True):
            value = axis.value(share)
            if value == axis.usual:
                continue
            if axis.push is not None:
                tree["disturbances"].append(axis.push.at(value))
            elif axis.key.startswith("mismatch."):
                tree["mismatch"][axis.key.removeprefix("mismatch.")] = value
            else:
                put_value(tree, axis.key, value)
        return tree | {"requirements": moved_requirements(usual, tree)}

    def at(self, point: Sequence[float]) -> Scenario:
        """Return the scenario at a point; raises BadInput where its values do not go together."""
        return build(Scenario, self.tree_at(point), "box")


def load_box(name_or_path: str, scenario: Scenario) -> Box:
    """Return a box, built in or from a TOML file, for a scenario; raises BadInput.

    Bounds are widened to the scenario's own value where that lies outside. Of the default box, keys
    that the scenario does not have are left out.
    """
    file = build(BoxFile, read_tree(name_or_path, "boxes"), name_or_path)
    tree = scenario.model_dump(mode="json")
    axes = []
    for key, bounds in file.range.items():
        usual = _usual(tree, key)
        if usual is None:
            if name_or_path == DEFAULT:
                continue
            names = ", ".join(
                name for name in dotted_names(tree) if name.split(".")[0] == key.split(".")[0]
            )
            raise BadInput(
                f"{name_or_path}: range.{key}: {scenario.name} has no such number; near: {names[:200]}"
            )
        base = usual if bounds.offset else 0.0
        low, high = min(base + bounds.low, usual), max(base + bounds.high, usual)
        axes.append(Axis(key, low, high, usual))
    for push in file.disturbance:
        axes.append(Axis(f"disturbance.{push.target}", push.least, push.largest, 0.0, push))
    if not axes:
        raise BadInput(f"{name_or_path}: {scenario.name} has none of its keys: nothing to search")
    return Box(scenario, tuple(axes))


def _usual(tree: Mapping[str, Any], key: str) -> float | None:
    """Return a number of the scenario by its dotted name; a mismatch that is not named is 1."""
    if key.startswith("mismatch."):
        return float(tree["mismatch"].get(key.removeprefix("mismatch."), 1.0))
    node: Any = tree
    for part in key.split("."):
        node = node.get(part) if isinstance(node, dict) else None
    return float(node) if isinstance(node, int | float) and not isinstance(node, bool) else None
