"""The conformance kit of estimators, localisers and robots: built-in ones, and ones that break its rules."""

from __future__ import annotations

from pathlib import Path

import pytest

import hil
from hil.core.registries import ESTIMATORS, LOCALISERS
from hil.tools.conformance import estimator_report, localiser_report, robot_report
from tests.cli.command import hil as command
from tests.own.starts import template, written

SHORT = ("duration_s=1",)
IMPORTS = "import math\nimport random\nfrom time import monotonic\n"


@pytest.mark.parametrize("name", ESTIMATORS.names())
def test_built_in_estimators_keep_every_rule(name):
    """Every estimator that is built in passes the whole kit."""
    assert hil.check_estimator(name, overrides=SHORT).passed


@pytest.mark.parametrize("name", LOCALISERS.names())
def test_built_in_localisers_keep_every_rule(name):
    """Every localiser that is built in passes; how fast this machine is belongs to no test."""
    assert set(localiser_report(name).failures) <= {"step time"}


# check -> (what the good estimator has, what the bad one has in its place)
WHEELS = "        counts = (sample.counts_left, sample.counts_right)\n"
ANSWER = "        cos, sin, d0_m = math.cos(theta), math.sin(theta), self._geometry.d0_m\n"
ESTIMATOR = {
    "none before the first pose": (
        "            return None\n        t_s, x_m",
        "            self._path = [(t_host_s, 0.0, 0.0, 0.0)]\n        t_s, x_m",
    ),
    "finite": (ANSWER, "        theta += math.nan if t_host_s > 3.0 else 0.0\n" + ANSWER),
    "follows the robot": (ANSWER, "        theta *= 0.5\n" + ANSWER),
    "deterministic": (ANSWER, "        theta += 1e-12 * random.Random().random()\n" + ANSWER),
    "asking changes nothing": (
        ANSWER,
        "        self._path[-1] = (t_host_s, *z1, theta)\n" + ANSWER,
    ),
    "no state shared": (
        ANSWER,
        "        SEEN.append(t_host_s)\n        theta += 1e-12 * len(SEEN)\n" + ANSWER,
    ),
    "no clock": (WHEELS, WHEELS + "        monotonic()\n"),
    "no unseeded random number": (WHEELS, WHEELS + "        random.gauss(0.0, 1.0)\n"),
    "mirror symmetry": (ANSWER, "        theta += 0.001\n" + ANSWER),
}


@pytest.mark.parametrize("check", ESTIMATOR)
def test_an_estimator_that_breaks_a_rule_is_told_by_its_name(check, tmp_path: Path):
    """Each check has an estimator that violates it and is reported by it."""
    good, bad = ESTIMATOR[check]
    text = template("estimator.py", f"broken-{check.replace(' ', '-')}")
    assert good in text
    text = text.replace(good, bad).replace("import math\n", IMPORTS + "\nSEEN: list[float] = []\n")
    file = written(tmp_path / "broken.py", text)
    report = estimator_report(file, overrides=SHORT)
    assert check in report.failures
    if check in {"no clock", "no unseeded random number", "mirror symmetry"}:
        assert report.failures == (check,)
    with pytest.raises(AssertionError, match=check):
        report.required()


def test_an_estimator_blind_to_sides_fails_its_control(tmp_path: Path):
    """One that takes the absolute heading follows neither scene: the kit says so of the first."""
    text = template("estimator.py", "one-sided")
    text = text.replace(ANSWER, "        theta = abs(theta)\n" + ANSWER)
    failures = estimator_report(written(tmp_path / "e.py", text), overrides=SHORT).failures
    assert "follows the robot" in failures
    assert "mirror symmetry" in failures


def test_a_localiser_that_breaks_rules_is_told_by_each(tmp_path: Path):
    """One localiser that breaks the rules of reading, one that invents and is wrong."""
    text = template("localiser.py", "sloppy").replace("import math\n", IMPORTS + "\nSEEN = [0]\n")
    first = "        blue, green, red = cv2.split(image_bgr)\n"
    assert first in text
    sloppy = text.replace(
        first,
        first
        + "        monotonic()\n        random.random()\n        image_bgr[0, 0] = SEEN[0] % 255\n"
        "        SEEN[0] += 1\n",
    ).replace("sigma_xy_m=0.002", "sigma_xy_m=0.002 * (SEEN[0] % 3)")
    failures = set(localiser_report(written(tmp_path / "sloppy.py", sloppy)).failures)
    assert failures == {
        "honest figures", "deterministic", "no state shared", "picture left as it is", "no clock",
        "no unseeded random number",
    }  # fmt: skip
    inventive = template("localiser.py", "inventive").replace(
        'return hil.PoseMeasurement(None, 0.0, f"{which} mark not found")',
        "return hil.PoseMeasurement(hil.Pose(0.0, 0.0, 0.0), 1.0, which)",
    ).replace("pose = hil.Pose(x_m, y_m,", "pose = hil.Pose(x_m + 0.02, y_m,")  # fmt: skip
    failures = set(localiser_report(written(tmp_path / "i.py", inventive)).failures)
    assert failures == {"finds the robot", "near a prediction", "nothing where nothing is"}


def test_robots_too_heavy_or_no_robots_at_all(tmp_path: Path):
    """A robot that its motors cannot move fails the experiments; a file that is none is refused."""
    report = robot_report("thesis-4wd", overrides=("duration_s=1", "requirements=[]"))
    assert report.failures == ("negative control",)
    text = template("robot.toml", "heavy")
    base = (Path(hil.__file__).parent / "data/robots/thesis-4wd.toml").read_text()
    heavy = text + base.replace('"thesis-4wd"', '"heavy"').replace("= 2.8 ", "= 50.0 ")
    done = command(
        "check", "robot", written(tmp_path / "heavy.toml", heavy), "--set", "duration_s=4", "--json"
    )  # fmt: skip
    assert done.status == 1
    wrong = {check["name"] for check in done.json["checks"] if not check["holds"]}
    assert {"scenario-1 holds", "scenario-2 holds", "scenario-3 holds"} <= wrong
    none = written(tmp_path / "none.toml", "mass_kg = 3.0\n")
    assert "missing" in command("check", "robot", none).refusal
    assert command("check", "robot", "thesis-4wd", "--scenario", "circle").status == 2
