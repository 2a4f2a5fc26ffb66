"""The robot with two driven wheels and a castor: by hand, against Newton and Euler, against its limits."""

from __future__ import annotations

import math
from random import Random

import numpy as np
import pytest

from hil.config.load import load_robot
from hil.config.robot import RobotConfig
from hil.control.vehicles.vehicle import make_vehicle
from hil.core.types import Pose
from tests.twin.rigs import NO_LOADS, loads, named, plant, robot, settle

G = 9.81
MASS, INERTIA = 1.2, 0.0050
RADIUS, HALF_TRACK = 0.0325, 0.075
D0, BEHIND = 0.020, 0.090
CASTOR_FRICTION, ROLLING = 0.05, 0.03
# One wheel and the reflected rotor of one motor.
SPIN = 34.0**2 * 4e-7 + 2e-5
RIM_KG = SPIN / RADIUS**2
WHOLE_INERTIA = INERTIA + MASS * D0**2 + 2 * HALF_TRACK**2 * RIM_KG
CASTOR_N = MASS * G * D0 / BEHIND
UNPLUGGED = {"torque_constant_n_m_a": 1e-9, "emf_constant_v_s_rad": 1e-9}
FREE = {"coulomb_n_m": 0.0, "stiction_n_m": 0.0, "viscous_n_m_s_rad": 0.0}


def two_wheels(**tables) -> RobotConfig:
    """Return the built-in robot with tables laid over its own: `motor={...}` or `mass_kg=2`."""
    tree = load_robot("diff-2wd").model_dump()
    for name, value in tables.items():
        tree[name] = tree[name] | value if isinstance(value, dict) else value
    return RobotConfig.model_validate(tree)


def coasting(**tables) -> RobotConfig:
    """Return the robot whose motors neither drive nor brake."""
    return two_wheels(motor=UNPLUGGED | FREE, **tables)


def moving(model, eta1=0.0, w=0.0, eta2=None, omegas=None, **state):
    """Set speeds; wheels roll and the axle does not slide unless told otherwise."""
    rolling = ((eta1 - HALF_TRACK * w) / RADIUS, (eta1 + HALF_TRACK * w) / RADIUS)
    left, right = omegas or rolling
    speeds = {
        "eta1_m_s": eta1, "eta2_m_s": -D0 * w if eta2 is None else eta2, "theta_dot_rad_s": w,
        "omega_left_rad_s": left, "omega_right_rad_s": right,
    }  # fmt: skip
    model.state = list((named(model.state) | speeds | state).values())
    return model


def rates(model, left=0.0, right=0.0, load=NO_LOADS):
    return named(model.derivative(left, right, load))


def test_straight_on_two_wheels_roll_and_the_castor_drags():
    """Decelerates with (f_r m g (1 - d0/c) + f_c m g d0/c) / (m + rims) = 0.192 m/s^2."""
    rate = rates(moving(plant(coasting()), eta1=0.5))["eta1_m_s"]
    force = ROLLING * (MASS * G - CASTOR_N) + CASTOR_FRICTION * CASTOR_N
    assert rate == pytest.approx(-force / (MASS + 2 * RIM_KG), rel=1e-4)
    assert rate == pytest.approx(-0.192, abs=1e-3)


def test_turning_on_the_spot_only_the_castor_scrubs():
    """Its load m g d0/c, its friction f_c and its arm c: the moment f_c m g d0 is the arm's no more."""
    config = coasting(floor={"rolling_ratio": 0.0})
    moment = CASTOR_FRICTION * MASS * G * D0
    assert moment == pytest.approx(0.0118, abs=1e-4)
    for behind_m in (0.05, BEHIND, 0.2):
        model = plant(two_wheels(**config.model_dump() | {"vehicle": _castor(behind_m)}))
        rate = rates(moving(model, w=2.0))["theta_dot_rad_s"]
        assert rate == pytest.approx(-moment / WHOLE_INERTIA, rel=1e-3)


def _castor(behind_m, friction=CASTOR_FRICTION):
    return {
        "kind": "differential", "castor_behind_m": behind_m, "castor_friction_ratio": friction,
    }  # fmt: skip


def test_it_turns_on_the_spot_at_a_duty_that_a_skid_steer_does_not_feel():
    """Four scrubbing wheels start at 40 % on the spot; two wheels and a castor turn well at 20 %."""
    assert settle(plant(two_wheels()), -0.2, 0.2)["theta_dot_rad_s"] > 1.0
    assert settle(plant(robot()), -0.2, 0.2)["theta_dot_rad_s"] < 0.02


@pytest.mark.parametrize("variant", ["constrained", "slip"])
def test_signs_are_those_of_every_vehicle(variant):
    """Positive duty drives forward; the right wheel faster turns to the left."""
    ahead = settle(plant(two_wheels(variant=variant)), 0.5, 0.5)
    assert ahead["x_m"] > 0.5
    assert abs(ahead["y_m"]) < 1e-9
    turn = settle(plant(two_wheels(variant=variant)), 0.2, 0.5, seconds=0.5)
    assert turn["theta_dot_rad_s"] > 0.5
    assert turn["y_m"] > 0


