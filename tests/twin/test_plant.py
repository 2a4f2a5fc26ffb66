"""The robot model against hand calculations: statics, steady states, signs, energy, order."""

from __future__ import annotations

import math
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.twin.rigs import NO_LOADS, ideal_robot, loads, named, plant, robot, settle

G = 9.81
MASS = 2.8
RADIUS = 0.0482
HALF_TRACK = 0.1083
D0 = 0.03
# Wheels and rotors of one side, as seen by a push on the rim: (2 (30^2 1e-6) + 2 1.4e-4) / r^2.
RIM_KG = 2.08e-3 / RADIUS**2
# About the vertical, with the lateral motion that (2.31) ties to it: I + m d0^2 + rims W^2/2.
INERTIA = 0.024 + MASS * D0**2 + 2 * HALF_TRACK**2 * RIM_KG
# Motors that neither drive nor brake, to see the mechanics alone.
UNPLUGGED = {"motor_torque_constant_n_m_a": 1e-9, "motor_emf_constant_v_s_rad": 1e-9}


def moving(model, **state):
    """Set states by name; the wheels follow the body."""
    values = named(model.state) | state
    eta1, w = values["eta1_m_s"], values["theta_dot_rad_s"]
    values["eta2_m_s"] = state.get("eta2_m_s", -D0 * w)
    values["omega_left_rad_s"] = (eta1 - HALF_TRACK * w) / RADIUS
    values["omega_right_rad_s"] = (eta1 + HALF_TRACK * w) / RADIUS
    model.state = list(values.values())


def rates(model, left=0.0, right=0.0, load=NO_LOADS):
    return named(model.derivative(left, right, load))


def test_lossless_robot_runs_at_the_speed_its_back_emf_allows():
    """Without friction and drops omega settles at duty V / (k_b N), V = 10.85 + 0.7 x 1.45."""
    end = settle(plant(ideal_robot(battery_capacity_a_h=100.0)), 0.5, 0.5, seconds=5.0)
    assert end["omega_left_rad_s"] == pytest.approx(0.5 * 11.865 / (0.012 * 30), rel=1e-3)
    assert end["eta1_m_s"] == pytest.approx(RADIUS * end["omega_left_rad_s"], rel=1e-12)


def steady_speed(duty):
    """Solve torque and voltage balance of one motor by bisection (straight run, gear driving)."""
    k = 0.012 * 30

    def voltage_left(omega):
        rolling = 0.03 * MASS * G / 4 * RADIUS  # a quarter of the rolling resistance each
        friction = 0.02 + 0.01 / (1 + omega**2) + 6e-4 * omega
        current = (rolling + friction) / (0.7 * k)
        channel = 2 * current
        drop = 1.2 * channel / math.hypot(channel, 0.2) + 0.8 * channel
        battery = 11.865 - 0.12 * (0.25 + 2 * duty * channel)
        return duty * battery - drop - 5.0 * current - k * omega

    low, high = 0.0, 40.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if voltage_left(middle) > 0 else (low, middle)
    return low


@pytest.mark.parametrize("duty", [0.25, 0.5, 1.0])
def test_straight_speed_is_where_torques_and_voltages_balance(duty):
    """Steady speed with every loss equals that of the torque and voltage balance by hand."""
    end = settle(plant(robot(battery_capacity_a_h=100.0)), duty, duty, seconds=4.0)
    assert end["omega_right_rad_s"] == pytest.approx(steady_speed(duty), rel=2e-3)


def test_the_robot_reaches_the_speeds_the_scenarios_ask_for():
    """1.0 m/s straight on (8.9 asks for 0.8), and 2.5 rad/s on the spot against the scrub."""
    assert settle(plant(robot()), 1.0, 1.0)["eta1_m_s"] > 1.0
    assert settle(plant(robot()), -0.8, 0.8)["theta_dot_rad_s"] > 2.5


