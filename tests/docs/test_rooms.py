"""Rooms and files: the drawing is that of the contract, arrows point one way, no file is in a circle."""

from __future__ import annotations

from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import grimp
import pytest
from importlinter.cli import EXIT_STATUS_SUCCESS, lint_imports

from tests.docs.rooms import PAGE, ROOT, drawn, floors

ROOMS = ("hil", "vision", "sim_twin")


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    """Return who imports whom, type checking aside."""
    return grimp.build_graph(*ROOMS, exclude_type_checking_imports=True, cache_dir=None)


def circle_of(arrows: dict[str, set[str]]) -> list[str]:
    """Return the files of one import circle, [] when there is none."""
    try:
        TopologicalSorter(arrows).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_the_drawing_is_that_of_the_contract() -> None:
    """`python -m tests.docs.rooms` changes nothing."""
    text = PAGE.read_text(encoding="utf-8")
    assert drawn(text) == text, "run: python -m tests.docs.rooms"


def test_every_package_is_in_a_room(graph: grimp.ImportGraph) -> None:
    """The contract leaves out no package, but for those that hold no code."""
    rooms = {room for floor in floors() for room in floor}
    packages = {child for child in graph.find_children("hil") if graph.find_children(child)}
    with_code = {
        name for name in packages if (ROOT / Path(*name.split(".")) / "__init__.py").exists()
    }
    assert with_code <= rooms
    assert {"vision", "sim_twin"} <= rooms


def test_no_file_is_in_a_circle(graph: grimp.ImportGraph) -> None:
    """Imports inside functions count as well."""
    arrows = {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    assert circle_of(arrows) == []


def test_a_circle_is_found() -> None:
    """The negative control."""
    assert set(circle_of({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}})) == {"a", "b", "c"}


def test_the_contract_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """`lint-imports` from the project's root."""
    monkeypatch.chdir(ROOT)
    assert lint_imports(no_cache=True) == EXIT_STATUS_SUCCESS
