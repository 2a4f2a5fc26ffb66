"""`hil list` and `hil new`: what is there, from where, and starting points that run at once."""

from __future__ import annotations

import json
import sys
import tomllib
from pathlib import Path
from urllib.parse import urlparse
from urllib.request import url2pathname

import jsonschema
import pytest

import hil
from hil.core import registries
from hil.core.registry import Registry
from hil.tools import inventory
from tests.cli.command import hil as command
from tests.own.starts import law_text, written


def test_list_shows_names_settings_bounds_and_units():
    """The gains of a law stand there with bounds, unit and search box, and how they are set."""
    (pid,) = [
        i for i in command("list", "laws", "--json").json["laws"]["items"] if i["name"] == "pid"
    ]
    assert (pid["origin"], pid["set_by"]) == ("built in", "control.gains.tuned.pid.")
    (kp,) = [setting for setting in pid["settings"] if setting["key"] == "kp_s3"]
    assert (kp["unit"], kp["low"], kp["high"], kp["low_excluded"]) == ("1/s^3", 0, 1e6, True)
    assert pid["search"]["kp_s3"] == [0.3, 6.0, 200.0]
    text = command("list", "laws").out
    assert "kp_s3 (must be given, above 0 to 1e+06, searched 0.3 to 200 1/s^3): on delta1" in text


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("estimators", "fused"), ("localisers", "tags"), ("references", "waypoints"),
        ("scenarios", "scenario-1"), ("robots", "thesis-4wd"), ("decks", "thesis"),
        ("campaigns", "limits"), ("figures", "ise_m2_s"), ("wheel-laws", "pid"),
    ],
)  # fmt: skip
def test_every_kind_is_listed(kind, name):
    """Each kind can be listed alone, and stands in the list of all."""
    assert name in {item["name"] for item in command("list", kind, "--json").json[kind]["items"]}
    assert name in command("list").out


def test_unknown_kind_and_bad_file_are_refused(tmp_path: Path):
    """A kind that is none, and a file that registers nothing, are one line and status 2."""
    assert "wheels" in command("list", "wheels").refusal
    none = written(tmp_path / "none.py", "x = 1\n")
    assert "registers no outer law" in command("list", "laws", none).refusal


def test_files_that_ship_say_what_they_are():
    """Robots, decks and campaigns are told in words, not by a note to editors; a robot's file is checked."""
    for kind in ("robots", "decks", "campaigns"):
        for item in command("list", kind, "--json").json[kind]["items"]:
            assert " " in item["summary"], item
            assert "schema" not in item["summary"], item
    assert "hil check robot my.toml" in command("list", "robots", "my.toml").refusal


def test_a_file_that_is_no_python_is_not_offered_as_one():
    """Where another kind of file is named as a law, the way out is a file that ends in .py."""
    said = command("run", "scenario-1", "--outer", "gains.toml").refusal
    assert "or name a file: one that ends in .py" in said
    assert "or name a file: ./pdi.py" in command("run", "scenario-1", "--outer", "pdi").refusal


def test_list_shows_a_file_beside_the_rest(tmp_path: Path):
    """With a file named, what it registers is listed with its path and its own trace."""
    file = written(tmp_path / "listed.py", law_text("listed-law"))
    items = {i["name"]: i for i in command("list", "laws", file, "--json").json["laws"]["items"]}
    assert items["listed-law"]["origin"] == str(file)
    assert items["listed-law"]["trace"][0]["unit"] == "m/s"


@pytest.fixture
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Two packages installed in a folder on the path: one brings a law, one fails to import."""
    for name, text in {
        "goodlab": law_text("goodlab-law"),
        "badlab": "import no_such_module_of_badlab\n",
    }.items():
        written(tmp_path / f"{name}.py", text)
        info = tmp_path / f"{name}-1.0.dist-info"
        info.mkdir()
        written(info / "METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        written(info / "entry_points.txt", f"[skid_steer_hil.outer_laws]\n{name} = {name}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    laws = Registry("outer law", "skid_steer_hil.outer_laws", "hil.control.laws")
    laws._entries = {e.name: e for e in registries.OUTER_LAWS.entries() if e.origin == "built in"}
    monkeypatch.setattr(registries, "OUTER_LAWS", laws)
    monkeypatch.setitem(inventory.BY_PLURAL, "laws", laws)
    monkeypatch.setitem(hil.__dict__, "outer_law", laws.register)
    yield laws
    for name in ("goodlab", "badlab"):
        sys.modules.pop(name, None)


def test_a_law_of_an_installed_package_is_listed(packages: Registry):
    """An entry point makes the law known, and the list says which package it is of."""
    found = command("list", "laws", "--json").json["laws"]
    names = {item["name"]: item["origin"] for item in found["items"]}
    assert names["goodlab-law"] == "package goodlab"
    assert packages.get("goodlab-law").settings is not None


def test_a_package_that_fails_to_import_is_told_in_one_line(packages: Registry):
    """Its own error stands in the list; the rest, and the help, work all the same."""
    done = command("list", "laws")
    assert done.status == 0
    (line,) = [line for line in done.out.splitlines() if "could not be loaded" in line]
    assert "badlab: ModuleNotFoundError: No module named 'no_such_module_of_badlab'" in line
    assert "pid" in done.out
    assert command("--help").status == 0
    assert "badlab" in packages.failed


def test_new_writes_and_never_overwrites(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The contract: NAME.py in the current folder; a second time is refused and changes nothing."""
    monkeypatch.chdir(tmp_path)
    assert command("new", "law", "first-law").status == 0
    text = (tmp_path / "first-law.py").read_text()
    assert '@hil.outer_law(\n    "first-law"' in text
    assert "class FirstLaw:" in text
    (tmp_path / "first-law.py").write_text(text + "# mine\n")
    assert "is there already" in command("new", "law", "first-law").refusal
    assert (tmp_path / "first-law.py").read_text().endswith("# mine\n")


