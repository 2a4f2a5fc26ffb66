"""Base of every configuration section: frozen, and an unknown key is an error with near names."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from typing import Any, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    ModelWrapValidatorHandler,
    model_validator,
)  # fmt: skip

from hil.core.errors import BadInput
from hil.core.registry import Registry


class Section(BaseModel):
    """One table of a TOML file; bounds stand on the fields, units in their names."""

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
        return tree


class OpenSection(Section):
    """A table whose model depends on what is registered: laws' gains, a reference of some kind."""

    @classmethod
    def model_for(cls, tree: Any) -> type[BaseModel]:
        """Return the model of a table as it stands; raises BadInput for an unknown kind."""
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
    """Return the check that a name, or a file, is one that a registry has."""

    def check(name: str) -> str:
        try:
            registry.get(name)
        except BadInput as error:
            raise ValueError(str(error)) from None
        return name

    return AfterValidator(check)


def rounded_up(limit: float) -> str:
    """Return a positive lower limit to three digits, rounded so that the figure shown holds."""
    digits = 2 - math.floor(math.log10(limit)) if limit > 0.0 else 0
    return f"{math.ceil(round(limit * 10.0**digits, 6)) / 10.0**digits:g}"
