"""Scenario files: resolved values, and one clear line for everything that cannot be used."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil.config.deck import load_deck
from hil.config.load import builtin_names, load_scenario, merge
from hil.core.errors import BadInput

MINIMAL = """
base = "lab"
name = "own"
duration_s = 5.0
[start]
x_m = 0.0
y_m = 0.0
theta_rad = 0.0
[reference]
kind = "point"
x_m = 0.5
"""


def refusal(name: str, *overrides: str) -> str:
    """Return the line with which loading is refused; it must be one line."""
    with pytest.raises(BadInput) as caught:
        load_scenario(name, overrides)
    text = str(caught.value)
    assert "\n" not in text
    return text


@pytest.mark.parametrize("name", builtin_names("scenarios"))
def test_every_built_in_scenario_loads(name: str) -> None:
    """A built-in scenario is valid as it stands and carries its own name."""
    assert load_scenario(name).name == name


def test_the_thesis_deck_names_the_three_experiments_and_both_laws() -> None:
    """The default deck is the three experiments, each with the benchmark and with ASG-ISM."""
    deck = load_deck("thesis")
    assert deck.scenarios == ("scenario-1", "scenario-2", "scenario-3")
    assert set(deck.laws) == {"pid", "asg-ism"}


def test_set_reaches_scenario_robot_link_and_board_values() -> None:
    """--set changes exactly the value that its dotted name says."""
    changed = load_scenario(
        "scenario-1", ["robot.mass_kg=3.1", "link.loss_ratio=0.1", "board.ISM_K0=0.2"]
    )
    plain = load_scenario("scenario-1")
    assert (changed.robot.mass_kg, changed.link.loss_ratio, changed.board["ISM_K0"]) == (
        3.1,
        0.1,
        0.2,
    )
    assert changed.robot.wheel_radius_m == plain.robot.wheel_radius_m
    assert plain.robot.mass_kg != 3.1


def test_a_whole_table_of_the_board_still_sets_every_parameter() -> None:
    """What is not named has its default: a run does not depend on what the board had stored."""
    table = load_scenario("scenario-1", ["board={ISM_K0=0.2}"])
    assert table == load_scenario("scenario-1", ["board.ISM_K0=0.2"])


def test_unknown_name_lists_near_names() -> None:
    """A mistyped name is answered with the name that was meant."""
    assert "robot.mass_kg" in refusal("scenario-1", "robot.mas_kg=3")
    assert "board.ISM_K0" in refusal("scenario-1", "board.ISM_KO=0.1")
    assert "scenario-1" in refusal("scenaro-1")


def test_value_out_of_range_names_key_value_unit_and_limit() -> None:
    """A value outside its bounds is refused with key, value, unit and bound."""
    text = refusal("scenario-1", "robot.mass_kg=-3")
    assert "robot.mass_kg" in text
    assert "-3" in text
    assert "kg" in text
    assert "0.5" in text
    assert "20 rad/s" in refusal("scenario-1", "board.ISM_EPSMIN=300")


@pytest.mark.parametrize("limit", [0.5, 50.0])
def test_bounds_hold_on_both_sides(limit: float) -> None:
    """The bound itself is allowed; just beyond it is refused."""
    assert load_scenario("scenario-1", [f"robot.mass_kg={limit}"]).robot.mass_kg == limit
    beyond = limit * (0.999 if limit < 1 else 1.001)
    assert "robot.mass_kg" in refusal("scenario-1", f"robot.mass_kg={beyond}")


@pytest.mark.parametrize(
    "text", ["robot.mass_kg", "=3", "robot.mass_kg=heavy", "robot.mass_kg=nan"]
)
def test_malformed_set_is_one_line(text: str) -> None:
    """A --set without a name, a value or a number is refused."""
    assert refusal("scenario-1", text)


def test_unknown_key_in_a_file_is_refused_with_near_names(tmp_path: Path) -> None:
    """A mistyped key in a file is an error, never ignored."""
    file = tmp_path / "own.toml"
    file.write_text(MINIMAL + "\n[link]\nlatency_ms = 20\n")
    text = refusal(str(file))
    assert "latency_ms" in text
    assert "latency_s" in text


def test_own_file_lies_over_its_base(tmp_path: Path) -> None:
    """A file gives what differs; the laboratory's default conditions give the rest."""
    file = tmp_path / "own.toml"
    file.write_text(MINIMAL)
    own = load_scenario(str(file))
    assert own.duration_s == 5.0
    assert own.link.baud == load_scenario("scenario-1").link.baud
    assert own.requirements == ()


@pytest.mark.parametrize("content", ["name = ", "\xff\xfe", "base = 'nowhere'\n"])
def test_damaged_file_is_one_line(tmp_path: Path, content: str) -> None:
    """A file that is not TOML, not text, or names a base that is not there is refused."""
    file = tmp_path / "broken.toml"
    file.write_text(content, encoding="latin-1")
    assert refusal(str(file))


def test_table_of_another_kind_replaces_the_one_below() -> None:
    """A reference of another kind does not inherit the keys of the one it replaces."""
    below = {"reference": {"kind": "point", "x_m": 1.0}}
    assert merge(below, {"reference": {"kind": "circle"}}) == {"reference": {"kind": "circle"}}
    assert merge(below, {"reference": {"y_m": 2.0}})["reference"] == {
        "kind": "point", "x_m": 1.0, "y_m": 2.0,
    }  # fmt: skip