@pytest.mark.parametrize(
    ("kind", "name", "said"),
    [
        ("law", "pid", "taken"), ("law", "asg_ism", "taken"), ("law", "a/b", "letters"),
        ("law", "../x", "letters"), ("law", "json", "hide"), ("law", "numpy", "hide"),
        ("law", "", "letters"), ("localiser", "tags", "taken"), ("scenario", "scenario-1", "taken"),
        ("robot", "thesis-4wd", "taken"), ("estimator", "fused", "taken"),
    ],
)  # fmt: skip
def test_new_refuses_names_that_cannot_be(kind, name, said, tmp_path: Path, monkeypatch):
    """Taken names, paths, and names of Python's own modules are one line, and nothing is written."""
    monkeypatch.chdir(tmp_path)
    assert said in command("new", kind, name).refusal
    assert list(tmp_path.iterdir()) == []


def test_new_scenario_with_a_new_robot_runs_at_once(tmp_path: Path, monkeypatch):
    """A robot and a scenario for it, written and run without touching them."""
    monkeypatch.chdir(tmp_path)
    assert command("new", "robot", "own-robot").status == 0
    assert command("new", "scenario", "own-task", "--robot", "own-robot.toml").status == 0
    done = command("run", "./own-task.toml", "--camera", "pose", "--json", "--out", "run")
    assert done.status == 0, done.err
    assert all(item["holds"] for item in done.json["requirements"])
    assert (tmp_path / "run" / "manifest.json").read_text().count('"own-robot"') == 1
    assert "only a scenario" in command("new", "law", "x-law", "--robot", "r.toml").err


def test_new_plant_drives_the_twin(tmp_path: Path, monkeypatch):
    """As it is written, and what it answers counts: turned about, the robot does not arrive."""
    monkeypatch.chdir(tmp_path)
    assert command("new", "plant", "own-plant").status == 0
    words = [
        "run",
        "scenario-1",
        "--camera",
        "pose",
        "--set",
        "robot.plant=./own-plant.py",
        "--json",
    ]
    assert command(*words, "--out", "run").status == 0
    path = tmp_path / "own-plant.py"
    text = path.read_text()
    path.write_text(text.replace("(right - left) / self.track", "(left - right) / self.track"))
    assert path.read_text() != text
    assert command(*words, "--out", "wrong").status in (1, 3)


def test_targets_and_vehicles_are_listed():
    """Each with where it is from; an unknown target is told with those there are."""
    listed = command("list", "targets", "--json").json["targets"]["items"]
    assert {"twin", "pil", "serial", "replay"} <= {item["name"] for item in listed}
    listed = command("list", "vehicles", "--json").json["vehicles"]["items"]
    assert {"skid-steer", "differential"} <= {item["name"] for item in listed}
    refusal = command("run", "scenario-1", "--on", "twim").refusal
    assert "choose twin, pil, serial:DEV[@BAUD] or replay:RUN" in refusal


@pytest.mark.parametrize("kind", ["law", "estimator", "localiser"])
def test_what_new_writes_passes_the_kit(kind, tmp_path: Path, monkeypatch):
    """The starting points keep every rule of the conformance kit as they are written."""
    monkeypatch.chdir(tmp_path)
    assert command("new", kind, f"fresh-{kind}").status == 0
    done = command("check", kind, f"fresh-{kind}.py", "--json")
    assert [check for check in done.json["checks"] if not check["holds"]] == []
    assert done.status == 0


@pytest.mark.parametrize(
    ("kind", "decorator", "missing"),
    [
        ("law", "outer_law", "reset and no step; a outer law needs reset, step"),
        ("estimator", "estimator", "on_wheels and no on_pose"),
        ("localiser", "localiser", "locate"),
    ],
)
def test_a_class_that_is_none_is_told_what_is_missing(kind, decorator, missing, tmp_path: Path):
    """A registered class without its methods is refused when it is loaded, not in a run."""
    text = f'import hil\n\n\n@hil.{decorator}("hollow-{kind}")\nclass Hollow:\n    pass\n'
    refusal = command("check", kind, written(tmp_path / "hollow.py", text)).refusal
    assert "class Hollow has no " in refusal
    assert missing.replace("a outer", "an outer") in refusal


@pytest.mark.parametrize("kind", ["robot", "scenario"])
def test_a_new_file_names_the_installed_schema_and_keeps_it(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """The first line is the address of a schema that is there; the file is valid by it, a wrong one not."""
    monkeypatch.chdir(tmp_path)
    command("new", kind, "mine")
    text = Path("mine.toml").read_text(encoding="utf-8")
    address = text.splitlines()[0].removeprefix("#:schema ")
    schema = json.loads(Path(url2pathname(urlparse(address).path)).read_text(encoding="utf-8"))
    checker = jsonschema.Draft202012Validator(schema)
    tree = tomllib.loads(text)
    assert list(checker.iter_errors(tree)) == []
    assert list(checker.iter_errors(tree | {"colour": "red"}))
