"""The plants by energy, passivity, equilibria, structure and step size; slips against a derivation."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import sympy as sp

from hil.study.chapters import _plants
from hil.study.chapters.deck import load_deck

STUDIES = {"quadrotor": "quadrotor", "vehicle5": "underwater-5dof", "vehicle6": "underwater-6dof"}
KINDS = {"quadrotor": _plants.Quadrotor, "vehicle5": _plants.Vehicle5, "vehicle6": _plants.Vehicle6}
DAMPING5 = ("d11_kg_s", "d22_kg_s", "d33_kg_s", "d55_kg_m2_s", "d66_kg_m2_s")
DAMPING6 = ("x_u", "y_v", "z_w", "k_p", "m_q", "n_r", "y_r", "z_q", "m_w", "n_v",
            "x_uu", "y_vv", "z_ww", "k_pp", "m_qq", "n_rr", "y_rr", "z_qq", "m_ww", "n_vv")  # fmt: skip


def plant(kind, **changed):
    made = KINDS[kind]()
    values = {name: item.value for name, item in load_deck(STUDIES[kind]).parameters.items()}
    for name, value in (values | changed).items():
        setattr(made, name, value)
    return made


def calm5(**more):
    return plant("vehicle5", velocity_disturbance_m_s=0.0, accel_disturbance_m_s2=0.0, **more)


def calm6(**more):
    return plant("vehicle6", disturbance_m_s2=0.0, **more)


MOVING = {
    "quadrotor": [0.1, -0.2, 0.3, 1.0, -0.5, 0.7, 0.3, 0.4, -0.7, 0.9, -1.1, 0.6, 0, 0, 0, 0],
    "vehicle5": [0, 0, 0, 0.3, 0.5, 0.8, -0.2, 0.1, 0.05, -0.1, 0, 0, 0],
    "vehicle6": [0, 0, 0, 0.96, 0.1, 0.2, 0.15, 0.5, -0.2, 0.3, 0.4, -0.3, 0.6],
}


def state(kind):
    x = np.array(MOVING[kind], float)
    if kind == "vehicle6":
        x[3:7] /= np.linalg.norm(x[3:7])
    return x


def steps(kind, made, x, h, duration):
    x = list(x)
    for k in range(round(duration / h)):
        when = () if kind == "quadrotor" else (k * h,)
        thrust = (0.0,) if kind == "quadrotor" else ()
        x = made.step(*when, x, *thrust, [0.0] * 3, h)
    return x


FREE = {
    "quadrotor": lambda: plant("quadrotor", drag_n_s2_m2=0.0),
    "vehicle5": lambda: calm5(**dict.fromkeys(DAMPING5, 0.0)),
    "vehicle6": lambda: calm6(**dict.fromkeys(DAMPING6, 0.0)),
}


@pytest.mark.parametrize("kind", KINDS)
def test_without_input_and_damping_the_energy_stays(kind):
    """Two seconds of free motion: kinetic plus potential energy is constant to 1e-6."""
    made, x = FREE[kind](), state(kind)
    begin = made.energy(x)
    end = made.energy(steps(kind, made, x, 1e-3, 2.0))
    assert begin > 0.01
    assert end == pytest.approx(begin, rel=1e-6)


@pytest.mark.parametrize("kind", ["vehicle5", "vehicle6"])
def test_damping_only_takes_energy(kind):
    """Passivity: without input the energy never grows."""
    made, x = (calm5() if kind == "vehicle5" else calm6()), list(state(kind))
    energies = [made.energy(x)]
    for k in range(300):
        x = made.step(0.01 * k, x, [0.0] * 3, 0.01)
        energies.append(made.energy(x))
    assert all(b <= a + 1e-12 for a, b in itertools.pairwise(energies))
    assert energies[-1] < 0.95 * energies[0]


@pytest.mark.parametrize("kind", KINDS)
def test_half_the_step_is_a_sixteenth_of_the_error(kind):
    """RK4 converges with the fourth order on the free motion."""
    made, x = FREE[kind](), state(kind)
    exact = np.array(steps(kind, made, x, 1.25e-3, 1.0))
    coarse, fine = (
        np.abs(np.array(steps(kind, made, x, h, 1.0)) - exact).max() for h in (0.04, 0.02)
    )
    assert 10.0 < coarse / fine < 25.0


def test_hover_is_an_equilibrium():
    """Level, at rest, thrust m g: every rate is zero; a tenth more thrust climbs at g/10."""
    made, x = plant("quadrotor"), [0.0] * 16
    weight = made.mass_kg * made.gravity_m_s2
    assert made.rates(x, weight, [0.0] * 3) == pytest.approx([0.0] * 16, abs=1e-12)
    assert made.rates(x, 1.1 * weight, [0.0] * 3)[5] == pytest.approx(0.1 * made.gravity_m_s2)


def test_terminal_velocity_and_tilt_have_the_signs_of_the_text():
    """Drag brakes; pitch pushes along x, roll along -y (2.24), (2.25)."""
    made = plant("quadrotor", drag_n_s2_m2=0.05)
    x = [0.0] * 16
    x[3] = 2.0
    assert made.rates(x, 0.0, [0.0] * 3)[3] == pytest.approx(-0.05 * 4.0 / 0.47)
    x = [0.0] * 16
    x[7] = 0.1
    assert made.rates(x, 4.7, [0.0] * 3)[3] == pytest.approx(10.0 * math.sin(0.1))
    x[7], x[8] = 0.0, 0.1
    assert made.rates(x, 4.7, [0.0] * 3)[4] == pytest.approx(-10.0 * math.sin(0.1))


def test_motors_lag_behind_by_their_time_constant():
    """A tenth of a second's lag: thrust is 1 - 1/e of the command after it."""
    made, x = plant("quadrotor", motor_lag_s=0.1), [0.0] * 16
    for _ in range(100):
        x = made.step(x, 5.0, [0.0] * 3, 1e-3)
    assert x[12] == pytest.approx(5.0 * (1.0 - math.exp(-1.0)), rel=1e-6)


