"""Base of every configuration section: frozen, and an unknown key is an error."""

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """One table of a TOML file; bounds stand on the fields, units in their names."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
