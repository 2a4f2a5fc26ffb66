"""The files that `hil new` writes, as starting points of tests."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path


def template(name: str, called: str) -> str:
    """Return a template under a name."""
    text = (files("hil") / "data" / "templates" / name).read_text(encoding="utf-8")
    return text.replace("my-thing", called).replace("my_thing", called.replace("-", "_"))


def law_text(called: str) -> str:
    """Return the law of `hil new law` under a name."""
    return template("law.py", called)


def written(path: Path, text: str) -> Path:
    """Write a file and return its path."""
    path.write_text(text, encoding="utf-8")
    return path


def figure_text(name: str, body: str) -> str:
    """Return a file with one figure of this body."""
    return (
        "import time, random\nimport numpy as np\nimport hil\n\n\n"
        f'@hil.figure("{name}", unit="m", meaning="a test\'s")\n'
        f"def given(run):\n    {body}\n"
    )


def cost_text(name: str, body: str) -> str:
    """Return a file with one cost of this body, 9 for a failed run."""
    return (
        f'import hil\n\n\n@hil.tuning_cost("{name}", meaning="a test\'s", failed=9.0)\n'
        f"def given(figures):\n    {body}\n"
    )
