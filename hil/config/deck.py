"""A deck: the scenarios of one experiment, the conditions they are run in, and the outer laws of each."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any, Self

from pydantic import Field, model_validator

from hil.config.base import PlainName, Section
from hil.config.control import OuterLawName
from hil.config.events import Disturbance
from hil.config.load import build, load_scenario, put_value, read_tree
from hil.config.scenario import Scenario
from hil.core.files import is_file

CALM = "calm"


class Condition(Section):
    """What is changed in a scenario: values by dotted name, and disturbances beside its own."""

    set: dict[str, Any] = Field(
        default_factory=dict, description="values by dotted name, as --set takes them"
    )
    disturbances: tuple[Disturbance, ...] = Field((), description="beside those of the scenario")


class SearchSplit(Section):
    """What searches may see; whatever is named here no verdict is spoken on."""

    scenarios: tuple[str, ...] = Field(min_length=1, description="scenarios that searches may see")
    conditions: tuple[str, ...] = Field(
        (), description="conditions that searches may see; calm is one of them"
    )


class Cell(Section):
    """A scenario of a deck in one of its conditions."""

    scenario: str = Field(description="name or file, as the deck has it")
    condition: str = Field(description="name of the condition")

    def __str__(self) -> str:
        return f"{self.scenario} in {self.condition}"


class Deck(Section):
    """Scenario names or files, and outer laws; every scenario runs with every law in every condition.

    With `search` the deck is split: searches see only scenarios and conditions that it names, and a
    verdict is spoken only on scenarios and conditions that it does not.
    """

    scenarios: tuple[str, ...] = Field(min_length=1, description="built-in names or TOML files")
    laws: tuple[OuterLawName, ...] = Field(
        ("pid", "asg-ism"), min_length=1, description="outer laws, each once"
    )
    conditions: dict[PlainName, Condition] = Field(
        default_factory=dict, description="what each scenario is run in; none: as it is (calm)"
    )
    search: SearchSplit | None = Field(None, description="what searches may see")

    @model_validator(mode="after")
    def _names_each_once(self) -> Self:
        for what, names in (("scenarios", self.scenarios), ("laws", self.laws)):
            twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
            if twice:
                raise ValueError(f"{what}: {twice[0]!r} is listed {names.count(twice[0])} times")
        return self

    @model_validator(mode="after")
    def _split_leaves_both_sides(self) -> Self:
        if self.search is None:
            return self
        for what, seen, known in (
            ("scenarios", self.search.scenarios, self.scenarios),
            ("conditions", self.search.conditions, self.condition_names),
        ):
            for name in seen:
                if name not in known:
                    raise ValueError(f"search.{what}: {name!r} is none of the deck's {what}")
            if set(seen) == set(known):
                raise ValueError(
                    f"search.{what}: names all of them: nothing unseen is left to judge on"
                )
        return self

    @property
    def condition_names(self) -> tuple[str, ...]:
        """Return the conditions' names; calm alone where the deck names none."""
        return tuple(self.conditions) or (CALM,)

    def cells(self) -> list[Cell]:
        """Return every scenario in every condition."""
        return _cells(self.scenarios, self.condition_names)

    def search_cells(self) -> list[Cell]:
        """Return what a search may see; all of an unsplit deck."""
        if self.search is None:
            return self.cells()
        return _cells(self.search.scenarios, self.search.conditions)

    def unseen_cells(self) -> list[Cell]:
        """Return scenarios and conditions of which a search sees neither; none of an unsplit deck."""
        if self.search is None:
            return []
        seen = self.search
        return _cells(
            [name for name in self.scenarios if name not in seen.scenarios],
            [name for name in self.condition_names if name not in seen.conditions],
        )

    def scenario_of(self, cell: Cell, overrides: Sequence[str] = ()) -> Scenario:
        """Return the scenario of a cell, named after both; raises BadInput."""
        scenario = load_scenario(cell.scenario, overrides)
        condition = self.conditions.get(cell.condition, Condition())
        named = scenario.name if not self.conditions else f"{scenario.name}-in-{cell.condition}"
        tree = scenario.model_dump(mode="json") | {"name": named}
        for key, value in condition.set.items():
            if key.startswith("mismatch."):
                tree["mismatch"][key.removeprefix("mismatch.")] = value
            else:
                put_value(tree, key, value)
        tree["disturbances"] += [one.model_dump(mode="json") for one in condition.disturbances]
        return build(Scenario, tree, f"{cell}")


def _cells(scenarios: Sequence[str], conditions: Sequence[str]) -> list[Cell]:
    return [Cell(scenario=a, condition=b) for a, b in product(scenarios, conditions)]


def _beside(folder: Path, name: Any) -> Any:
    """Return the path of a scenario's file that is not here but beside the deck; else as it is."""
    if isinstance(name, str) and name.endswith(".toml") and not is_file(Path(name)):
        return str(folder / name) if is_file(folder / name) else name
    return name


def load_deck(name_or_path: str, laws: Sequence[str] = ()) -> Deck:
    """Return a built-in deck or one from a TOML file; raises BadInput.

    `laws` take the place of its own: names, or files. Files of scenarios are looked for here, then beside
    the deck.
    """
    tree = read_tree(name_or_path, "decks")
    if name_or_path.endswith(".toml"):
        folder = Path(name_or_path).parent
        for table in (tree, tree.get("search", {})):
            names = table.get("scenarios") if isinstance(table, dict) else None
            if isinstance(names, list):
                table["scenarios"] = [_beside(folder, name) for name in names]
    return build(Deck, tree | {"laws": list(laws)} if laws else tree, name_or_path)
