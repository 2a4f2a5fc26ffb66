"""Base of every configuration section: frozen, and an unknown key is an error with near names."""

from __future__ import annotations

import difflib
import math
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


def rounded_up(limit: float) -> str:
    """Return a positive lower limit to three digits, rounded so that the figure shown holds."""
    digits = 2 - math.floor(math.log10(limit)) if limit > 0.0 else 0
    return f"{math.ceil(round(limit * 10.0**digits, 6)) / 10.0**digits:g}"