@pytest.mark.parametrize("variant", ["constrained", "slip"])
def test_signs(variant):
    """Positive duty drives forward and turns wheels forward; theta_dot > 0 has the right faster."""
    ahead = settle(plant(robot(variant=variant)), 0.5, 0.5)
    assert ahead["x_m"] > 0.5
    assert abs(ahead["y_m"]) < 1e-9
    assert ahead["wheel_left_rad"] > 10
    assert ahead["wheel_right_rad"] > 10
    left_turn = settle(plant(robot(variant=variant)), -0.2, 0.8, seconds=1.0)
    assert left_turn["theta_dot_rad_s"] > 0.2
    assert left_turn["omega_right_rad_s"] > left_turn["omega_left_rad_s"]
    assert left_turn["y_m"] > 0
    right_turn = settle(plant(robot(variant=variant)), 0.8, -0.2, seconds=1.0)
    assert right_turn["theta_dot_rad_s"] == pytest.approx(-left_turn["theta_dot_rad_s"], rel=1e-9)


def test_operative_constraint_holds_and_slip_variant_is_free_of_it():
    """eta2 = -d0 theta_dot to rounding (2.31); the slip variant finds its own lateral speed."""
    bound = settle(plant(robot()), 0.9, -0.2)
    assert bound["theta_dot_rad_s"] < -1
    assert bound["eta2_m_s"] == pytest.approx(-D0 * bound["theta_dot_rad_s"], abs=1e-15)
    free = settle(plant(robot(variant="slip")), 0.9, -0.2)
    assert abs(free["eta2_m_s"] + D0 * free["theta_dot_rad_s"]) > 0.02


def test_body_and_wheel_speeds_agree_with_the_kinematics():
    """v_left = eta1 - W/2 theta_dot, v_right = eta1 + W/2 theta_dot, omega = v / r."""
    end = settle(plant(robot()), 0.3, 0.8, seconds=1.0)
    for side, sign in (("left", -1), ("right", 1)):
        rim_m_s = end["eta1_m_s"] + sign * HALF_TRACK * end["theta_dot_rad_s"]
        assert end[f"omega_{side}_rad_s"] == pytest.approx(rim_m_s / RADIUS, rel=1e-12)


def test_rolling_resistance_slows_a_coasting_robot():
    """Motors unplugged: deceleration is f_r m g / (m + both rims) = 0.1795 m/s^2."""
    model = plant(ideal_robot(floor_rolling_ratio=0.03, **UNPLUGGED))
    moving(model, eta1_m_s=0.5)
    rate = rates(model)["eta1_m_s"]
    assert rate == pytest.approx(-0.03 * MASS * G / (MASS + 2 * RIM_KG), rel=1e-4)
    assert rate == pytest.approx(-0.1795, abs=2e-4)
    model.run(10_000, 1e-4, 0.0, 0.0, NO_LOADS)
    assert named(model.state)["eta1_m_s"] == pytest.approx(0.5 - 0.1795, abs=2e-4)


def test_a_coasting_robot_comes_to_rest_and_stays_there():
    """With every friction the robot stands within two seconds and creeps less than 0.1 mm in ten."""
    model = plant(robot())
    moving(model, eta1_m_s=0.5, theta_dot_rad_s=1.0)
    rest = settle(model, 0.0, 0.0, seconds=2.0)
    later = settle(model, 0.0, 0.0, seconds=10.0)
    assert math.hypot(later["x_m"] - rest["x_m"], later["y_m"] - rest["y_m"]) < 1e-4
    assert abs(later["theta_rad"] - rest["theta_rad"]) < 1e-4


def test_a_robot_at_rest_is_exactly_at_rest():
    """No speed or current dies away for ever: each ends at 0 and never is a number too small to be normal."""
    for variant in ("constrained", "slip"):
        model = plant(robot(variant=variant))
        moving(model, eta1_m_s=0.5, theta_dot_rad_s=1.0)
        settle(model, 0.4, -0.2, seconds=0.2)
        seen = set()
        for _ in range(400):
            now = settle(model, 0.0, 0.0, seconds=0.01)
            speeds = [now[name] for name in ("eta1_m_s", "theta_dot_rad_s", "omega_left_rad_s")]
            speeds += [now["current_left_a"], now["current_right_a"], now["eta2_m_s"]]
            assert all(v == 0.0 or abs(v) > 1e-200 for v in speeds)
            seen.update(v for v in speeds if 0.0 < abs(v) < 1e-50)
        assert speeds == [0.0] * 6
        assert seen  # it died away through small numbers, and was not cut off where it matters


