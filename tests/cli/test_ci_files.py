"""What a CI reads of runs: JUnit files and step summaries, with the statuses unchanged."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from hil.core.errors import RigFault
from hil.runs.execute import execute
from tests.cli.command import hil, run_pose

SHORT = ("--set", "duration_s=0.5")
HOLDS = '{metric="duration_s",min=0.4}'
FAILS = '{metric="path_length_m",max=1e-6}'


def asked(*requirements: str) -> tuple[str, ...]:
    """Return the options of a short run with these requirements."""
    return (*SHORT, "--set", f"requirements=[{','.join(requirements)}]")


def counts(element: ET.Element) -> tuple[int, int, int]:
    """Return tests, failures and errors that an element claims."""
    return tuple(int(element.attrib[name]) for name in ("tests", "failures", "errors"))  # type: ignore[return-value]


def test_each_requirement_is_a_case_and_a_failure_has_value_limit_and_record(
    tmp_path: Path,
) -> None:
    """Two requirements, one of them out of reach: two cases, one failure, status 1."""
    junit, out = tmp_path / "junit.xml", tmp_path / "run"
    done = run_pose(*asked(HOLDS, FAILS), "--out", out, "--junit", junit, "--json")
    assert done.status == 1
    root = ET.parse(junit).getroot()
    suite = root[0]
    assert (root.tag, suite.tag) == ("testsuites", "testsuite")
    assert counts(root) == counts(suite) == (2, 1, 0)
    assert suite.attrib["name"] == "scenario-1.asg-ism.asg-ism.seed 1"
    assert [child.tag for child in suite] == ["properties", "testcase", "testcase"]
    good, bad = suite.findall("testcase")
    assert (good.attrib["name"], len(good)) == ("0.4 <= duration_s s", 0)
    (failure,) = bad
    assert failure.tag == "failure"
    value = done.json["requirements"][1]["value"]
    assert failure.attrib["message"] == f"path_length_m is {value:.4g} m, limit <= 1e-06 m"
    assert str(out) in (failure.text or "")


def test_where_all_holds_the_file_has_no_failure(tmp_path: Path) -> None:
    """The negative control: the same command with what can be met ends with 0 and a green file."""
    junit = tmp_path / "junit.xml"
    done = run_pose(*asked(HOLDS), "--out", tmp_path / "run", "--junit", junit)
    assert done.status == 0
    assert counts(ET.parse(junit).getroot()) == (1, 0, 0)


def test_a_run_that_ends_early_is_all_errors(tmp_path: Path) -> None:
    """Outside the fence at the start: no requirement passes, not even one that asks for nothing."""
    junit = tmp_path / "junit.xml"
    any_value = '{metric="path_length_m",min=0}'
    done = run_pose(*asked(any_value, FAILS), "--set", "start.x_m=5", "--out", tmp_path / "run",
                    "--junit", junit)  # fmt: skip
    assert done.status == 3
    root = ET.parse(junit).getroot()
    assert counts(root) == (2, 0, 2)
    messages = [error.attrib["message"] for error in root.iter("error")]
    assert all("fault: geofence: robot seen at (5.000" in message for message in messages)


def test_a_scenario_without_requirements_is_one_case(tmp_path: Path) -> None:
    """A suite without cases is an error for some readers: that the run ended is the case."""
    junit = tmp_path / "junit.xml"
    done = run_pose(*asked(), "--out", tmp_path / "run", "--junit", junit)
    assert done.status == 0
    assert counts(ET.parse(junit).getroot()) == (1, 0, 0)


def test_a_rig_that_does_not_open_is_an_error_in_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No record, status 3: the file says what the line on stderr says."""

    def no_rig(*_: object) -> None:
        raise RigFault("serial port /dev/ttyX: gone")

    monkeypatch.setattr("hil.runs.execute.open_rig", no_rig)
    junit = tmp_path / "junit.xml"
    done = run_pose(*SHORT, "--out", tmp_path / "run", "--junit", junit)
    assert (done.status, done.err) == (3, "hil: serial port /dev/ttyX: gone\n")
    root = ET.parse(junit).getroot()
    assert counts(root) == (1, 0, 1)
    assert root.find(".//error").attrib["message"] == "serial port /dev/ttyX: gone"  # type: ignore[union-attr]