def quadrotor_symbols():
    """M from the rotation, C by Christoffel symbols, in the order psi, theta, phi."""
    ps, th, ph, dps, dth, dph = sp.symbols("psi theta phi dpsi dtheta dphi")
    ix, iy, iz = sp.symbols("Ixx Iyy Izz", positive=True)
    turn = sp.Matrix(
        [
            [-sp.sin(th), 0, 1],
            [sp.cos(th) * sp.sin(ph), sp.cos(ph), 0],
            [sp.cos(th) * sp.cos(ph), -sp.sin(ph), 0],
        ]
    )
    inertia = turn.T * sp.diag(ix, iy, iz) * turn
    q, dq = (ps, th, ph), (dps, dth, dph)
    coriolis = sp.Matrix(
        3,
        3,
        lambda i, j: sum(
            (inertia[i, j].diff(q[k]) + inertia[i, k].diff(q[j]) - inertia[j, k].diff(q[i]))
            / 2
            * dq[k]
            for k in range(3)
        ),
    )
    return inertia, coriolis, (*q, *dq, ix, iy, iz)


def test_quadrotor_matrices_are_the_derived_ones_and_the_printed_entry_is_wrong():
    """C is that of the Christoffel symbols; printed C23, with -Izz, is off, and dM/dt - 2C not skew."""
    inertia, coriolis, symbols = quadrotor_symbols()
    values = (0.3, 0.4, -0.7, 0.9, -1.1, 0.6, 1.0, 2.3, 3.7)
    at = dict(zip(symbols, values, strict=True))
    made = plant("quadrotor", ixx_kg_m2=1.0, iyy_kg_m2=2.3, izz_kg_m2=3.7)
    m, c = made.matrices(values[:3], values[3:6])
    assert np.array(m) == pytest.approx(np.array(inertia.subs(at).evalf(), float), abs=1e-12)
    assert np.array(c) == pytest.approx(np.array(coriolis.subs(at).evalf(), float), abs=1e-12)
    m_dot = sum((inertia.diff(symbols[k]) * symbols[3 + k] for k in range(3)), sp.zeros(3))
    residue = np.array(m_dot.subs(at).evalf(), float) - 2.0 * np.array(c)
    assert residue + residue.T == pytest.approx(np.zeros((3, 3)), abs=1e-12)
    _, theta, phi, dpsi, dtheta, *_ = values
    bracket = dpsi * math.cos(theta) * (math.sin(phi) ** 2 - math.cos(phi) ** 2)
    bracket += dtheta * math.sin(phi) * math.cos(phi)
    printed = residue.copy()
    printed[1, 2] += 2.0 * 2.0 * 3.7 * bracket  # C23 with -Izz in place of +Izz
    assert np.abs(printed + printed.T).max() == pytest.approx(5.936, abs=1e-3)


def test_torpedo_coriolis_is_skew_and_the_printed_block_is_not():
    """C of (2.16) with -m z_G r in C21; with the printed + the residue is 2 m z_G r."""
    made = calm6()
    speed = [0.5, -0.2, 0.3, 0.1, -0.4, 0.6]
    c = np.array(made.coriolis(speed))
    assert np.abs(c + c.T).max() < 1e-12
    printed = c.copy()
    printed[3, 0] = printed[4, 1] = +18.0 * 0.01 * 0.6
    assert np.abs(printed + printed.T).max() == pytest.approx(2 * 18.0 * 0.01 * 0.6)