@pytest.mark.parametrize("variant", ["constrained", "slip", "lifted"])
def test_a_robot_that_stands_is_reckoned_shorter_with_the_same_bits(variant):
    """Driving, coasting and standing by turns: with and without the short way the state is one."""
    full, short = plant(robot(variant=variant)), plant(robot(variant=variant))
    rng = random.Random(variant)
    stood = 0
    for _ in range(40):
        duty = (0.0, 0.0) if rng.random() < 0.6 else (rng.uniform(-1, 1), rng.uniform(-1, 1))
        steps = rng.randrange(1, 4000)
        for model, load in ((full, NO_LOADS), (short, None)):
            model.run(steps, 1e-4, *duty, load)
        bits = [[value.hex() for value in model.state] for model in (full, short)]
        assert bits[0] == bits[1]
        stood += named(full.state)["omega_left_rad_s"] == 0.0
    assert 3 < stood < 40
    assert named(full.state)["charge_ratio"] < 0.7


def test_scrub_resists_turning_with_the_moment_of_the_model():
    """M_r = 2 mu a_f b m g / (a_f + b) = 0.824 N m on (I + m d0^2 + rims W^2/2) = 0.0475 kg m^2."""
    model = plant(ideal_robot(floor_friction_ratio=0.4, **UNPLUGGED))
    moving(model, theta_dot_rad_s=2.0)
    scrub = 2 * 0.4 * 0.075 * 0.075 * MASS * G / 0.15
    assert (scrub, INERTIA) == (pytest.approx(0.824, abs=1e-3), pytest.approx(0.0475, abs=1e-4))
    assert rates(model)["theta_dot_rad_s"] == pytest.approx(-scrub / INERTIA, rel=1e-3)


def test_unequal_axles_push_sideways():
    """With a_f 0.1 m and b 0.05 m: F_y = mu m g (b - a_f) / (a_f + b), M_r = 2 mu a_f b m g / ..."""
    model = plant(
        ideal_robot(floor_friction_ratio=0.4, front_axle_m=0.1, rear_axle_m=0.05, **UNPLUGGED)
    )
    moving(model, theta_dot_rad_s=2.0)
    weight = 0.4 * MASS * G / 0.15
    lateral = weight * (0.05 - 0.1)
    moment = -weight * 2 * 0.1 * 0.05 + D0 * lateral
    assert rates(model)["theta_dot_rad_s"] == pytest.approx(moment / INERTIA, rel=1e-3)


def test_coupling_of_forward_and_turning_motion():
    """Frictionless: eta1_dot = -m d0 w^2 / (m + rims), w_dot = m d0 eta1 w / (I + m d0^2 + rims)."""
    model = plant(ideal_robot(**UNPLUGGED))
    moving(model, eta1_m_s=0.5, theta_dot_rad_s=2.0)
    rate = rates(model)
    assert rate["eta1_m_s"] == pytest.approx(-MASS * D0 * 4 / (MASS + 2 * RIM_KG), rel=1e-9)
    assert rate["theta_dot_rad_s"] == pytest.approx(MASS * D0 * 0.5 * 2 / INERTIA, rel=1e-9)


def test_mass_matrix_is_that_of_the_model_without_wheel_inertia():
    """(S'MS) = diag(m, m + I/d0^2): torque of 1 A a motor gives 29.9 N and 3.24 N m."""
    model = plant(ideal_robot(motor_rotor_inertia_kg_m2=0.0, wheel_inertia_kg_m2=0.0))
    moving(model, current_left_a=-1.0, current_right_a=1.0)
    moment = 2 * HALF_TRACK / RADIUS * 2 * 0.36
    assert rates(model)["theta_dot_rad_s"] == pytest.approx(moment / (0.024 + MASS * D0**2))
    moving(model, current_left_a=1.0, current_right_a=1.0)
    assert rates(model)["eta1_m_s"] == pytest.approx(4 * 0.36 / RADIUS / MASS)


