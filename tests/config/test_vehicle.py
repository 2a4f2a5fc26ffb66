"""Kinds of vehicle in robot files: what each needs, what it refuses, and how a robot is chosen."""

from __future__ import annotations

import math
from importlib.resources import files

import pytest

from hil.config.load import load_robot, load_scenario
from hil.config.mismatch import true_robot
from hil.control.vehicles.vehicle import make_vehicle
from hil.core.errors import BadInput
from hil.core.registries import VEHICLES
from hil.core.registry import BUILT_IN
from hil.core.types import Pose
from tests.cli.command import hil

DIFF = (files("hil") / "data" / "robots" / "diff-2wd.toml").read_text(encoding="utf-8")
THESIS = (files("hil") / "data" / "robots" / "thesis-4wd.toml").read_text(encoding="utf-8")


def test_a_robot_file_that_does_not_say_its_vehicle_is_a_skid_steer():
    """The thesis's robot file has no vehicle table and keeps its axles."""
    assert "[vehicle]" not in THESIS
    robot = load_robot("thesis-4wd")
    assert robot.vehicle.kind == "skid-steer"
    contacts = make_vehicle(robot).contacts
    assert (contacts.front_m, contacts.rear_m) == (0.075, 0.075)
    assert contacts.castor_friction_ratio is None


def test_a_differential_robot_stands_on_its_axle_and_its_castor():
    """Axle d0 = 20 mm ahead, castor 90 mm behind it: the castor carries 2/9 of the weight."""
    contacts = make_vehicle(load_robot("diff-2wd")).contacts
    assert (contacts.front_m, contacts.rear_m) == (0.020, pytest.approx(0.070))
    assert contacts.rear_load_ratio == pytest.approx(2 / 9)


@pytest.mark.parametrize("name", ["thesis-4wd", "diff-2wd"])
def test_wheels_and_body_are_each_other_s_inverse(name):
    """0.3 m/s and 1 rad/s to the left: the right wheel is faster by W/r, and back again."""
    robot = load_robot(name)
    vehicle = make_vehicle(robot)
    left, right = vehicle.wheels(0.3, 1.0)
    assert right - left == pytest.approx(robot.track_m / robot.wheel_radius_m)
    assert vehicle.body(left, right) == (pytest.approx(0.3), pytest.approx(1.0))
    z1 = vehicle.flat_output(Pose(1.0, 2.0, 0.5 * math.pi))
    assert z1 == (pytest.approx(1.0), pytest.approx(2.0 + robot.d0_m))


def test_every_registered_vehicle_says_what_it_is():
    built_in = [entry for entry in VEHICLES.entries() if entry.origin == BUILT_IN]
    assert [entry.name for entry in built_in] == ["differential", "skid-steer"]
    assert all(entry.summary and entry.settings for entry in built_in)


@pytest.mark.parametrize(
    ("text", "change", "said"),
    [
        (DIFF, ('kind = "differential"', 'kind = "diferential"'), "near: differential"),
        (DIFF, ("d0_m = 0.020", "d0_m = 0.095"), "below vehicle.castor_behind_m = 0.09 m"),
        (DIFF, ("track_m = 0.150", "track_m = 0.150\nfront_axle_m = 0.075"),
         "front_axle_m = 0.075 m belongs to a skid-steer robot"),
        (DIFF, ("castor_behind_m = 0.090", ""), "vehicle.castor_behind_m: missing"),
        (DIFF, ("castor_friction_ratio = 0.05", "castor_friction_ratio = 1.5"), "(ratio)"),
        (DIFF, ("castor_behind_m = 0.090", "castor_behind_m = 0.090\ncastor = 1"),
         "near: castor_behind_m"),
        (THESIS, ("front_axle_m = 0.075 ", "# "), "front_axle_m is missing"),
        (THESIS, ("d0_m = 0.030", "d0_m = 0.160"), "below the wheelbase of 0.150 m"),
    ],
)  # fmt: skip
def test_a_robot_that_cannot_be_is_refused_in_one_line(tmp_path, text, change, said):
    """What is wrong, with its limit, and exit status 2 through the command."""
    assert change[0] in text
    path = tmp_path / "robot.toml"
    path.write_text(text.replace(*change), encoding="utf-8")
    with pytest.raises(BadInput) as refused:
        load_robot(str(path))
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_another_robot_s_file_takes_the_robot_s_place(tmp_path):
    """A differential robot laid over the thesis's keeps nothing of it, and the other way round."""
    (tmp_path / "two.toml").write_text(DIFF, encoding="utf-8")
    scenario = tmp_path / "scenario.toml"
    scenario.write_text('base = "scenario-1"\n[robot]\nfile = "two.toml"\n', encoding="utf-8")
    two = load_scenario(str(scenario))
    assert two.robot == load_robot("diff-2wd")
    assert true_robot(two).d0_m == pytest.approx(0.022)
    back = tmp_path / "back.toml"
    back.write_text('base = "scenario.toml"\n[robot]\nfile = "thesis-4wd"\n', encoding="utf-8")
    assert load_scenario(str(back)).robot == load_robot("thesis-4wd")


def test_set_takes_a_robot_and_a_camera_by_file():
    """`--set robot.file=` replaces the robot, further values go on top, whatever their order."""
    chosen = load_scenario(
        "scenario-2", ["robot.mass_kg=1.4", "robot.file=diff-2wd", "camera.file=diff-2wd"]
    )
    assert (chosen.robot.name, chosen.robot.mass_kg) == ("diff-2wd", 1.4)
    assert chosen.camera.marks.front.x_m == 0.055
    assert chosen.camera.latency_s == load_scenario("scenario-2").camera.latency_s
    with pytest.raises(BadInput, match="did you mean diff-2wd"):
        load_scenario("scenario-2", ["robot.file=dif-2wd"])


def test_the_command_refuses_an_impossible_robot_before_anything_is_written(tmp_path):
    out = tmp_path / "run"
    done = hil("run", "scenario-1", "--set", "robot.file=diff-2wd",
               "--set", "robot.d0_m=0.2", "--out", out)  # fmt: skip
    assert "castor_behind_m = 0.09 m" in done.refusal
    assert not out.exists()
