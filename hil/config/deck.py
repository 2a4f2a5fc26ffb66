"""A deck: the scenarios of one experiment and the outer laws each is run with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

from pydantic import Field, model_validator

from hil.config.base import Section
from hil.config.control import OuterLawName
from hil.config.load import build, read_tree


class Deck(Section):
    """Scenario names or files, and outer laws; every scenario runs with every law."""

    scenarios: tuple[str, ...] = Field(min_length=1, description="built-in names or TOML files")
    laws: tuple[OuterLawName, ...] = Field(
        ("pid", "asg-ism"), min_length=1, description="outer laws, each once"
    )

    @model_validator(mode="after")
    def _names_each_once(self) -> Self:
        for what, names in (("scenarios", self.scenarios), ("laws", self.laws)):
            twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
            if twice:
                raise ValueError(f"{what}: {twice[0]!r} is listed {names.count(twice[0])} times")
        return self


def load_deck(name_or_path: str, laws: Sequence[str] = ()) -> Deck:
    """Return a built-in deck or one from a TOML file; raises BadInput.

    `laws` take the place of its own: names, or files.
    """
    tree = read_tree(name_or_path, "decks")
    return build(Deck, tree | {"laws": list(laws)} if laws else tree, name_or_path)
