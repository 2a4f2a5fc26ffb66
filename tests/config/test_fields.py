"""Unit, bounds, default and meaning of every value are data, and messages and reports use them."""

from __future__ import annotations

from typing import get_args

import pytest

from hil.config.events import TARGET_UNITS, Target
from hil.config.fields import Setting, settings, told
from hil.config.limits import board_table
from hil.config.load import load_robot, load_scenario, put_value
from hil.config.robot import RobotConfig
from hil.config.scenario import Scenario
from hil.config.sources import built_in_settings
from hil.core.errors import BadInput
from hil.core.figures import BY_NAME
from hil.core.registries import OUTER_LAWS
from hil.report.assumptions import assumptions, gain_assumptions

ALL = {(setting.key, setting.kind): setting for setting in settings(Scenario)}
# Plain numbers: exponents, coefficients, counters and seeds; all others have a unit or are a share.
PLAIN = {
    "camera.lens.k1", "camera.lens.k2", "camera.lens.k3", "camera.lens.k4",
    "camera.lens.k5", "camera.lens.k6", "camera.lens.p1", "camera.lens.p2",
    "camera.lens.shift_degree", "camera.pose.R_world_cam", "camera.robot_look.tag.tag_id",
    "camera.scene.texture_seed", "control.fusion.gate_chi2", "disturbances.*.seed",
    "disturbances.*.amplitude", "requirements.*.min", "requirements.*.max",
    *(f"control.gains.{name}.asg_ism.{key}" for name in ("tuned", "thesis") for key in ("p", "beta")),
    *(f"control.gains.{name}.super_twisting.{key}" for name in ("tuned", "thesis") for key in ("l0", "l1")),
}  # fmt: skip


def is_number(setting: Setting) -> bool:
    """Say whether a setting is a number, as far as its bounds and default tell."""
    default = setting.default
    is_bool = isinstance(default, bool)
    return setting.low is not None or (isinstance(default, int | float) and not is_bool)


def test_every_number_has_its_unit_and_every_value_its_meaning() -> None:
    """No unit is left to be guessed from a name."""
    without = {
        s.key
        for s in ALL.values()
        if is_number(s) and not s.unit and not s.key.startswith("board.")
    }
    assert without <= PLAIN
    nameless = [s.key for s in ALL.values() if not s.meaning]
    assert set(nameless) <= {
        "reference.kind", "camera.scene.glare", "camera.scene.shadow_edge",
        "camera.scene.clutter", "camera.scene.bars",
    }  # fmt: skip
    assert len(ALL) > 230


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("robot.motor.viscous_n_m_s_rad", "N m s/rad"),
        ("robot.motor.torque_constant_n_m_a", "N m/A"),
        ("robot.motor.emf_constant_v_s_rad", "V s/rad"),
        ("robot.motor.gear_ratio", "(ratio)"),
        ("robot.battery.capacity_a_h", "A h"),
        ("robot.mass_kg", "kg"),
        ("control.gains.tuned.asg_ism.k1_s", "1/s"),
        ("control.gains.tuned.asg_ism.mu0_s", "s"),
        ("control.gains.tuned.pid.kp_s3", "1/s^3"),
        ("control.limits.zeta_max_m_s2", "m/s^2"),
        ("control.fusion.slip_ratio", "m^0.5"),
        ("camera.scene.white_dn", "DN"),
        ("camera.lens.shift_v", "half widths"),
        ("link.baud", "bit/s"),
        ("board.ISM_G", "duty*s^2/rad"),
    ],
)
def test_units_are_those_of_the_quantity(key: str, unit: str) -> None:
    """Hand-written: what the thesis, a data sheet or the formula says the unit is."""
    tree = load_scenario("scenario-1").model_dump(mode="json")
    assert told(Scenario, key, tree).unit == unit
    assert ALL[key, ""].unit == unit


def test_units_that_another_value_decides() -> None:
    """An amplitude has the unit of its target, a requirement that of its figure."""
    assert set(TARGET_UNITS) == set(get_args(Target))
    push = {"target": "force_left_n", "shape": "step", "amplitude": 5.0}
    limit = {"metric": "ise_m2_s", "max": 1.0}
    tree = {"disturbances": [push, push | {"target": "slope_x_rad"}], "requirements": [limit]}
    assert told(Scenario, "disturbances.0.amplitude", tree).unit == "N"
    assert told(Scenario, "disturbances.1.amplitude", tree).unit == "rad"
    assert told(Scenario, "requirements.0.max", tree).unit == BY_NAME["ise_m2_s"].unit
    assert told(Scenario, "mismatch.motor.resistance_ohm", {"mismatch": {}}).unit == "(ratio)"
    assert told(Scenario, "no.such.key", tree).unit == ""


