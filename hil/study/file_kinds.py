"""The kinds of TOML file there are: their models, their schemas, and every key with what is known of it."""

from __future__ import annotations

import difflib
import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from hil.config.camera import CameraConfig
from hil.config.deck import Deck
from hil.config.fields import Setting, settings
from hil.config.gains import Gains
from hil.config.json_schema import schema_of
from hil.config.robot import RobotConfig
from hil.config.scenario import Scenario
from hil.config.sources import built_in_settings
from hil.core.errors import BadInput
from hil.core.files import replace_file
from hil.study.campaign.plan import CampaignFile
from hil.study.falsify.box import BoxFile


@dataclass(frozen=True, slots=True)
class FileKind:
    """One kind of file; `folders` of hil/data hold the built-in ones."""

    name: str
    title: str
    model: type[BaseModel]
    folders: tuple[str, ...] = ()
    lies_on_file: tuple[str, ...] = ()
    dotted: tuple[str, ...] = ()
    based: bool = True

    def schema(self) -> dict[str, Any]:
        """Return the JSON Schema."""
        return schema_of(
            self.model, self.title, self.lies_on_file, dotted=self.dotted, based=self.based
        )

    def schema_text(self) -> str:
        """Return the schema as its file holds it."""
        return json.dumps(self.schema(), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


KINDS = (
    FileKind(
        "scenario",
        "Scenario or lab of skid-steer-hil",
        Scenario,
        ("scenarios", "labs"),
        ("RobotConfig", "CameraConfig", "WaypointReference", "StopsReference"),
    ),
    FileKind("robot", "Robot of skid-steer-hil", RobotConfig, ("robots",)),
    FileKind("camera", "Camera of skid-steer-hil", CameraConfig),
    FileKind("gains", "Gain set of skid-steer-hil", Gains, ("gains",), based=False),
    FileKind(
        "campaign",
        "Campaign of skid-steer-hil",
        CampaignFile,
        ("campaigns",),
        dotted=("grid", "random"),
    ),
    FileKind("deck", "Deck of skid-steer-hil", Deck, ("decks",)),
    FileKind("box", "Box of hil falsify", BoxFile, ("boxes",)),
)


def write_schemas(folder: Path) -> list[Path]:
    """Write the schema of every kind into a folder, made where needed; raises BadInput."""
    written = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for kind in KINDS:
            file = folder / f"{kind.name}.json"
            replace_file(file, kind.schema_text().encode())
            written.append(file)
    except OSError as error:
        raise BadInput(f"--out {folder}: cannot be written: {error.strerror}") from None
    return written


def all_settings() -> Iterator[Setting]:
    """Yield every key: those of a scenario as `--set` names them, then those of campaigns and decks.

    Defaults of a scenario are the values of scenario-1.
    """
    yield from built_in_settings()
    for name, model in (("campaign", CampaignFile), ("deck", Deck), ("box", BoxFile)):
        for setting in settings(model):
            yield replace(setting, key=f"{name}.{setting.key}")


def settings_of(key: str | None) -> list[Setting]:
    """Return the settings of a key or of the table it names, all without one; raises BadInput."""
    found = list(all_settings())
    if key is None:
        return found
    chosen = [one for one in found if one.key == key or one.key.startswith(f"{key}.")]
    if chosen:
        return chosen
    names = [one.key for one in found]
    same_end = [name for name in names if name.rpartition(".")[2] == key.rpartition(".")[2]]
    near = difflib.get_close_matches(key, names, n=3, cutoff=0.5)
    tables = dict.fromkeys(name.partition(".")[0] for name in names)
    hint = ", ".join(dict.fromkeys([*same_end[:3], *near])) or f"top level: {', '.join(tables)}"
    raise BadInput(f"config {key!r}: no such key or table; near: {hint}")
