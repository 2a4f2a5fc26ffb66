"""A deck: the scenarios of one experiment and the outer laws each is run with."""

from __future__ import annotations

from pydantic import Field

from hil.config.base import Section
from hil.config.control import OuterLawName
from hil.config.load import build, read_tree


class Deck(Section):
    """Scenario names or files, and outer laws; every scenario runs with every law."""

    scenarios: tuple[str, ...] = Field(min_length=1, description="built-in names or TOML files")
    laws: tuple[OuterLawName, ...] = Field(("pid", "asg-ism"), min_length=1)


def load_deck(name_or_path: str) -> Deck:
    """Return a built-in deck or one from a TOML file; raises BadInput."""
    return build(Deck, read_tree(name_or_path, "decks"), name_or_path)
