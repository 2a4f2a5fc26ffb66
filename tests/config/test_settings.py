"""`hil config`, docs/settings.md and the JSON Schemas: one source for what is known of every key."""

from __future__ import annotations

import copy
import json
import subprocess
import sys
import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from hil.study.file_kinds import KINDS, all_settings
from tests.cli.command import hil

DATA = files("hil") / "data"
DOCS = Path(__file__).resolve().parents[2] / "docs"
BUILT_IN = [
    (kind.name, f"{folder}/{item.name}")
    for kind in KINDS
    for folder in kind.folders
    for item in (DATA / folder).iterdir()
]


def schema(kind: str) -> dict[str, Any]:
    tree: dict[str, Any] = json.loads((DATA / "schemas" / f"{kind}.json").read_text("utf-8"))
    return tree


def wrong(kind: str, tree: dict[str, Any]) -> list[str]:
    """Return the paths at which a file breaks its schema."""
    found = jsonschema.Draft202012Validator(schema(kind)).iter_errors(tree)
    return sorted(".".join(map(str, error.absolute_path)) for error in found)


def fresh(*words: str) -> str:
    """Return what a process says that knows no law but the built-in ones."""
    done = subprocess.run(
        [sys.executable, "-m", "hil", "config", *words], capture_output=True, text=True, check=True
    )
    return done.stdout


def test_page_is_what_the_command_writes() -> None:
    """docs/settings.md shows the present keys; remake it with `hil config --markdown`."""
    page = (DOCS / "settings.md").read_text(encoding="utf-8")
    made = fresh("--markdown")
    assert page[page.index("## top level") :] == made


def test_schemas_are_up_to_date(tmp_path: Path) -> None:
    """hil/data/schemas is what `hil config schema` writes."""
    fresh("schema", "--out", str(tmp_path))
    names = sorted(file.name for file in tmp_path.iterdir())
    assert names == sorted(item.name for item in (DATA / "schemas").iterdir())
    for name in names:
        assert (tmp_path / name).read_text("utf-8") == (DATA / "schemas" / name).read_text("utf-8")


@pytest.mark.parametrize(("kind", "name"), BUILT_IN)
def test_built_in_files_name_and_keep_their_schema(kind: str, name: str) -> None:
    """The first line names the schema beside, and the file is valid by it."""
    text = (DATA / name).read_text(encoding="utf-8")
    assert text.splitlines()[0] == f"#:schema ../schemas/{kind}.json"
    assert wrong(kind, tomllib.loads(text)) == []


@pytest.mark.parametrize(
    ("kind", "tree", "where"),
    [
        ("scenario", {"base": "lab", "robot": {"mass_kg": 0.1}}, ["robot.mass_kg"]),
        ("scenario", {"robot": {"mas_kg": 3.0}}, ["robot"]),
        ("scenario", {"robot": {"file": 3}}, ["robot.file"]),
        ("scenario", {"reference": {"kind": "circle", "radius_m": -1.0}}, ["reference"]),
        ("scenario", {"requirements": [{"max": 1.0}]}, ["requirements.0"]),
        ("scenario", {"control": {"gains": {"tuned": {"pid": {"kp": 1}}}}}, ["control.gains.tuned.pid"]),
        ("robot", {"motor": {"per_side": "two"}}, ["motor.per_side"]),
        ("gains", {"pid": {"kp_s3": "much"}}, ["pid.kp_s3"]),
        ("campaign", {"seeds": 0}, ["seeds"]),
        ("deck", {"scenarios": []}, ["scenarios"]),
        ("scenario", {"reference": {"kind": "my_path.py", "own": 1}}, []),
        ("scenario", {"control": {"gains": {"tuned": {"own_law": {"k": 1}}}}}, []),
        ("campaign", {"grid": {"link": {"latency_s": [0.1]}}}, []),
    ],
)  # fmt: skip
def test_schemas_refuse_what_the_commands_refuse(
    kind: str, tree: dict[str, Any], where: list[str]
) -> None:
    """Unknown keys, wrong types and values out of bounds are marked; things from outside are not."""
    assert wrong(kind, tree) == where


def test_bounds_in_schema_are_those_of_the_listing() -> None:
    """Schema and listing say the same of the robot's numbers."""
    properties = schema("robot")["properties"]
    seen = 0
    for setting in all_settings():
        table, _, name = setting.key.rpartition(".")
        if table == "robot" and setting.low is not None:
            field = copy.deepcopy(properties[name])
            number = field.get("anyOf", [field])[0]  # of one that may be left out: number or null
            low = number["exclusiveMinimum" if setting.above else "minimum"]
            assert low == setting.low, setting.key
            assert setting.unit in field["description"]
            seen += 1
    assert seen > 5


def test_every_key_has_a_meaning_and_every_number_its_unit_or_bounds() -> None:
    """Nothing is listed that the reader would have to guess."""
    found = list(all_settings())
    assert {one.key.partition(".")[0] for one in found} >= {
        "robot", "camera", "link", "control", "board", "campaign", "deck"
    }  # fmt: skip
    assert [one.key for one in found if not one.meaning] == []
    assert any(one.key.startswith("control.gains.tuned.") for one in found)


def test_one_key() -> None:
    """Unit, bounds, default, source and meaning of a key; all keys of a table."""
    said = hil("config", "robot.mass_kg", "--json").json["settings"]
    (mass,) = said
    assert (mass["unit"], mass["low"], mass["high"], mass["default"]) == ("kg", 0.5, 50, 2.8)
    assert mass["source"].startswith("assumed: 4 motors")
    text = hil("config", "robot.mass_kg").out
    assert "  bounds: 0.5 to 50\n" in text
    assert "  unit: kg\n" in text
    table = hil("config", "link", "--json").json["settings"]
    assert len(table) > 3
    assert all(one["key"].startswith("link.") for one in table)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("robot.mas_kg",), "near: robot.mass_kg"),
        (("mass_kg",), "near: robot.mass_kg"),
        (("nonsense-of-some-sort",), "top level: name, description"),
        (("schema",), "needs a folder: --out DIR"),
        (("robot", "--out", "x"), "goes with `hil config schema` only"),
        (("--json", "--markdown"), "choose one"),
    ],
)
def test_wrong_questions_are_one_line(words: tuple[str, ...], said: str) -> None:
    """An unknown key lists near ones."""
    assert said in hil("config", *words).refusal