def test_gains_are_reported_with_their_own_units() -> None:
    """The report's table of gains: 1/s^3 for kp, not s^3 and not nothing."""
    pid = {"kp_s3": 1.0, "ki_s4": 0.0, "kd1_s2": 1.0, "kd2_s": 1.0}
    units = {item.key: item.unit for item in gain_assumptions("pid", pid, "set tuned")}
    assert units == {"kp_s3": "1/s^3", "ki_s4": "1/s^4", "kd1_s2": "1/s^2", "kd2_s": "1/s"}
    assert set(units) <= {
        key for law in OUTER_LAWS.entries() if law.settings for key in law.settings.model_fields
    }


def test_conditions_have_unit_meaning_and_source() -> None:
    """Each row of the conditions is as its field says; a changed value loses the default's source."""
    tree = load_scenario("scenario-1", ["camera.exposure_s=0.004"]).model_dump(mode="json")
    rows = {item.key: item for _, items in assumptions(tree) for item in items}
    assert rows["robot.motor.viscous_n_m_s_rad"].unit == "N m s/rad"
    assert rows["camera.robot_look.track_m"].source == "thesis table 8.3"
    assert rows["camera.exposure_s"].source == ""
    assert rows["robot.track_m"].source.startswith("table 8.3")


def test_every_setting_can_be_set_and_its_bounds_are_those_of_the_message() -> None:
    """Just beyond each bound of the robot's file the refusal has key, unit and bound."""
    robot = load_robot("thesis-4wd").model_dump(mode="json")
    for setting in settings(RobotConfig):
        if setting.high is None or setting.key.startswith("bring_up") or setting.kind:
            continue
        for beyond in (setting.high + 1, (setting.low or 0.0) - 1):
            tree = load_scenario("scenario-1").model_dump(mode="json")
            put_value(tree, f"robot.{setting.key}", beyond)
            with pytest.raises(BadInput) as caught:
                load_scenario("scenario-1", [f"robot.{setting.key}={beyond}"])
            bound = setting.high if beyond > 0 and beyond > setting.high else setting.low
            said = str(caught.value)
            assert f"robot.{setting.key} = {beyond} {setting.unit}:" in said
            assert said.endswith(f"{bound:g} {setting.unit}") or repr(bound) in said
    assert set(robot) - {"name", "variant", "bring_up", "log_fit"} <= {
        setting.key.split(".")[0] for setting in settings(RobotConfig)
    }


def test_bounds_in_words() -> None:
    """What a listing shows of bounds."""
    assert ALL["robot.mass_kg", ""].bounds() == "0.5 to 50"
    assert ALL["duration_s", ""].bounds() == "above 0 to 36000"
    assert ALL["camera.lens.fx_px", ""].bounds() == "above 10"
    assert ALL["camera.robot_look.tag.tag_id", ""].bounds() == "from 0"
    assert ALL["reference.rate_rad_s", "circle"].default == 0.1
    entry = board_table()["W_MAX"]
    assert (ALL["board.W_MAX", ""].low, ALL["board.W_MAX", ""].high) == (
        entry.minimum,
        entry.maximum,
    )


def test_the_built_in_values_come_with_their_sources() -> None:
    """A listing has value and source of every number of robot and gains, from the files themselves."""
    listed = {(item.key, item.kind): item for item in built_in_settings()}
    assert listed.keys() == ALL.keys()
    radius = listed["robot.wheel_radius_m", ""]
    assert (radius.default, radius.unit, radius.source) == (0.0482, "m", "table 8.3, r = 4.82 cm")
    robot = [item for (key, _), item in listed.items() if key.startswith("robot.")]
    missing = [item.key for item in robot if is_number(item) and not item.source]
    assert [key for key in missing if "bring_up" not in key] == []
    gains = [item for (key, _), item in listed.items() if ".asg_ism." in key or ".pid." in key]
    assert len(gains) == 2 * (14 + 5)
    numbers = [
        item for item in gains if is_number(item) and not item.key.endswith("zeta_start_m_s2")
    ]
    assert len(numbers) == 2 * (12 + 4)
    assert all(isinstance(item.default, float) for item in numbers)
    thesis_k1 = listed["control.gains.thesis.asg_ism.k1_s", ""]
    assert thesis_k1.source == "not printed; docs/control.md section 6"
