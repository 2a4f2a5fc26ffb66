"""The pytest plugin, used by a project of its own: what passes, what fails, and what it says."""

from __future__ import annotations

import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path

import pytest

LAW = '''
import hil


@hil.outer_law("straight-on")
class StraightOn:
    """Ten centimetres a second, whatever comes."""

    def __init__(self, gains, limits, d0_m):
        pass

    def reset(self, *state):
        pass

    def step(self, *now):
        return hil.OuterCommand(0.1, 0.0, {})
'''
TESTS = """
import pytest

HALF = "duration_s=0.5"
HOLDS = [HALF, 'requirements=[{metric="duration_s",min=0.4}]']
FAILS = [HALF, 'requirements=[{metric="path_length_m",max=1e-6}]']


@pytest.mark.hil("scenario-1", camera="pose", set=HOLDS, seed=7)
def test_holds(hil_run):
    assert hil_run.manifest.seed == 7


@pytest.mark.hil("scenario-1", camera="pose", set=FAILS)
def test_fails(hil_run):
    raise SystemError("reached")


@pytest.mark.hil("scenario-1", camera="pose", set=FAILS)
def test_fails_without_asking_for_the_record():
    pass


@pytest.mark.hil("scenario-1", camera="pose", set=HOLDS)
def test_body_fails(hil_run):
    assert hil_run.manifest.seed == 7


# Ten centimetres a second for half a second is less than six centimetres.
@pytest.mark.hil("scenario-1", camera="pose", outer="my_law.py",
                 set=[HALF, 'requirements=[{metric="path_length_m",max=0.06}]'])
def test_law_of_a_file(hil_run):
    assert hil_run.manifest.outer == "straight-on"


def test_function(hil_check):
    for law in ("pid", "asg-ism"):
        assert hil_check("scenario-1", outer=law, camera="pose", set=HOLDS).manifest.outer == law


def test_function_fails(hil_check):
    hil_check("scenario-1", camera="pose", set=FAILS)


@pytest.mark.hil("scenario-1", camera="pose", set=[*HOLDS, "start.x_m=5"])
def test_fault(hil_run):
    pass


@pytest.mark.hil("scenario-9")
def test_unknown_scenario(hil_run):
    pass


@pytest.mark.hil("scenario-1", set="robot.mas_kg=3")
def test_unknown_key(hil_run):
    pass


@pytest.mark.hil("scenario-1", kamera="pose")
def test_unknown_argument(hil_run):
    pass


@pytest.mark.hil("scenario-1", inner="lqr")
def test_unknown_wheel_law(hil_run):
    pass


@pytest.mark.hil("scenario-1", outer="none.py")
def test_no_such_file(hil_run):
    pass


def test_no_marker(hil_run):
    pass
"""


@dataclass(frozen=True, slots=True)
class Results:
    """What pytest said of each test: "" passed, else failure or error, and its text."""

    folder: Path
    found: dict[str, tuple[str, str]]

    def text(self, kind: str, test: str) -> str:
        """Return the text with which `test` ended, after checking that it ended so."""
        assert self.found[test][0] == kind, self.found[test]
        return self.found[test][1]


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """Return the results of a project's tests, in a process of its own, run from above its folder."""
    folder = tmp_path_factory.mktemp("project")
    (folder / "tests").mkdir()
    (folder / "tests" / "my_law.py").write_text(LAW, encoding="utf-8")
    (folder / "tests" / "test_laws.py").write_text(TESTS, encoding="utf-8")
    (folder / "pytest.ini").write_text("[pytest]\naddopts = --strict-markers\n", encoding="utf-8")
    words = ["-m", "pytest", "-p", "no:cacheprovider", "--junitxml", "out.xml",
             "--hil-records", "kept"]  # fmt: skip
    done = subprocess.run(
        [sys.executable, *words], check=False, cwd=folder, capture_output=True, text=True
    )
    assert done.returncode == 1, done.stdout + done.stderr
    found = {}
    for case in ET.parse(folder / "out.xml").getroot().iter("testcase"):
        wrong = case.find("failure") if case.find("failure") is not None else case.find("error")
        found[case.attrib["name"]] = (
            ("", "") if wrong is None else (wrong.tag, f"{wrong.get('message')}\n{wrong.text}")
        )
    return Results(folder, found)


def test_the_plugin_is_an_entry_point() -> None:
    """Pytest finds it in an installed harness without being told."""
    (point,) = [item for item in entry_points(group="pytest11") if item.name == "hil"]
    assert point.value == "hil.tools.pytest_plugin"


@pytest.mark.parametrize("test", ["test_holds", "test_law_of_a_file", "test_function"])
def test_where_requirements_hold_the_test_passes(results: Results, test: str) -> None:
    """With a law of the harness, with one in a file beside the test, through the function."""
    assert results.found[test] == ("", "")


@pytest.mark.parametrize(
    "test", ["test_fails", "test_fails_without_asking_for_the_record", "test_function_fails"]
)
def test_a_requirement_that_fails_fails_the_test_with_its_report(
    results: Results, test: str
) -> None:
    """Value, limit and the path of a report that is there; the body is not reached."""
    text = results.text("failure", test)
    assert re.search(r"path_length_m is 0\.\d+ m, limit <= 1e-06 m", text)
    assert "reached" not in text
    report = Path(re.search(r"report: (.*)", text)[1])  # type: ignore[index]
    record = Path(re.search(r"record: (.*)", text)[1])  # type: ignore[index]
    assert report.parent.parent == record.parent.parent == results.folder / "kept"
    assert "<html" in report.read_text(encoding="utf-8")
    assert (record / "samples.parquet").is_file()


def test_the_body_may_ask_for_more(results: Results) -> None:
    """Its own assertion fails as in any test."""
    assert "assert 1 == 7" in results.text("failure", "test_body_fails")


def test_a_fault_of_the_rig_fails_with_its_cause(results: Results) -> None:
    """A run that ends early passes nothing."""
    text = results.text("failure", "test_fault")
    assert "run not complete: fault: geofence: robot seen at (5.000" in text


@pytest.mark.parametrize(
    ("test", "said"),
    [
        ("test_unknown_scenario", "scenario-9"),
        ("test_unknown_key", "robot.mas_kg"),
        ("test_unknown_argument", "unexpected keyword argument 'kamera'"),
        (
            "test_unknown_wheel_law",
            "inner law 'lqr': the board has none of this name; choose asg-ism or pid",
        ),
        ("test_no_such_file", "none.py cannot be read"),
        ("test_no_marker", "hil_run: the test has no marker pytest.mark.hil(scenario)"),
    ],
)
def test_input_that_is_refused_is_one_line(results: Results, test: str, said: str) -> None:
    """What the command would say, without a traceback, as an error and not as a failure."""
    lines = results.text("error", test).strip().split("\n")
    assert len(lines) == 2, lines  # pytest gives it once as the message and once as the text
    assert all(said in line for line in lines)
