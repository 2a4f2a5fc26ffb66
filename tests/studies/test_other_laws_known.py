"""What another law that happens to be installed changes for work that does not use it: nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil.core.registries import OUTER_LAWS
from hil.study.tune import Plan
from hil.study.tune_work import identity_of, load_tasks
from tests.studies.commands import hil

LAW = """
import hil
from pydantic import BaseModel

class Settings(BaseModel):
    k: float = 1.0

@hil.outer_law("law-of-a-neighbour", settings=Settings, search={"k": (0.1, 1.0, 10.0)}, summary="stands")
class Neighbour:
    def __init__(self, gains, limits, d0_m):
        pass
    def reset(self):
        pass
    def step(self, *_):
        raise NotImplementedError
"""


@pytest.fixture
def neighbour(tmp_path: Path):
    """Make one more law known for the time of a test."""

    def known() -> None:
        file = tmp_path / "neighbour.py"
        file.write_text(LAW, encoding="utf-8")
        OUTER_LAWS.load_file(str(file))

    kept = dict(OUTER_LAWS._entries)
    yield known
    OUTER_LAWS._entries = kept


@pytest.mark.parametrize(
    "words",
    [
        ["experiment", "deck.toml", "--camera", "pose", "--set", "duration_s=0.4", "--out", "e"],
        ["sweep", "c.toml", "--out", "e", "--workers", "1"],
    ],
    ids=["experiment", "sweep"],
)  # fmt: skip
def test_work_is_taken_up_beside_a_new_law(tmp_path: Path, neighbour, words: list[str]) -> None:
    """The folder is the same experiment or campaign after a package with a law was installed."""
    (tmp_path / "c.toml").write_text(
        'scenario = "scenario-1"\nset = ["duration_s=0.4", "requirements=[]"]\nseeds = 2\n',
        encoding="utf-8",
    )
    (tmp_path / "deck.toml").write_text(
        'scenarios = ["scenario-1"]\nlaws = ["pid"]\n', encoding="utf-8"
    )
    first = hil(tmp_path, *words)
    assert first.returncode in (0, 1), first.stderr
    neighbour()
    again = hil(tmp_path, *words)
    assert again.returncode == first.returncode, again.stderr


def test_a_search_is_the_same_beside_a_new_law(neighbour) -> None:
    """And not when a gain of its own laws differs."""

    def identity(*overrides: str) -> dict:
        tasks = load_tasks(["scenario-1"], None, overrides)
        return identity_of(tasks, Plan(), "pose", "", ("pid",))

    before = identity()
    neighbour()
    assert identity() == before
    assert identity("control.gains.tuned.asg_ism.k1_s=3.0") == before
    assert identity("control.gains.tuned.pid.kp_s3=3.0") != before