def test_torpedo_rights_itself_and_drifts_with_drag():
    """Rolled by 0.1 rad the moment is -z_G W sin(0.1); damping takes power in any motion."""
    made = calm6()
    x = [0.0] * 13
    x[3], x[4] = math.cos(0.05), math.sin(0.05)
    assert made.rates(0.0, x, [0.0] * 3)[10] == pytest.approx(
        -0.01 * 176.0 * math.sin(0.1) / (0.0506 + 0.005)
    )
    rng = np.random.default_rng(2)
    for _ in range(200):
        speed = rng.uniform(-1.0, 1.0, 6)
        assert speed @ np.array(made.damping(list(speed))) > 0.0


def test_stage_two_turns_its_own_reference():
    """Rate of (v*, w*) by turning is -(u* + w* tan) r and u* q + v* tan r: the gain of r is +0.477 u."""
    th, ps, a1, a2, a3 = sp.symbols("theta psi V1 V2 V3")
    yaw = sp.Matrix([[sp.cos(ps), -sp.sin(ps), 0], [sp.sin(ps), sp.cos(ps), 0], [0, 0, 1]])
    pitch = sp.Matrix([[sp.cos(th), 0, sp.sin(th)], [0, 1, 0], [-sp.sin(th), 0, sp.cos(th)]])
    us, vs, ws = body = (yaw * pitch).T * sp.Matrix([a1, a2, a3])
    by_r = body.diff(ps) / sp.cos(th)
    assert sp.simplify(by_r[1] + us + ws * sp.tan(th)) == 0
    assert sp.simplify(by_r[2] - vs * sp.tan(th)) == 0
    assert sp.simplify(body.diff(th)[2] - us) == 0
    assert sp.simplify(body.diff(th)[1]) == 0
    made = calm5()
    assert 1.0 - made.m11_kg / made.m22_kg == pytest.approx(0.477, abs=5e-4)
    assert -made.m11_kg / made.m22_kg == pytest.approx(-0.523, abs=5e-4)


def test_five_degrees_of_freedom_follow_the_printed_equations():
    """(2.21), (2.22) by hand at one state, without damping terms left out."""
    made = calm5()
    u, v, w, q, r, th = 0.8, -0.2, 0.1, 0.05, -0.1, 0.3
    got = made.rates(0.0, [0, 0, 0, th, 0.5, u, v, w, q, r, 0, 0, 0], [10.0, 20.0, 30.0])
    assert got[5] == pytest.approx((2133 * v * r - 2133 * w * q - 25.5 * u + 10) / 1116)
    assert got[6] == pytest.approx((-1116 * u * r - 138 * v) / 2133)
    assert got[7] == pytest.approx((1116 * u * q - 138 * w) / 2133)
    righting = 1089.9 * 9.81 * 0.0065 * math.sin(th)
    assert got[8] == pytest.approx(((2133 - 1116) * u * w - 490 * q - righting + 20) / 4061)
    assert got[9] == pytest.approx(((1116 - 2133) * u * v - 490 * r + 30) / 4061)


@pytest.mark.parametrize("kind", KINDS)
def test_reference_rates_are_derivatives(kind):
    """Velocity and acceleration of each reference against difference quotients."""
    made, h = plant(kind), 1e-5
    for t in (1.7, 17.2, 43.1, 120.0, 260.0):
        before, now, after = (np.array(made.reference(x)) for x in (t - h, t, t + h))
        assert now[1] == pytest.approx((after[0] - before[0]) / (2 * h), abs=1e-6)
        assert now[2] == pytest.approx((after[1] - before[1]) / (2 * h), abs=1e-6)


def test_z_of_chapter_4_ends_where_its_signs_say():
    """Alternating signs end at 2 m; as printed the reference ends 6 m below the ground."""
    assert plant("quadrotor").reference(69.0)[0][2] == pytest.approx(2.0, abs=1e-6)
    printed = plant("quadrotor", climb_alternates=0.0)
    assert printed.reference(69.0)[0][2] == pytest.approx(-6.0, abs=1e-6)


def test_printed_theta_row_of_table_4_3_is_unstable():
    """Poles of the x cascade: theta 2/1 has one at +0.5, phi's 50/5 is stable, psi is barely damped."""

    def rightmost(kp, kd):
        return max(np.roots([1.0, kd, kp, kp * 1.0, kp * 2.0]).real)

    assert rightmost(2.0, 1.0) == pytest.approx(0.5, abs=0.01)
    assert rightmost(50.0, 5.0) == pytest.approx(-0.463, abs=0.01)
    assert 5.0 / 2.0 / math.sqrt(1645.0) == pytest.approx(0.06, abs=0.005)