@pytest.mark.parametrize("variant", ["constrained", "slip"])
def test_the_middle_of_the_axle_has_no_lateral_speed(variant):
    """z1 (2.35), d0 ahead of the centre of mass, moves along the heading; slip lets it creep a little."""
    config = two_wheels(variant=variant)
    model, vehicle = plant(config), make_vehicle(config)
    settle(model, 0.3, 0.6, seconds=0.5)
    before = named(model.state)
    after = settle(model, 0.3, 0.6, seconds=1e-3)
    a, b = (vehicle.flat_output(Pose(s["x_m"], s["y_m"], s["theta_rad"])) for s in (before, after))
    heading = 0.5 * (before["theta_rad"] + after["theta_rad"])
    dx, dy = b[0] - a[0], b[1] - a[1]
    along = math.cos(heading) * dx + math.sin(heading) * dy
    across = math.cos(heading) * dy - math.sin(heading) * dx
    assert along > 2e-4
    assert abs(across) < (1e-6 if variant == "constrained" else 0.02) * along


def test_a_skid_steer_without_scrub_is_a_differential_robot():
    """No sliding friction, no castor friction, no rolling resistance: the same motion to rounding.

    The skid-steer robot has two wheels of half the inertia a side; everything else is one robot's.
    """
    smooth = {"floor": {"rolling_ratio": 0.0, "friction_ratio": 0.0}}
    two = two_wheels(vehicle=_castor(BEHIND, 0.0), **smooth)
    four = RobotConfig.model_validate(
        two.model_dump()
        | {
            "vehicle": {"kind": "skid-steer"}, "front_axle_m": 0.03, "rear_axle_m": 0.03,
            "wheel_inertia_kg_m2": 1e-5,
        }
    )  # fmt: skip
    ends = [settle(plant(config), 0.3, 0.7, seconds=1.0) for config in (two, four)]
    assert ends[0]["theta_rad"] > 0.5
    for name, value in ends[0].items():
        assert ends[1][name] == pytest.approx(value, rel=1e-9, abs=1e-12), name


def test_scrub_is_what_makes_the_difference():
    """The negative of the one above: with the tyres' friction the two part by more than half."""
    two = two_wheels()
    four = RobotConfig.model_validate(
        two.model_dump()
        | {"vehicle": {"kind": "skid-steer"}, "front_axle_m": 0.03, "rear_axle_m": 0.03}
    )
    turns = [settle(plant(config), 0.3, 0.7, seconds=1.0)["theta_rad"] for config in (two, four)]
    assert turns[1] < 0.5 * turns[0]


def newton_euler(eta1, w, theta, torques, push):
    """Return (eta1_dot, w_dot) of body and two wheels in world axes, held by constraint forces.

    Unknown: accelerations of X, Y, theta and both wheel angles, and three multipliers. The axle's
    middle has no lateral speed, and both rims roll. Nothing here knows of S, d0^2 m or (2.33).
    """
    c, s = math.cos(theta), math.sin(theta)
    across, along = np.array([-s, c]), np.array([c, s])
    velocity = eta1 * along - D0 * w * across
    castor = velocity - (BEHIND - D0) * w * across  # speed of the castor's foot
    drag = -CASTOR_FRICTION * CASTOR_N * castor / math.hypot(*castor, 0.0005)
    arm = -(BEHIND - D0) * along
    rims = [eta1 - HALF_TRACK * w, eta1 + HALF_TRACK * w]
    axle_n = MASS * G - CASTOR_N
    rolls = [-0.5 * ROLLING * axle_n * rim / math.hypot(rim, 0.0005) for rim in rims]
    mass = np.diag([MASS, MASS, INERTIA, SPIN, SPIN])
    force = np.zeros(5)
    force[:2] = drag + push[0] * along + push[1] * across
    force[2] = arm[0] * drag[1] - arm[1] * drag[0]
    force[3:] = [torque + RADIUS * roll for torque, roll in zip(torques, rolls, strict=True)]
    # J qdot = 0, and J qddot = -Jdot qdot
    jacobian = np.array(
        [
            [*across, D0, 0.0, 0.0],
            [*along, -HALF_TRACK, -RADIUS, 0.0],
            [*along, HALF_TRACK, 0.0, -RADIUS],
        ]
    )
    turned = [-w * along @ velocity, w * across @ velocity, w * across @ velocity]
    whole = np.block([[mass, -jacobian.T], [jacobian, np.zeros((3, 3))]])
    acceleration = np.linalg.solve(whole, np.concatenate([force, -np.array(turned)]))
    return (
        along @ acceleration[:2] + across @ velocity * w,
        acceleration[2],
    )


