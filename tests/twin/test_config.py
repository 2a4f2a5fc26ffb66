"""Robot file, bounds, and the names that Python and C++ share."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from typing import get_args

import pytest
from pydantic import ValidationError

from hil.config.events import Disturbance, Fault, FaultKind, Shape, Target
from hil.config.link import LinkConfig
from sim_twin import _native
from sim_twin.setup import plant_params
from tests.twin.rigs import robot

ROBOT_FILE = files("hil") / "data" / "robots" / "thesis-4wd.toml"


def test_every_number_of_the_robot_file_says_where_it_comes_from():
    """Each value has a comment; those of table 8.3 have the printed values."""
    for line in ROBOT_FILE.read_text(encoding="utf-8").splitlines():
        if "=" in line and not line.startswith(("#", "name")):
            assert "#" in line, line
            assert len(line.split("#")[1].strip()) > 5, line
    tree = tomllib.loads(ROBOT_FILE.read_text(encoding="utf-8"))
    assert (tree["wheel_radius_m"], tree["track_m"]) == (0.0482, 0.2166)
    assert tree["front_axle_m"] + tree["rear_axle_m"] == 0.15


def test_motor_constants_agree_with_the_motor_sheet():
    """12 V: no load 31.4 rad/s at 0.15 A; stall 2.4 A; both torque and EMF constants are one."""
    motor = robot().motor
    no_load_rad_s = (12 - 0.15 * motor.resistance_ohm) / (motor.emf_constant_v_s_rad * 30)
    assert no_load_rad_s == pytest.approx(31.4, rel=0.01)
    friction = motor.coulomb_n_m + motor.viscous_n_m_s_rad * 31.4
    gear = motor.torque_constant_n_m_a * motor.gear_ratio * motor.gear_efficiency_ratio
    assert friction / gear == pytest.approx(0.15, rel=0.05)
    assert 12 / motor.resistance_ohm == pytest.approx(2.4)
    assert motor.torque_constant_n_m_a == motor.emf_constant_v_s_rad


def test_every_parameter_reaches_the_plant():
    """No parameter of the C++ plant is left at its zero but those the file has at zero."""
    params = plant_params(robot())
    values = {name: getattr(params, name) for name in _native.PARAMETERS}
    assert all(values.values()), [name for name, value in values.items() if not value]
    assert values["motor_resistance_ohm"] == 5.0
    assert values["mass_kg"] == 2.8
    assert not params.slip
    assert plant_params(robot(variant="slip")).slip


def test_scenario_and_kernel_know_the_same_events():
    """The names in the scenario's types are those of the C++ lists, in the same order."""
    assert get_args(Target) == _native.LOADS
    assert set(get_args(Shape)) == set(_native.SHAPES)
    assert set(_native.FAULTS) < set(get_args(FaultKind))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"mass_kg": 0.0}, "mass_kg"),
        ({"d0_m": 0.2}, "wheelbase"),
        ({"motor_stiction_n_m": 0.01}, "at least coulomb_n_m"),
        ({"motor_inductance_h": 2e-4}, "inductance_h must be at least"),
        ({"variant": "flying"}, "variant"),
        ({"wheels": 3}, "wheels"),
        (
            {"variant": "slip", "wheel_inertia_kg_m2": 0.0, "motor_rotor_inertia_kg_m2": 0.0},
            "wheel_inertia_kg_m2 and motor.rotor_inertia_kg_m2",
        ),
        (
            {"variant": "lifted", "wheel_inertia_kg_m2": 1e-9, "motor_rotor_inertia_kg_m2": 0.0},
            "wheel_inertia_kg_m2 and motor.rotor_inertia_kg_m2",
        ),
    ],
)
def test_a_robot_that_cannot_be_is_refused(change, says):
    """Each impossible value is an error that names it."""
    with pytest.raises(ValidationError, match=says):
        robot(**change)


def test_events_that_make_no_sense_are_refused():
    """End before start, a pulse without end, a side where there is none."""
    with pytest.raises(ValidationError, match="after start_s"):
        Fault(kind="link_cut", start_s=3, end_s=2)
    with pytest.raises(ValidationError, match="needs end_s"):
        Disturbance(target="force_forward_n", shape="pulse", amplitude=1)
    with pytest.raises(ValidationError, match="has no side"):
        Fault(kind="board_reset", side="left")
    for target, least in (("friction_change_ratio", -1), ("brake_left_n_m", 0)):
        with pytest.raises(ValidationError, match=f"{target} must be at least {least}"):
            Disturbance(target=target, shape="step", amplitude=-1.5)
        Disturbance(target=target, shape="step", amplitude=least)
        Disturbance(target=target, shape="noise", amplitude=-1.5)


@pytest.mark.parametrize("loss_ratio", [0.05, 0.55, 0.8, 0.85, 0.9])
def test_the_shortest_burst_that_is_named_is_taken(loss_ratio):
    """The bound by hand and the figure that the refusal shows both hold."""
    by_hand = {0.9: 9.0, 0.8: 4.0}.get(loss_ratio, 1.0 + loss_ratio / (1.0 - loss_ratio))
    LinkConfig(loss_ratio=loss_ratio, loss_burst_chunks=by_hand)
    if loss_ratio < 0.6:
        return
    with pytest.raises(ValidationError, match="at least") as refused:
        LinkConfig(loss_ratio=loss_ratio, loss_burst_chunks=1.0)
    shown = float(str(refused.value).split("at least ")[1].split()[0])
    LinkConfig(loss_ratio=loss_ratio, loss_burst_chunks=shown)


def test_the_least_inductance_that_is_named_is_taken():
    """The figure of the refusal is rounded so that it holds."""
    for resistance_ohm in (3.0, 5.3, 7.77):
        with pytest.raises(ValidationError, match="at least") as refused:
            robot(motor_resistance_ohm=resistance_ohm, motor_inductance_h=1.1e-4)
        shown = float(str(refused.value).split("at least ")[1].split()[0])
        robot(motor_resistance_ohm=resistance_ohm, motor_inductance_h=shown)