def test_current_rises_with_the_inductance():
    """From rest di/dt = duty V / L; 11.835 V (0.25 A idle over 0.12 ohm) on 2.5 mH."""
    assert rates(plant(robot()), 1.0, 0.0)["current_left_a"] == pytest.approx(11.835 / 2.5e-3)


def test_battery_sags_and_empties():
    """Terminal voltage falls by R (idle + duty current) and charge by the current's integral."""
    model = plant(robot())
    moving(model, current_left_a=1.0, current_right_a=1.0)
    assert model.battery_v(1.0, 0.5) == pytest.approx(11.865 - 0.12 * (0.25 + 2 * 1.5))
    assert rates(model, 1.0, 0.5)["charge_ratio"] == pytest.approx(-3.25 / (3600 * 2.2))


@pytest.mark.parametrize(
    ("load", "state", "rate"),
    [
        ({"force_forward_n": 2.0}, "eta1_m_s", 2.0 / (MASS + 2 * RIM_KG)),
        ({"eta1_dot_m_s2": 0.3}, "eta1_m_s", 0.3),
        ({"theta_ddot_rad_s2": 0.7}, "theta_dot_rad_s", 0.7),
        ({"eta2_dot_m_s2": 0.06}, "theta_dot_rad_s", -2.0),  # eta2 = -d0 theta_dot
        ({"torque_yaw_n_m": 0.1}, "theta_dot_rad_s", 0.1 / INERTIA),
        ({"force_left_n": 1.0}, "theta_dot_rad_s", -D0 / INERTIA),
        ({"load_left_n_m": 0.1}, "eta1_m_s", -0.1 / RADIUS / (MASS + 2 * RIM_KG)),
        ({"load_right_n_m": 0.1}, "theta_dot_rad_s", -HALF_TRACK * 0.1 / RADIUS / INERTIA),
        ({"slope_x_rad": 0.1}, "eta1_m_s", -0.1 * G * MASS / (MASS + 2 * RIM_KG)),
        ({"slope_y_rad": 0.1}, "eta1_m_s", 0.0),
    ],
)
def test_each_disturbance_acts_where_it_says(load, state, rate):
    """Loads on the frictionless robot at rest, heading along X, give the accelerations by hand."""
    got = rates(plant(ideal_robot(**UNPLUGGED)), load=loads(**load))[state]
    assert got == pytest.approx(rate, rel=1e-4, abs=1e-12)


def test_friction_change_and_battery_sag_scale_what_they_name():
    """Half the friction brakes half as much; 2 V off the battery are 2 V less on the motors."""
    model = plant(ideal_robot(floor_rolling_ratio=0.03, **UNPLUGGED))
    moving(model, eta1_m_s=0.5)
    whole = rates(model)["eta1_m_s"]
    half = rates(model, load=loads(friction_change_ratio=-0.5))["eta1_m_s"]
    assert half == pytest.approx(0.5 * whole)
    model = plant(robot())
    less = rates(model, 1.0, 1.0, loads(battery_sag_v=2.0))["current_left_a"]
    assert rates(model, 1.0, 1.0)["current_left_a"] - less == pytest.approx(2.0 / 2.5e-3)


@pytest.mark.parametrize("variant", ["constrained", "slip"])
@pytest.mark.parametrize("change", [-1.0, -1.5, -1000.0])
def test_friction_below_none_is_none(variant, change):
    """Unpowered, the robot coasts as at -1: no friction drives it."""
    coasting = {}
    for value in (-1.0, change):
        model = plant(robot(variant=variant, **UNPLUGGED))
        moving(model, eta1_m_s=0.3)
        model.run(5000, 1e-4, 0.0, 0.0, loads(friction_change_ratio=value))
        coasting[value] = named(model.state)["eta1_m_s"]
    assert coasting[change] == coasting[-1.0] <= 0.3


def test_a_sag_beyond_the_battery_does_not_reverse_the_motors():
    """20 V off a battery of 12 V leave none: at full duty the robot stands."""
    model = plant(robot())
    model.run(5000, 1e-4, 1.0, 1.0, loads(battery_sag_v=20.0))
    assert abs(named(model.state)["eta1_m_s"]) < 1e-6


