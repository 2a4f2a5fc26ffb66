"""Base of every configuration section: frozen, and an unknown key is an error with near names."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from typing import Annotated, Any, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    JsonValue,
    ModelWrapValidatorHandler,
    model_validator,
)
from pydantic.fields import FieldInfo

from hil.core.errors import BadInput
from hil.core.registry import Registry
from hil.core.text import is_plain_name


def _plain(name: str) -> str:
    if not is_plain_name(name):
        raise ValueError("names a folder: no / or \\, and nothing that does not show")
    return name


# A name that becomes part of a path.
PlainName = Annotated[str, AfterValidator(_plain)]


class Section(BaseModel):
    """One table of a TOML file; bounds, unit and meaning of each number stand on its field."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, tree: Any) -> Any:
        if isinstance(tree, dict):
            for key in tree:
                if key not in cls.model_fields:
                    known = sorted(cls.model_fields)
                    near = difflib.get_close_matches(str(key), known, n=3, cutoff=0.5)
                    raise ValueError(f"unknown key {key!r}; near: {', '.join(near or known)}")
                if isinstance(tree[key], bool) and "unit" in extra_of(cls.model_fields[key]):
                    said = str(tree[key]).lower()
                    raise ValueError(f"{key} = {said}: a number is needed, not true or false")
        return tree

    @classmethod
    def unit_of(cls, name: str, table: Mapping[str, Any]) -> str:  # noqa: ARG003 - of the whole table
        """Return the unit of a value; a section in which another value decides it says so here."""
        return str(extra_of(cls.model_fields[name]).get("unit", ""))


def extra_of(field: FieldInfo) -> Mapping[str, Any]:
    """Return what `quantity` keeps with a field: `unit` and `source`; empty for other fields."""
    extra = field.json_schema_extra
    return extra if isinstance(extra, Mapping) else {}


def quantity(
    unit: str, description: str, default: Any = ..., /, *, source: str = "", **bounds: Any
) -> Any:
    """Return a number's field: its unit, what it is and its bounds, as data.

    `unit` is "" for a plain number and "(ratio)" for a share; `source` says where the default comes
    from. `bounds` are pydantic's (ge, gt, le, lt, min_length, ...).
    """
    extra: dict[str, JsonValue] = {"unit": unit, "source": source}
    return Field(default, description=description, json_schema_extra=extra, **bounds)


class OpenSection(Section):
    """A table whose model depends on what is registered: laws' gains, a reference of some kind."""

    @classmethod
    def model_for(cls, tree: Any) -> type[BaseModel]:
        """Return the model of a table as it stands; raises BadInput for an unknown kind."""
        raise NotImplementedError

    @classmethod
    def models(cls) -> list[type[BaseModel]]:
        """Return every model that a table may take now."""
        raise NotImplementedError

    @model_validator(mode="wrap")
    @classmethod
    def _by_its_model(cls, given: Any, handler: ModelWrapValidatorHandler[Self]) -> Any:
        if OpenSection in cls.__bases__ and isinstance(given, Mapping):
            try:
                model = cls.model_for(given)
            except BadInput as error:
                raise ValueError(str(error)) from None
            return model.model_validate(given)
        return handler(given)


def known_name(registry: Registry) -> AfterValidator:
    """Return the check that a name, or a file, is one that a registry has: a file becomes its name."""

    def check(name: str) -> str:
        try:
            return registry.get(name).name
        except BadInput as error:
            raise ValueError(str(error)) from None

    return AfterValidator(check)


def rounded_up(limit: float) -> str:
    """Return a positive lower limit to three digits, rounded so that the figure shown holds."""
    digits = 2 - math.floor(math.log10(limit)) if limit > 0.0 else 0
    return f"{math.ceil(round(limit * 10.0**digits, 6)) / 10.0**digits:g}"
