"""docs/python-api.md as written, the tutorial as executed, the site as built."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import hil

DOCS = Path(__file__).resolve().parents[2] / "docs"


def python_blocks(page: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", page.read_text("utf-8"), re.DOTALL | re.MULTILINE)


def test_blocks_of_the_page_run_as_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every block of docs/python-api.md runs after those before it, and says what the text says."""
    monkeypatch.chdir(tmp_path)
    blocks = python_blocks(DOCS / "python-api.md")
    assert len(blocks) >= 7
    said = []
    names: dict[str, Any] = {"__name__": "python_api_page"}
    for block in blocks:
        exec(compile(block, "docs/python-api.md", "exec"), names)
        said.append(capsys.readouterr().out.splitlines())
    run, _, record, shadow, experiment, own, episode = said
    assert run[0].startswith("complete True ")
    assert all(line.endswith(" True") for line in run[1:])
    assert record[0] == "361 b'm'"
    assert record[1].endswith(" ()")
    assert shadow == ["shadow False"]
    assert experiment[0].startswith("True experiment")
    assert own[0].startswith("complete ")
    assert episode[0].endswith(" complete 61")
    assert (tmp_path / "both.html").is_file()


def test_observation_table_is_that_of_the_environment() -> None:
    """The page numbers the observations as the environment gives them."""
    from hil.study.gym_env import OBSERVATION  # noqa: PLC0415

    rows = re.findall(
        r"^\| (\d+)(?:(?:, | to )(\d+))? \|", (DOCS / "python-api.md").read_text("utf-8"), re.M
    )
    ends = [(int(first), int(last or first)) for first, last in rows]
    assert ends[0][0] == 0
    assert [first for first, _ in ends[1:]] == [last + 1 for _, last in ends[:-1]]
    assert ends[-1][1] == len(OBSERVATION) - 1


def test_tutorial_runs(tmp_path: Path) -> None:
    """Every cell of the notebook runs in a fresh kernel; the law meets its requirements."""
    nbformat = pytest.importorskip("nbformat", reason="nbformat is not installed")
    client = pytest.importorskip("nbclient", reason="nbclient is not installed")
    pytest.importorskip("ipykernel", reason="ipykernel is not installed")
    notebook = nbformat.read(DOCS / "tutorial.ipynb", as_version=4)
    assert all(cell.get("outputs", []) == [] for cell in notebook.cells)  # nothing made is kept
    client.NotebookClient(
        notebook,
        timeout=300,
        kernel_name="python3",
        resources={"metadata": {"path": str(tmp_path)}},
    ).execute()
    outputs = [out for cell in notebook.cells for out in cell.get("outputs", [])]
    text = "".join(out.get("text", "") for out in outputs)
    pages = [out["data"]["text/html"] for out in outputs if "text/html" in out.get("data", {})]
    assert "met every requirement: True" in text
    assert "bit for bit: True" in text
    assert len(pages) == 2
    assert all(page.startswith("<iframe srcdoc=") for page in pages)


def test_exported_names_and_pages_agree() -> None:
    """Each name of `hil` is on a page, and each `hil.NAME` that a block of Python uses is one of them."""
    texts = {page.name: page.read_text("utf-8") for page in DOCS.glob("*.md")}
    told = "\n".join(text for name, text in texts.items() if name != "changelog.md")
    rest = {
        "RigFault",
        "WheelSample",
        "__version__",
    }  # all of hil.core.errors and hil.core.types are
    assert [name for name in hil.__all__ if name not in told and name not in rest] == []
    blocks = "\n".join(re.findall(r"```python.*?\n(.*?)```", told, re.DOTALL))
    used = set(re.findall(r"(?<![\w./])hil\.([A-Za-z_]\w*)", blocks))
    assert len(used) > 20
    assert used - set(hil.__all__) <= {"config", "core", "record", "api"}, (
        "a room, or a name not exported"
    )


def test_site_builds_without_a_warning(tmp_path: Path) -> None:
    """Strict: every link and anchor inside the docs leads somewhere; search and reference are there."""
    pytest.importorskip("mkdocs", reason="extra docs is not installed: pip install '.[docs]'")
    pytest.importorskip("mkdocstrings", reason="extra docs is not installed: pip install '.[docs]'")
    project = tmp_path / "project"
    project.mkdir()
    shutil.copy(DOCS.parent / "mkdocs.yml", project)
    shutil.copytree(DOCS, project / "docs")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", "site"],
        cwd=project, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    site = project / "site"
    reference = (site / "api-reference.html").read_text("utf-8")
    for name in ("run", "experiment", "compare", "replay", "open_record", "make_env"):
        assert f'id="hil.api.{name}"' in reference, name
    assert 'id="hil.study.gym_env.HilEnv"' in reference
    for name in ("check_law", "check_estimator", "check_robot", "check_cost"):
        assert f"{name}<" in reference or f".{name}" in reference, name
    assert (site / "search/search_index.json").stat().st_size > 100_000
    assert "https://fonts" not in reference