@pytest.mark.parametrize("variant", ["constrained", "slip", "lifted"])
@pytest.mark.parametrize("torque_n_m", [0.2, 1.0, 1000.0])
def test_a_brake_moves_nothing_and_stops_what_moves(variant, torque_n_m):
    """At rest it does nothing; forward or backward it slows the robot down, and to rest only."""
    braked = loads(brake_left_n_m=torque_n_m, brake_right_n_m=torque_n_m)
    model = plant(robot(variant=variant))
    model.run(5000, 1e-4, 0.0, 0.0, braked)
    assert abs(named(model.state)["omega_left_rad_s"]) < 1e-9
    for duty in (0.5, -0.5):
        model = plant(robot(variant=variant))
        model.run(5000, 1e-4, duty, duty, NO_LOADS)
        before = named(model.state)["omega_left_rad_s"]
        assert before * duty > 1.0
        free = rates(model)["omega_left_rad_s"]
        assert (rates(model, load=braked)["omega_left_rad_s"] - free) * duty < 0.0
        model.run(10000, 1e-4, 0.0, 0.0, braked)
        assert abs(named(model.state)["omega_left_rad_s"]) < 0.05


def test_a_load_drives_where_a_brake_does_not():
    """The torque pushes a resting robot backward, as docs/twin.md says; a negative brake is none."""
    driven = plant(robot())
    driven.run(5000, 1e-4, 0.0, 0.0, loads(load_left_n_m=1.0, load_right_n_m=1.0))
    assert named(driven.state)["eta1_m_s"] < -0.5
    still = plant(robot())
    still.run(5000, 1e-4, 0.0, 0.0, loads(brake_left_n_m=-1.0, brake_right_n_m=-1.0))
    assert named(still.state)["eta1_m_s"] == 0.0


def kinetic_j(s):
    """Kinetic energy of body, wheels and rotors."""
    body = MASS * (s["eta1_m_s"] ** 2 + s["eta2_m_s"] ** 2) + 0.024 * s["theta_dot_rad_s"] ** 2
    wheels = 2.08e-3 * (s["omega_left_rad_s"] ** 2 + s["omega_right_rad_s"] ** 2)
    return 0.5 * (body + wheels)


def magnetic_j(s):
    return 0.5 * 2.5e-3 * 2 * (s["current_left_a"] ** 2 + s["current_right_a"] ** 2)


@pytest.mark.parametrize("variant", ["constrained", "slip"])
def test_energy_from_the_battery_is_motion_heat_and_nothing_else(variant):
    """Lossless but for the windings: duty V i dt = kinetic + magnetic + R i^2 dt, within 0.1 %."""
    model = plant(ideal_robot(variant=variant, battery_capacity_a_h=100.0))
    taken = heat = 0.0
    h = 1e-4
    for step in range(8000):
        left, right = (0.8, 0.5) if step < 4000 else (0.0, 0.0)
        before = named(model.state)
        model.step(h, left, right, NO_LOADS)
        after = named(model.state)
        volts = 10.85 + 1.45 * before["charge_ratio"]
        for side, duty in (("left", left), ("right", right)):
            i0, i1 = before[f"current_{side}_a"], after[f"current_{side}_a"]
            taken += h * 2 * duty * volts * 0.5 * (i0 + i1)
            heat += h * 2 * 5.0 * (i0 * i0 + i0 * i1 + i1 * i1) / 3
        if step == 3999:
            motion = kinetic_j(after) + magnetic_j(after)
            assert motion > 0.5
            assert taken == pytest.approx(motion + heat, rel=1e-3)
    assert kinetic_j(after) + magnetic_j(after) + heat == pytest.approx(taken, rel=1e-3)


def stored_power_w(model):
    """Rate of kinetic + magnetic energy with the motors short-circuited."""
    s, d = named(model.state), rates(model)
    inertias = {
        "eta1_m_s": MASS, "eta2_m_s": MASS, "theta_dot_rad_s": 0.024,
        "omega_left_rad_s": 2.08e-3, "omega_right_rad_s": 2.08e-3,
        "current_left_a": 5e-3, "current_right_a": 5e-3,
    }  # fmt: skip
    return sum(inertia * s[name] * d[name] for name, inertia in inertias.items())


