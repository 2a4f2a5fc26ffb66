"""docs/own-robot.md as a reader follows it: its files are written, its commands run, all hold."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

from hil.config.load import load_robot, load_scenario
from hil.control.vehicles.vehicle import make_vehicle
from hil.record.reader import read_run
from tests.cli.command import hil

PAGE = (Path(__file__).parents[2] / "docs" / "own-robot.md").read_text("utf-8")
FILES = dict(re.findall(r"```(?:toml|python) (\S+)\n(.*?)```", PAGE, re.DOTALL))
COMMANDS = [
    line
    for block in re.findall(r"```console\n(.*?)```", PAGE, re.DOTALL)
    for line in block.splitlines()
]


def test_every_command_of_the_page_ends_well(tmp_path, monkeypatch):
    """From the measured numbers to three runs whose requirements hold, in the order of the page."""
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        Path(name).write_text(text, encoding="utf-8")
    assert len(FILES) == 5
    assert len(COMMANDS) == 4
    for line in COMMANDS:
        program, *words = shlex.split(line)
        assert program == "hil"
        done = hil(*words)
        assert done.status == 0, (line, done.out, done.err)
    tracked = load_robot("tracked.toml")
    assert make_vehicle(tracked).geometry.track_width_m == 1.2 * tracked.track_m
    (plugin,) = [
        plugin
        for run in Path("runs").iterdir()
        for plugin in read_run(run).manifest.plugins
        if plugin.kind == "vehicle"
    ]
    assert plugin.name == "tracked"
    scenario = load_scenario("my-scenario.toml")
    assert scenario.robot == load_robot("my-robot.toml")
    assert (scenario.robot.vehicle.kind, scenario.robot.motor.gear_ratio) == ("differential", 34.0)
    assert scenario.camera.robot_look.axle_x_m == 0.035


def test_every_number_of_the_page_is_one_of_a_robot_file(tmp_path):
    """The table and the text name settings that exist."""
    path = tmp_path / "my-robot.toml"
    path.write_text(FILES["my-robot.toml"], encoding="utf-8")
    known = set(load_robot(str(path)).model_dump())
    table = re.findall(r"^\| \d+ \| `(\w+)` \|", PAGE, re.MULTILINE)
    assert len(table) >= 6
    assert set(table) <= known
