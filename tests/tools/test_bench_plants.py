"""The plant's ports agree with the plant; operations and limits are what they are by hand."""

from collections import Counter

import numpy as np
import pytest

from hil.config.load import load_scenario
from hil.tools import bench_plants
from hil.tools.plant_port import (
    OF_ARRAYS,
    OF_COUNTED,
    OF_FLOATS,
    Counted,
    counted,
    make_step,
    numbers_of,
)
from sim_twin import _native
from sim_twin.setup import plant_params

ROBOT = load_scenario("scenario-1").robot
# Driving ahead, turning, braking hard, rolling out.
DUTIES = ((0.5, 0.3), (-0.4, 0.6), (-1.0, -1.0), (0.0, 0.0))
STEPS = 300
TOLERANCE = 1e-12  # of each state, relative, after 1,200 steps


def native_states():
    """Return the native plant's state after each of the duties."""
    plant = _native.Plant(plant_params(ROBOT))
    plant.reset(0.1, -0.2, 0.3)
    found = [tuple(plant.state)]
    for duties in DUTIES:
        plant.run(STEPS, 1e-4, *duties, None)
        found.append(tuple(plant.state))
    return found


def agreed(state, expected):
    """Return whether every state agrees to the stated tolerance."""
    return tuple(state) == pytest.approx(expected, rel=TOLERANCE, abs=1e-15)


def test_the_port_is_the_plant():
    """In plain numbers, driving, turning, braking and rolling out."""
    step, p = make_step(OF_FLOATS), numbers_of(ROBOT)
    start, *after = native_states()
    state = start
    for duties, expected in zip(DUTIES, after, strict=True):
        for _ in range(STEPS):
            state = step(state, p, 1e-4, *duties)
        assert agreed(state, expected)


def test_the_port_in_numpy_is_many_plants():
    """Runs side by side, each under other duties, are each the plant's."""
    step, p = make_step(OF_ARRAYS), numbers_of(ROBOT)
    start = native_states()[0]
    left, right = np.array(DUTIES).T
    state = tuple(np.full(len(DUTIES), value) for value in start)
    for _ in range(STEPS):
        state = step(state, p, 1e-4, left, right)
    for k, duties in enumerate(DUTIES):
        plant = _native.Plant(plant_params(ROBOT))
        plant.state = start
        plant.run(STEPS, 1e-4, *duties, None)
        assert agreed([float(np.broadcast_to(v, len(DUTIES))[k]) for v in state], plant.state)


def test_the_port_in_numba_is_the_plant():
    """Its machine code gives what the plant gives."""
    pytest.importorskip("numba", reason="numba is not installed: pip install skid-steer-hil[bench]")
    advance, p = bench_plants.numba_steps(), numbers_of(ROBOT)
    start, *after = native_states()
    state = start
    for duties, expected in zip(DUTIES, after, strict=True):
        state = advance(state, p, 1e-4, *duties, STEPS)
        assert agreed(state, expected)


def test_a_port_with_another_motor_is_not_the_plant():
    """With a resistance off by a millionth the states differ by more than that (negative control)."""
    step, p = make_step(OF_FLOATS), numbers_of(ROBOT)
    p = p._replace(resistance_ohm=p.resistance_ohm * (1.0 + 1e-6))
    start, after, *_ = native_states()
    state = start
    for _ in range(STEPS):
        state = step(state, p, 1e-4, *DUTIES[0])
    assert not agreed(state, after)


def test_counted_numbers_count_and_wait():
    """(a + b) * c / 2 and a root: four operations in a chain, whatever else goes on beside it."""
    counts = Counter()
    takes = {"sum": 4.0, "product": 5.0, "quotient": 13.0, "root": 20.0}
    a, b, c = (Counted(v, 0.0, counts, takes) for v in (1.0, 2.0, 6.0))
    found = OF_COUNTED.root((a + b) * c / 2.0)
    beside = 1.0 - b
    assert (found.value, found.at, beside.at) == (3.0, 42.0, 4.0)
    assert counts == {"sum": 2, "product": 1, "quotient": 1, "root": 1}


def test_the_operations_of_a_step():
    """By hand: six roots and two quotients a slope, four slopes; one cosine and one sine a step."""
    kinds, wait = counted(ROBOT, {"root": 1.0})
    assert (kinds["root"], kinds["quotient"], kinds["sine"]) == (24.0, 8.0, 2.0)
    # In each slope a root waits for the slope before it, and no root for another of the same slope.
    assert wait == pytest.approx(4.0)


def test_the_limits_of_this_core(monkeypatch):
    """A chain takes as long as its parts; wider registers do at least as many operations as asked."""
    monkeypatch.setattr(bench_plants, "_CHAINED", 1000)
    monkeypatch.setattr(bench_plants, "_SIDE_BY_SIDE", 10_000)
    assert _native.chained(_native.CHAINS.index("sum"), 1000) == pytest.approx(1.0 + 1e-6)
    assert _native.chained(_native.CHAINS.index("root"), 60) == pytest.approx(1.0)
    widest = _native.widest_register()
    assert widest in {2, 4, 8}
    assert 10_000 <= _native.side_by_side(widest, 10_000) < 10_200
    assert 10_000 <= _native.side_by_side(widest, 10_000, quotients=True) < 10_100
    assert _native.side_by_side(2 * widest, 10_000) == 0
    names = [figure.name for figure in bench_plants.limit_figures(ROBOT, 1)]
    assert names[0] == "operations of a step"
    assert f"limit: a step's operations, {widest} runs a register" in names


def test_the_robot_in_mujoco_drives():
    """It moves ahead on its four wheels, and stands on them without torque (negative control)."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install mujoco")
    model = bench_plants.mujoco_model(ROBOT)
    gone = []
    for torque_n_m in (0.06, 0.0):
        data = mujoco.MjData(model)
        data.ctrl[:] = torque_n_m
        mujoco.mj_step(model, data, nstep=1000)
        gone.append(float(data.qpos[0]))
        assert data.qpos[2] == pytest.approx(ROBOT.wheel_radius_m, abs=0.003)
    assert gone[0] > 0.02
    assert gone[1] == pytest.approx(0.0, abs=1e-3)
