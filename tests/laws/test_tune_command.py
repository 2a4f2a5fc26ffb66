"""`hil tune` from the command line: search, verdict, file; with made-up runs in real workers."""

import json
import tomllib

import pytest
from click.testing import CliRunner

from hil.cli.tune import command
from hil.config.control import Gains
from hil.core.errors import BadInput
from tests.laws.test_tune import STILL, distance


class Bowl:
    """Stands in for the twin; a worker process imports it from here."""

    def __init__(self, target, camera, tasks):
        self.name = (target, camera)

    def __call__(self, trial):
        luck = 1e-3 * trial.seed * (trial.outer == "pid")
        return STILL | {"iae_m_s": 1.0 + distance(trial.outer, trial.gains) + luck}


@pytest.fixture(autouse=True)
def bowl(monkeypatch):
    monkeypatch.setattr("hil.study.tune.OnTarget", Bowl)


def test_gain_set_holds_what_was_found_and_how_it_was_judged(tmp_path):
    """The file reads back, better than the start, with the verdict that stdout has too."""
    out = tmp_path / "set.toml"
    asked = ["--candidates", "51", "--held-out", "6", "--workers", "2", "--out", str(out), "--json"]
    run = CliRunner().invoke(command, asked, standalone_mode=False, catch_exceptions=False)
    document = json.loads(run.stdout)
    gains = Gains.model_validate(tomllib.loads(out.read_text(encoding="utf-8")))
    assert gains.model_dump() == document["gains"]
    assert gains.origin["cost_pid"] < gains.origin["start_cost_pid"]
    assert gains.origin["held_out"].endswith("seeds 1000 to 1005")
    verdict = document["verdict"]["asg-ism - pid"]["all"]["cost"]
    assert verdict["pairs"] == 18
    assert verdict["mean"] == pytest.approx(
        gains.origin["held_out_cost_asg-ism"] - gains.origin["held_out_cost_pid"], abs=2e-4
    )


def test_a_file_that_exists_is_not_written_over(tmp_path):
    """It is refused before anything runs."""
    out = tmp_path / "set.toml"
    out.write_text("mine")
    with pytest.raises(BadInput, match="exists already"):
        CliRunner().invoke(
            command, ["--out", str(out)], standalone_mode=False, catch_exceptions=False
        )
    assert out.read_text() == "mine"


def test_a_folder_that_is_not_there_is_named_before_the_search(tmp_path):
    """A search of minutes does not end in a file that cannot be written."""
    out = tmp_path / "none" / "set.toml"
    with pytest.raises(BadInput, match="no folder"):
        CliRunner().invoke(
            command, ["--out", str(out)], standalone_mode=False, catch_exceptions=False
        )
