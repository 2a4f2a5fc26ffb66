"""`control.gain_set` takes a file of gains: where it counts, what lies on it, what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil.config.gains import read_gain_set
from hil.config.load import load_scenario
from hil.core.errors import BadInput
from hil.core.registries import OUTER_LAWS
from hil.study.campaign.plan import load_campaign
from hil.study.tune import write_gain_set

ONE_LAW = "[pid]\nkp_s3 = 11.0\nki_s4 = 0.5\nkd1_s2 = 12.0\nkd2_s = 6.0\n"


def kp_of(scenario: str, *overrides: str) -> float:
    """Return PID's proportional gain in use."""
    gains = load_scenario(scenario, overrides).control.active_gains
    return float(gains.of(OUTER_LAWS.get("pid")).kp_s3)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "mine.toml"
    path.write_text(ONE_LAW)
    return path


def test_a_file_takes_the_place_of_the_set_and_leaves_the_other_laws(file: Path) -> None:
    """PID's gains are the file's, those of a law that it leaves out are as tuned; without it none is."""
    scenario = load_scenario("scenario-1", [f"control.gain_set={file}"])
    assert kp_of("scenario-1", f"control.gain_set={file}") == 11.0
    assert kp_of("scenario-1") != 11.0
    other = scenario.control.active_gains.of(OUTER_LAWS.get("asg-ism")).model_dump()
    shipped = read_gain_set("tuned")["asg_ism"]
    assert {name: other[name] for name in shipped} == shipped


def test_a_shipped_set_as_a_file_is_that_set(tmp_path: Path) -> None:
    """The gains of the thesis from a file of one's own are those of `gain_set=thesis`."""
    gains = load_scenario("scenario-1", ["control.gain_set=thesis"]).control.active_gains
    path = tmp_path / "folder" / "thesis.toml"
    path.parent.mkdir()
    write_gain_set(path, gains)
    found = load_scenario("scenario-1", [f"control.gain_set={path}"]).control.active_gains
    for law in ("pid", "asg-ism", "dob-pid"):
        entry = OUTER_LAWS.get(law)
        assert found.of(entry) == gains.of(entry)


def test_it_lies_beside_the_scenario_and_below_what_that_says_itself(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its name is relative to the scenario's file; the scenario's own value and --set stand above."""
    task = file.parent / "task.toml"
    task.write_text('base = "scenario-1"\n[control]\ngain_set = "mine.toml"\n')
    monkeypatch.chdir("/")
    assert kp_of(str(task)) == 11.0
    task.write_text(task.read_text() + "[control.gains.tuned.pid]\nkp_s3 = 7.0\n")
    scenario = load_scenario(str(task))
    gains = scenario.control.active_gains.of(OUTER_LAWS.get("pid"))
    assert (gains.kp_s3, gains.kd1_s2) == (7.0, 12.0)
    assert scenario.control.gain_set == "tuned"
    above = "control.gains.tuned.pid.kp_s3=9", f"control.gain_set={file}"
    assert kp_of("scenario-1", *above) == 9.0  # in whichever order they are given
    assert kp_of("scenario-1", *reversed(above)) == 9.0


def test_a_campaign_compares_files(file: Path) -> None:
    """A list of files is an axis; each run has the gains of its own."""
    campaign = file.parent / "which.toml"
    campaign.write_text(
        f'scenario = "scenario-1"\n[grid]\n"control.gain_set" = ["{file}", "thesis"]\n'
    )
    jobs = load_campaign(str(campaign)).jobs()
    laws = OUTER_LAWS.get("pid")
    found = {
        float(load_campaign(str(campaign)).scenario(job.point).control.active_gains.of(laws).kp_s3)
        for job in jobs
    }
    assert found == {11.0, kp_of("scenario-1", "control.gain_set=thesis")}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "nowhere.toml: cannot be read: No such file"),
        ("[pid\n", "not valid TOML"),
        ("[pid]\nkp_s3 = 'much'\n", "pid.kp_s3: Input should be a valid number"),
        ("[pidd]\nkp_s3 = 1.0\n", "unknown key 'pidd'; near: pid"),
        ("[pid]\nkp = 1.0\n", "pid: unknown key 'kp'"),
    ],
)
def test_a_bad_file_is_one_line(tmp_path: Path, text: str | None, said: str) -> None:
    """File, place in it and what is wrong."""
    path = tmp_path / ("nowhere.toml" if text is None else "bad.toml")
    if text is not None:
        path.write_text(text)
    with pytest.raises(BadInput) as refused:
        load_scenario("scenario-1", [f"control.gain_set={path}"])
    assert said in str(refused.value)
    assert path.name in str(refused.value)
    assert "\n" not in str(refused.value)
