"""Settings of an estimator's, a localiser's and a reference's own: reached by files and --set."""

from __future__ import annotations

import json
import pickle
from pathlib import Path

import pytest

from hil.config.load import load_scenario
from hil.core.registries import ESTIMATORS
from tests.cli.command import hil, run_pose
from tests.own.starts import template, written

REFERENCE = '''"""A point that creeps along X."""

import hil


class Creep(hil.ReferenceConfig):
    kind: str = "creep"
    speed_m_s: float = hil.quantity("m/s", "along X", gt=0, le=1)
    y_m: float = hil.quantity("m", "world Y", 0.0, ge=-1, le=1)


@hil.reference("creep", settings=Creep)
class Creeping:
    """A point that creeps along X."""

    def __init__(self, config: Creep) -> None:
        self._config = config

    def at(self, t_s: float) -> hil.ReferenceState:
        speed = self._config.speed_m_s
        zero = (0.0, 0.0)
        return hil.ReferenceState((speed * max(t_s, 0.0), self._config.y_m), (speed, 0.0), zero, zero)
'''


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("settings")
    return {
        "estimator": written(folder / "est.py", template("estimator.py", "set-estimator")),
        "localiser": written(folder / "loc.py", template("localiser.py", "set-localiser")),
        "reference": written(folder / "ref.py", REFERENCE),
    }


def test_set_reaches_them_in_any_order(files):
    """The name may stand before or behind its settings; defaults fill the rest."""
    name = f"control.estimator={files['estimator']}"
    value = "control.estimator_settings.share=0.5"
    for texts in ((name, value), (value, name)):
        control = load_scenario("scenario-1", texts).control
        assert control.estimator == "set-estimator"
        assert control.estimator_settings.model_dump() == {"share": 0.5}
    assert load_scenario("scenario-1", (name,)).control.estimator_settings.share == 0.3
    camera = load_scenario(
        "scenario-1",
        (f"camera.localiser={files['localiser']}", "camera.localiser_settings.rise_dn=30"),
    ).camera
    assert (camera.own_settings.rise_dn, camera.own_settings.least_px) == (30.0, 20.0)


def test_a_reference_of_ones_own_by_set(files):
    """Another kind takes its own values in place of those of the kind before; one must be given."""
    texts = ("reference.speed_m_s=0.1", f"reference.kind={files['reference']}")
    reference = load_scenario("scenario-1", texts).reference
    assert reference.model_dump() == {"kind": "creep", "speed_m_s": 0.1, "y_m": 0.0}
    done = run_pose("--set", texts[1])
    assert "reference.speed_m_s: missing; give a value" in done.refusal


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("control.estimator_settings.shar=0.5", "near: control.estimator_settings.share"),
        ("control.estimator_settings.share=1.5", "share = 1.5 (ratio): input should be less than"),
        (
            "control.estimator_settings.share=much",
            "share = 'much' (ratio): input should be a valid",
        ),
    ],
)
def test_bad_settings_are_one_line_with_near_names_and_units(text, said, files, tmp_path: Path):
    """An unknown key, one out of bounds, and one that is no number, each in one line."""
    name = f"control.estimator={files['estimator']}"
    refusal = run_pose("--set", name, "--set", text, "--out", tmp_path / "run").refusal
    assert said in refusal
    assert not (tmp_path / "run").exists()


def test_what_has_no_settings_says_where_its_values_are(tmp_path: Path):
    """A built-in estimator's values are control.fusion; a file that gives it others is told so."""
    assert "near: " in run_pose("--set", "control.estimator_settings.share=0.5").refusal
    file = written(
        tmp_path / "s.toml", 'base = "scenario-1"\n[control.estimator_settings]\nshare = 0.5\n'
    )
    said = hil("run", file).refusal
    assert "share: estimator fused has no settings of its own" in said
    assert "control.fusion" in said


def test_a_scenario_file_names_them_beside_itself(files, tmp_path: Path):
    """Relative paths count from the scenario's folder, and the settings stand beside the name."""
    written(tmp_path / "est.py", files["estimator"].read_text().replace("set-", "beside-"))
    file = written(
        tmp_path / "s.toml",
        'base = "scenario-1"\n[control]\nestimator = "./est.py"\n'
        "[control.estimator_settings]\nshare = 0.7\n",
    )
    scenario = load_scenario(str(file))
    assert scenario.control.estimator == "beside-estimator"
    assert scenario.control.estimator_settings.share == 0.7


def test_they_are_recorded_and_replayed(files, tmp_path: Path):
    """The manifest has the values, and the exact replay runs with them."""
    texts = (f"control.estimator={files['estimator']}", "control.estimator_settings.share=0.6")
    done = run_pose(
        "--set", texts[0], "--set", texts[1], "--set", "duration_s=2", "--out", tmp_path / "run"
    )  # fmt: skip
    assert done.status == 1, done.err
    control = json.loads((tmp_path / "run" / "manifest.json").read_text())["scenario"]["control"]
    assert control["estimator_settings"] == {"share": 0.6}
    assert hil("replay", tmp_path / "run").status == 0


def test_another_process_gets_them_with_the_scenario(files):
    """A pickled scenario carries the text, so that a worker that never saw the file knows it."""
    texts = (f"control.estimator={files['estimator']}", "control.estimator_settings.share=0.6")
    data = pickle.dumps(load_scenario("scenario-1", texts))
    ESTIMATORS._entries.pop("set-estimator")
    scenario = pickle.loads(data)
    assert scenario.control.estimator_settings.share == 0.6
    assert ESTIMATORS.get("set-estimator").source is not None


def test_two_of_one_name_are_refused_both_named(files, tmp_path: Path):
    """A second file with the name of the first is refused; the line names both files."""
    load_scenario("scenario-1", (f"control.estimator={files['estimator']}",))
    other = written(tmp_path / "other.py", files["estimator"].read_text() + "# another\n")
    refusal = run_pose("--set", f"control.estimator={other}").refusal
    assert "two have this name" in refusal
    assert str(other) in refusal
    assert str(files["estimator"]) in refusal