def test_newton_and_euler_with_constraint_forces_agree():
    """300 random motions, currents and pushes: both accelerations agree to 1e-9 of their size."""
    model = plant(two_wheels(motor=FREE | {"gear_efficiency_ratio": 1.0}))
    draw = Random(4)
    for _ in range(300):
        eta1, w, theta = draw.uniform(-1, 1), draw.uniform(-5, 5), draw.uniform(-3, 3)
        currents = draw.uniform(-1, 1), draw.uniform(-1, 1)
        push = draw.uniform(-3, 3), draw.uniform(-3, 3)
        moving(model, eta1, w, theta_rad=theta,
               current_left_a=currents[0], current_right_a=currents[1])  # fmt: skip
        got = rates(model, load=loads(force_forward_n=push[0], force_left_n=push[1]))
        torques = [34 * 0.0107 * current for current in currents]
        eta1_dot, w_dot = newton_euler(eta1, w, theta, torques, push)
        assert got["eta1_m_s"] == pytest.approx(eta1_dot, rel=1e-9, abs=1e-9)
        assert got["theta_dot_rad_s"] == pytest.approx(w_dot, rel=1e-9, abs=1e-9)


def stored_power_w(model):
    """Rate of kinetic + magnetic energy with the motors short-circuited."""
    s, d = named(model.state), rates(model)
    inertias = {
        "eta1_m_s": MASS, "eta2_m_s": MASS, "theta_dot_rad_s": INERTIA,
        "omega_left_rad_s": SPIN, "omega_right_rad_s": SPIN,
        "current_left_a": 6e-3, "current_right_a": 6e-3,
    }  # fmt: skip
    return sum(inertia * s[name] * d[name] for name, inertia in inertias.items())


@pytest.mark.parametrize("variant", ["constrained", "slip"])
def test_without_a_battery_energy_only_falls(variant):
    """Any motion, any current, wheels that slide where they may: the power is never above 0."""
    model = plant(two_wheels(variant=variant))
    draw = Random(5)
    for _ in range(300):
        eta1, w = draw.uniform(-1, 1), draw.uniform(-5, 5)
        slides = variant == "slip"
        moving(
            model, eta1, w,
            eta2=draw.uniform(-0.5, 0.5) if slides else None,
            omegas=(draw.uniform(-30, 30), draw.uniform(-30, 30)) if slides else None,
            current_left_a=draw.uniform(-1, 1), current_right_a=draw.uniform(-1, 1),
        )  # fmt: skip
        assert stored_power_w(model) <= 1e-9


def test_energy_from_the_battery_is_motion_heat_and_nothing_else():
    """Lossless but for the windings: duty V i dt = kinetic + magnetic + R i^2 dt, within 0.1 %."""
    config = two_wheels(
        motor=FREE | {"gear_efficiency_ratio": 1.0},
        bridge={"drop_v": 0.0, "resistance_ohm": 0.0},
        battery={"resistance_ohm": 0.0},
        floor={"rolling_ratio": 0.0},
        vehicle=_castor(BEHIND, 0.0),
    )
    model, h = plant(config), 1e-4
    taken = heat = 0.0
    for _ in range(4000):
        before = named(model.state)
        model.step(h, 0.8, 0.5, NO_LOADS)
        after = named(model.state)
        volts = 10.85 + 1.45 * before["charge_ratio"]
        for side, duty in (("left", 0.8), ("right", 0.5)):
            i0, i1 = before[f"current_{side}_a"], after[f"current_{side}_a"]
            taken += h * duty * volts * 0.5 * (i0 + i1)
            heat += h * 10.9 * (i0 * i0 + i0 * i1 + i1 * i1) / 3
    body = MASS * (after["eta1_m_s"] ** 2 + after["eta2_m_s"] ** 2)
    spin = INERTIA * after["theta_dot_rad_s"] ** 2
    wheels = SPIN * (after["omega_left_rad_s"] ** 2 + after["omega_right_rad_s"] ** 2)
    magnetic = 6e-3 * (after["current_left_a"] ** 2 + after["current_right_a"] ** 2)
    stored = 0.5 * (body + spin + wheels + magnetic)
    assert stored > 0.2
    assert taken == pytest.approx(stored + heat, rel=1e-3)


def test_slip_variant_agrees_with_the_constrained_one_where_nothing_slides():
    """A gentle curve: both variants end within 2 % of each other in heading and way."""
    free = settle(plant(two_wheels(variant="slip")), 0.4, 0.5, seconds=1.0)
    bound = settle(plant(two_wheels()), 0.4, 0.5, seconds=1.0)
    assert bound["theta_rad"] > 0.3
    for name in ("x_m", "theta_rad"):
        assert free[name] == pytest.approx(bound[name], rel=0.02)


@pytest.mark.parametrize("variant", ["constrained", "slip"])
def test_default_step_is_small_enough_for_the_friction(variant):
    """The robot at 1e-4 s ends within 0.05 mm and 0.5 mrad of the same at 1e-5 s."""
    ends = []
    for step_s in (1e-4, 1e-5):
        model = plant(two_wheels(variant=variant))
        for left, right in ((0.6, 0.3), (-0.5, 0.5), (0.0, 0.0)):
            end = settle(model, left, right, seconds=0.3, step_s=step_s)
        ends.append(end)
    assert math.dist((ends[0]["x_m"], ends[0]["y_m"]), (ends[1]["x_m"], ends[1]["y_m"])) < 5e-5
    assert abs(ends[0]["theta_rad"] - ends[1]["theta_rad"]) < 5e-4