@pytest.mark.parametrize("command", ["run", "experiment", "compare"])
def test_a_file_that_cannot_be_written_is_refused_before_anything_runs(
    tmp_path: Path, command: str
) -> None:
    """One line, status 2, and no record."""
    target = {"run": ["scenario-1"], "experiment": ["thesis"], "compare": [tmp_path]}[command]
    out = [] if command == "compare" else ["--out", tmp_path / "run"]
    done = hil(command, *target, *out, "--junit", tmp_path / "none" / "junit.xml")
    assert f"{tmp_path / 'none'} is no folder that can be written" in done.refusal
    assert list(tmp_path.iterdir()) == []


def test_a_refused_command_writes_no_file(tmp_path: Path) -> None:
    """Bad input is no test result."""
    junit = tmp_path / "junit.xml"
    assert run_pose("--set", "robot.mass_kg=-1", "--junit", junit).refusal
    assert not junit.exists()


def test_text_of_others_stays_xml_and_markdown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A fault with controls, brackets and bars can be read by both readers, on one line."""

    def broken(*_: object) -> None:
        raise RigFault("port \x00<b>&\"'\x1b[31m | said\nno \ud800 \ufffe")

    monkeypatch.setattr("hil.runs.execute.open_rig", broken)
    junit = tmp_path / "junit.xml"
    assert run_pose(*SHORT, "--out", tmp_path / "run", "--junit", junit).status == 3
    message = ET.parse(junit).getroot().find(".//error").attrib["message"]  # type: ignore[union-attr]
    assert message.startswith("port \\x00<b>&\"'\\x1b[31m | said\\nno \\ud800")


def test_experiment_has_a_suite_for_each_run_and_names_its_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One scenario, both laws: two suites, each failure with the report's path, one summary."""
    monkeypatch.setattr("hil.study.experiment.circle_study", lambda: None)
    monkeypatch.setattr("hil.study.side_by_side.run_all", lambda specs, _: [*map(execute, specs)])
    summary = tmp_path / "summary.md"
    summary.write_text("before\n", encoding="utf-8")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(summary))
    deck, junit, out = tmp_path / "deck.toml", tmp_path / "junit.xml", tmp_path / "e"
    deck.write_text('scenarios = ["scenario-1"]\n', encoding="utf-8")
    done = hil("experiment", deck, "--camera", "pose", *asked(HOLDS, FAILS),
               "--out", out, "--junit", junit)  # fmt: skip
    assert done.status == 1
    root = ET.parse(junit).getroot()
    assert counts(root) == (4, 2, 0)
    assert len({suite.attrib["name"] for suite in root}) == len(root) == 2
    for failure in root.iter("failure"):
        assert f"report: {out / 'report.html'}" in (failure.text or "")
    text = summary.read_text(encoding="utf-8")
    assert text.startswith("before\n### hil experiment ")
    assert "| scenario-1 | twin | asg-ism | asg-ism | 1 | 0 |" in text
    assert text.count("- **failure** ") == 2
    assert "report.html" in text


def test_compare_judges_records(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two records, one summary that counts them; both files say the same."""
    for name, requirement in (("a", HOLDS), ("b", HOLDS)):
        assert run_pose(*asked(requirement), "--out", tmp_path / name).status == 0
    summary, junit = tmp_path / "summary.md", tmp_path / "junit.xml"
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(summary))
    done = hil("compare", tmp_path / "a", tmp_path / "b", "--junit", junit)
    assert done.status == 0
    assert counts(ET.parse(junit).getroot()) == (2, 0, 0)
    assert "| scenario-1 | twin | asg-ism | asg-ism | 2 | 2 |" in summary.read_text("utf-8")


def test_a_summary_that_cannot_be_written_decides_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One line on stderr, the status of the run."""
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(tmp_path))
    done = run_pose(*asked(HOLDS), "--out", tmp_path / "run")
    assert done.status == 0
    assert "hil: no summary: GITHUB_STEP_SUMMARY=" in done.err
