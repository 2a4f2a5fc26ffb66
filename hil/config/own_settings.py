"""The settings of its own that an estimator, a localiser or a reference brings along, in a scenario.

Which model a table of them has depends on the name that stands beside it, so that whatever looks at
such a table asks here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from pydantic import BaseModel, ConfigDict, ValidationInfo

from hil.core.errors import BadInput
from hil.core.registries import ESTIMATORS, LOCALISERS, REFERENCES
from hil.core.registry import Registry


class Place(NamedTuple):
    """Where in a scenario a name and its settings stand; `elsewhere` is said where there are none."""

    registry: Registry
    name_key: str
    settings_key: str
    elsewhere: str


PLACES = (
    Place(
        ESTIMATORS, "control.estimator", "control.estimator_settings",
        "what every estimator assumes is control.fusion",
    ),
    Place(
        LOCALISERS, "camera.localiser", "camera.localiser_settings",
        "marks and tag are camera.marks and camera.robot_look.tag",
    ),
    Place(REFERENCES, "reference.kind", "reference", ""),
)  # fmt: skip
BY_NAME_KEY = {place.name_key: place for place in PLACES}


class NoSettings(BaseModel):
    """The settings of what has none."""

    model_config = ConfigDict(frozen=True)


def validated(place: Place, table: Any, info: ValidationInfo) -> BaseModel:
    """Return a table as the model of the thing that the field before it names; raises ValueError."""
    name = info.data.get(place.name_key.rsplit(".", maxsplit=1)[-1])
    if name is None:  # the name itself was refused
        return NoSettings()
    if isinstance(table, BaseModel):
        table = table.model_dump()
    model = place.registry.get(name).settings
    if model is not None:
        own: BaseModel = model.model_validate(table)
        return own
    if table:
        keys = ", ".join(map(str, table)) if isinstance(table, Mapping) else repr(table)
        raise ValueError(
            f"{keys}: {place.registry.kind} {name} has no settings of its own; {place.elsewhere}"
        )
    return NoSettings()


def own_of(settings: BaseModel) -> Any:
    """Return settings as the thing that has them is given them, None where it has none."""
    return None if isinstance(settings, NoSettings) else settings


def model_at(tree: Any, key: str) -> tuple[type[BaseModel], str] | None:
    """Return the model and the rest of a dotted key that lies in a table of own settings."""
    for place in PLACES:
        if key.startswith(f"{place.settings_key}."):
            model = _model(place, _at(tree, place.name_key))
            return None if model is None else (model, key[len(place.settings_key) + 1 :])
    return None


def _model(place: Place, name: Any) -> type[BaseModel] | None:
    try:
        return place.registry.get(str(name)).settings
    except BadInput:
        return None


def defaults_of(place: Place, name: Any) -> dict[str, Any]:
    """Return the defaults of the settings of what `name` names; what has none is left out.

    Raises BadInput when there is no such thing.
    """
    model = place.registry.get(str(name)).settings
    if model is None:
        return {}
    return {
        key: field.get_default(call_default_factory=True)
        for key, field in model.model_fields.items()
        if not field.is_required() and key != "kind"
    }


def renew(tree: dict[str, Any], place: Place, name: Any) -> None:
    """Put the defaults of another thing where the settings of the one before stand, in place."""
    *above, last = place.settings_key.split(".")
    node = tree
    for part in above:
        node = node[part]
    kind = {"kind": name} if place.registry is REFERENCES else {}
    node[last] = kind | defaults_of(place, name)


def _at(tree: Any, key: str) -> Any:
    for part in key.split("."):
        tree = tree.get(part) if isinstance(tree, Mapping) else None
    return tree
