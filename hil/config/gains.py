"""The gains of all outer laws, as named sets; each law's own model says what its gains are."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

from pydantic import (
    BaseModel,
    Field,
    SerializeAsAny,
    create_model,
)  # fmt: skip

from hil.config.base import OpenSection, Section
from hil.core.files import parse_toml
from hil.core.registries import OUTER_LAWS
from hil.core.registry import Box, Entry, SourceText

_models: dict[tuple[tuple[str, type[BaseModel]], ...], type[Gains]] = {}


class Gains(OpenSection):
    """One named set: a table of gains for each outer law that is known, and where they come from."""

    origin: dict[str, str | int | float] = Field(
        default_factory=dict, description="procedure, budget, seed, cost, revision; or the source"
    )

    @classmethod
    def model_for(cls, tree: Any) -> type[BaseModel]:  # noqa: ARG003 - whatever the tables are
        """Return the model with a table for every outer law that is registered now."""
        return gains_model()

    @classmethod
    def models(cls) -> list[type[BaseModel]]:
        """Return the one model there is."""
        return [gains_model()]

    def __reduce__(self) -> Any:
        """Pickle as tables, with the texts of laws from files: the model is made where it arrives."""
        sources = [entry.source for entry in OUTER_LAWS.entries() if entry.source is not None]
        return _unpickled, (self.model_dump(), sources)

    def of(self, law: Entry) -> Any:
        """Return the gains of one law, None when it has none; a law loaded later has its defaults."""
        if law.settings is None:
            return None
        known = getattr(self, law.key, None)
        return getattr(make_gains(self.model_dump()), law.key) if known is None else known

    def with_values(self, law: Entry, values: Mapping[str, float]) -> Gains:
        """Return the set with some gains of one law replaced; raises pydantic's ValidationError."""
        tree = self.model_dump()
        tree[law.key] = self.of(law).model_dump() | dict(values)
        return make_gains(tree)


def _unpickled(tables: dict[str, Any], sources: Sequence[SourceText]) -> Gains:
    """Return a gain set in another process, which gets to know the laws from files by it."""
    for source in sources:
        OUTER_LAWS.adopt(source)
    return make_gains(tables)


def gains_model() -> type[Gains]:
    """Return the model of a gain set with a table for every outer law that is registered now."""
    laws = tuple(
        (entry.key, entry.settings) for entry in OUTER_LAWS.entries() if entry.settings is not None
    )
    if laws not in _models:
        boxes = {entry.key: entry.search for entry in OUTER_LAWS.entries()}
        fields: dict[str, Any] = {
            key: (settings, _default(key, settings, boxes[key])) for key, settings in laws
        }
        _models[laws] = create_model("GainSet", __base__=Gains, **fields)
    return _models[laws]


def _default(key: str, settings: type[BaseModel], search: Box) -> Any:
    """Return how a table may be left out: where every gain has a default, or a start of its search."""
    said = f"gains of {key.replace('_', '-')}"
    needed = [name for name, field in settings.model_fields.items() if field.is_required()]
    starts = {name: search[name][1] for name in needed if name in search}
    if len(starts) < len(needed) or key in shipped_laws():
        return Field(description=said)
    return Field(default_factory=lambda: settings(**starts), description=said)


@functools.cache
def shipped_laws() -> frozenset[str]:
    """Return the keys of the laws that every shipped set has: their tables are never made up."""
    tuned, thesis = (frozenset(read_gain_set(name)) for name in ("tuned", "thesis"))
    return tuned & thesis


def make_gains(tables: Mapping[str, Any]) -> Gains:
    """Return a gain set from its tables; raises pydantic's ValidationError."""
    return gains_model().model_validate(tables)


def only_gains_of(tree: dict[str, Any], laws: Sequence[str]) -> dict[str, Any]:
    """Return a scenario's tree without the gain tables of outer laws that do not run in it.

    What is left tells one task from another: other laws are known or not from process to process.
    """
    kept = {"origin", *(OUTER_LAWS.get(name).key for name in laws)}
    sets = {
        name: {key: value for key, value in tables.items() if key in kept}
        for name, tables in tree["control"]["gains"].items()
    }
    return tree | {"control": tree["control"] | {"gains": sets}}


class GainSets(Section):
    """The named sets; `hil/data/gains` holds what ships."""

    tuned: SerializeAsAny[Gains] = Field(
        description="found by `hil tune`, the same budget for every law"
    )
    thesis: SerializeAsAny[Gains] = Field(description="table 8.2 as read in docs/control.md")

    @classmethod
    def from_files(cls) -> GainSets:
        """Return the sets as they ship."""
        return cls.model_validate(shipped_gains())


def shipped_gains() -> dict[str, Any]:
    """Return the tables of every gain file that ships with the package."""
    return {name: read_gain_set(name) for name in GainSets.model_fields}


def read_gain_set(name: str) -> dict[str, Any]:
    """Return the tables of a gain file that ships with the package."""
    text = (files("hil") / "data" / "gains" / f"{name}.toml").read_text(encoding="utf-8")
    return parse_toml(text, f"gains {name}")
