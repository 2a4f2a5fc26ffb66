"""Base of every configuration section: frozen, and an unknown key is an error with near names."""

from __future__ import annotations

import difflib
from typing import Any

from pydantic import BaseModel, ConfigDict, model_validator


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