def test_a_gear_driven_by_its_wheel_loses_power_too():
    """Braking with 1 A at 10.37 rad/s: 4 x (5 W windings + 0.3 x 0.36 N m x 10.37 rad/s gear) lost.

    The printed tau = eta_g k_t N i would have the gear add its 4.48 W instead of taking them.
    """
    model = plant(ideal_robot(motor_gear_efficiency_ratio=0.7))
    moving(model, eta1_m_s=0.5, current_left_a=-1.0, current_right_a=-1.0)
    assert stored_power_w(model) == pytest.approx(-20.0 - 4.48, abs=0.01)


@settings(max_examples=200, deadline=None)
@given(
    variant=st.sampled_from(["constrained", "slip"]),
    eta1=st.floats(-1.2, 1.2),
    w=st.floats(-5, 5),
    currents=st.tuples(st.floats(-2, 2), st.floats(-2, 2)),
)
def test_without_a_battery_energy_only_falls(variant, eta1, w, currents):
    """Short-circuited motors, any motion, any current: kinetic + magnetic power is never above 0.

    The gear's loss included: with the printed eta_g k_t N i a wheel that drives its motor gains.
    """
    model = plant(robot(variant=variant))
    moving(model, eta1_m_s=eta1, theta_dot_rad_s=w,
           current_left_a=currents[0], current_right_a=currents[1])  # fmt: skip
    assert stored_power_w(model) <= 1e-9


def smooth_end(step_s):
    """State after 0.4 s of a case without corners: soft signs, no gear loss, slow current."""
    model = plant(
        robot(
            motor_gear_efficiency_ratio=1.0, motor_inductance_h=0.1, motor_stribeck_rad_s=20.0,
            bridge_smoothing_a=5.0, floor_smoothing_m_s=0.05,
        )
    )  # fmt: skip
    return settle(model, 0.4, 0.9, seconds=0.4, step_s=step_s)


def test_integration_is_of_fourth_order():
    """Halving the step divides the error by 16, within 15 %, where the motion is smooth."""
    exact = smooth_end(1e-4)
    for name in ("x_m", "theta_rad", "current_right_a"):
        coarse = abs(smooth_end(4e-3)[name] - exact[name])
        fine = abs(smooth_end(2e-3)[name] - exact[name])
        assert coarse > 1e-11
        assert coarse / fine == pytest.approx(16.0, rel=0.15)


@pytest.mark.parametrize("variant", ["constrained", "slip"])
def test_default_step_is_small_enough_for_the_friction(variant):
    """The stiff robot at 1e-4 s ends within 0.05 mm and 0.5 mrad of the same at 1e-5 s."""
    ends = []
    for step_s in (1e-4, 1e-5):
        model = plant(robot(variant=variant))
        for left, right in ((0.6, 0.3), (-0.5, 0.5), (0.0, 0.0)):
            end = settle(model, left, right, seconds=0.5, step_s=step_s)
        ends.append(end)
    assert math.dist((ends[0]["x_m"], ends[0]["y_m"]), (ends[1]["x_m"], ends[1]["y_m"])) < 5e-5
    assert abs(ends[0]["theta_rad"] - ends[1]["theta_rad"]) < 5e-4


def test_slip_variant_spins_its_wheels_where_there_is_no_grip():
    """On ice (mu 0.02) full duty accelerates with mu g at most while the wheels run away."""
    end = settle(plant(robot(variant="slip", floor_friction_ratio=0.02)), 1.0, 1.0, seconds=0.5)
    assert end["eta1_m_s"] < 0.02 * G * 0.5 * 1.01
    assert RADIUS * end["omega_left_rad_s"] > 5 * end["eta1_m_s"]


def test_slip_variant_agrees_with_the_constrained_one_straight_on():
    """Rolling without sliding, both variants drive alike within 2 %."""
    free = settle(plant(robot(variant="slip")), 0.5, 0.5)
    bound = settle(plant(robot()), 0.5, 0.5)
    assert free["x_m"] == pytest.approx(bound["x_m"], rel=0.02)
