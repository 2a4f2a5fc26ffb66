"""Scenario files as they were before the suite of tasks came: they load and run, and mean the same."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from hil.config.load import load_scenario
from hil.core.errors import BadInput
from hil.runs.execute import RunSpec, execute_in_memory

FILES = Path(__file__).parents[1] / "data" / "earlier"
EVERY_KEY = FILES / "every-key.toml"


def leaves(tree, at=()):
    """Yield every value of a table with the names that lead to it; lists are values."""
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from leaves(value, (*at, key))
        else:
            yield (*at, key), value


@pytest.mark.parametrize("outer", ["asg-ism", "pid"])
@pytest.mark.parametrize("file", sorted(FILES.glob("*.toml")), ids=lambda file: file.stem)
def test_a_file_of_then_runs_and_holds_its_requirements(file, outer):
    """The circle with gains of its own, the first scenario, and one that spells every key out."""
    spec = RunSpec(load_scenario(str(file)), "twin", "pose", outer, "asg-ism", 3, Path())
    record = execute_in_memory(spec)
    assert record.manifest.outcome == "complete"
    assert [found.name for found in record.verdicts() if not found.holds] == []


def test_every_key_of_then_has_the_value_that_the_file_gives_it():
    """Robot, board, link, camera, control, gains and safety: 160 values and more, none lost or renamed."""
    tree = tomllib.loads(EVERY_KEY.read_text(encoding="utf-8"))
    loaded = load_scenario(str(EVERY_KEY)).model_dump(mode="json")
    given = [(path, value) for path, value in leaves(tree) if not isinstance(value, list)]
    assert len(given) > 160
    for path, value in given:
        there = loaded
        for key in path:
            there = there[key]
        assert there == value, ".".join(path)


def test_a_key_that_never_was_is_refused(tmp_path):
    """Negative control: the same file with one more key of the control section."""
    text = EVERY_KEY.read_text(encoding="utf-8")
    file = tmp_path / "more.toml"
    file.write_text(text.replace("[control.limits]", "[control.limits]\nlead_way_s = 1.0"))
    with pytest.raises(BadInput, match="lead_way_s"):
        load_scenario(str(file))
