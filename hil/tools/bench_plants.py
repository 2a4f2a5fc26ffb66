"""The plant beside others, and what a core can do at most: rows of `hil bench batch`.

Beside it stand the same equations in numpy (many runs side by side) and in numba's machine code, and a robot
of four wheels in MuJoCo, which has contacts and no motors. Each is processor time of one core a step. The
limits come from the operations of a step, counted, and from what this core does with them, measured.
"""

from __future__ import annotations

import importlib
import importlib.util
import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.analysis.speed import Figure, Plan, measure
from hil.config.load import load_scenario
from hil.tools.plant_port import OF_ARRAYS, Functions, counted, make_step, numbers_of
from sim_twin import _native
from sim_twin.setup import STEP_US, plant_params

if TYPE_CHECKING:
    from hil.config.robot import RobotConfig
    from hil.tools.plant_port import Step

_H_S = 1e-6 * STEP_US
_DUTIES = (0.5, 0.3)
_NATIVE_STEPS = 20_000
_PORT_STEPS = 20
_PORT_RUNS = 1000
_LANE_STEPS = 5_000
_CHAINED = 500_000
_SIDE_BY_SIDE = 200_000_000
_NS = 1e9

# A step of the engine's: contacts of a robot of some kg want it short.
MUJOCO_STEP_S = 0.0005
_MUJOCO_STEPS = 400
_MUJOCO = """
<mujoco>
  <option timestep="{step}" integrator="implicitfast" cone="elliptic" impratio="10"/>
  <worldbody>
    <geom type="plane" size="20 20 1"/>
    <body pos="0 0 {r}">
      <freejoint/>
      <inertial pos="0 0 0" mass="{mass}" diaginertia="{lean} {lean} {inertia}"/>
      {wheels}
    </body>
  </worldbody>
  <actuator>{motors}</actuator>
</mujoco>
"""
_WHEEL = """
      <body pos="{x} {y} 0">
        <joint name="{name}" axis="0 1 0"/>
        <geom type="ellipsoid" size="{r} 0.01 {r}" mass="0.05" friction="{friction} 0 0"/>
      </body>
"""


def plant_figures(runs: int) -> list[Figure]:
    """Return nanoseconds of a step of plant and peers that are installed, then of what limits it."""
    robot = load_scenario("scenario-1").robot
    plans: list[Plan] = [
        ("plant, one step of 1e-4 s", "ns", "", lambda: native_ns(robot)),
        (f"the same in numpy, {_PORT_RUNS} runs side by side, one of them", "ns", "",
         numpy_ns(robot)),
    ]  # fmt: skip
    if _installed("numba"):
        plans.append(("the same in numba", "ns", "", numba_ns(robot)))
    if _installed("mujoco"):
        plans.append((f"MuJoCo, four wheels, one step of {MUJOCO_STEP_S:g} s", "ns", "",
                      mujoco_ns(robot)))  # fmt: skip
    plans += [
        (f"plant, {width} side by side in a register, one step of one", "ns", "",
         partial(lanes_ns, robot, width))
        for width in _native.lane_widths()
        if width > 1
    ]  # fmt: skip
    figures = [measure(name, unit, goal, runs, once) for name, unit, goal, once in plans]
    return [*figures, *limit_figures(robot, runs)]


def _installed(package: str) -> bool:
    return importlib.util.find_spec(package) is not None


def limit_figures(robot: RobotConfig, runs: int) -> list[Figure]:
    """Return what a step takes at least: as a chain of results, and as operations side by side."""
    kinds = counted(robot, {})[0]
    operations, slow = sum(kinds.values()), kinds["quotient"] + kinds["root"]
    waits = [chain_ns(robot) for _ in range(runs + 1)][1:]  # the first is not counted
    found = [
        Figure.of("operations of a step", "flop", [operations] * runs, ""),
        Figure.of("limit: a step's results that wait for each other", "ns", waits, ""),
    ]
    width = 2
    while width <= _native.widest_register():
        rates = [rate_flop_ns(width) for _ in range(runs + 1)][1:]
        found += [
            Figure.of(f"sums and products, {width} a register", "flop/ns", rates, ""),
            Figure.of(f"limit: a step's operations, {width} runs a register", "ns",
                      [operations / rate for rate in rates], ""),
            Figure.of(f"limit: its quotients and roots, {width} runs a register", "ns",
                      [slow / rate_flop_ns(width, quotients=True) for _ in range(runs)], ""),
        ]  # fmt: skip
        width *= 2
    return found


def native_ns(robot: RobotConfig) -> float:
    """Return processor time of one step of the native plant, driving."""
    plant = _native.Plant(plant_params(robot))
    start_s = time.process_time()
    plant.run(_NATIVE_STEPS, _H_S, *_DUTIES, None)
    return (time.process_time() - start_s) / _NATIVE_STEPS * _NS


def lanes_ns(robot: RobotConfig, width: int) -> float:
    """Return processor time of a step of one of `width` robots side by side in a register."""
    runs = 8
    spent_s = _native.plant_lane_time(plant_params(robot), width, runs, _LANE_STEPS)
    return spent_s / (_LANE_STEPS * runs) * _NS


def start_state(robot: RobotConfig) -> tuple[float, ...]:
    """Return the native plant's state at its begin."""
    return tuple(_native.Plant(plant_params(robot)).state)


def numpy_ns(robot: RobotConfig) -> Callable[[], float]:
    """Return what gives the processor time of a step and run in numpy, many runs side by side."""
    step, p, start = make_step(OF_ARRAYS), numbers_of(robot), start_state(robot)

    def once() -> float:
        state = tuple(np.full(_PORT_RUNS, value) for value in start)
        duties = tuple(np.full(_PORT_RUNS, duty) for duty in _DUTIES)
        start_s = time.process_time()
        for _ in range(_PORT_STEPS):
            state = step(state, p, _H_S, *duties)
        return (time.process_time() - start_s) / (_PORT_STEPS * _PORT_RUNS) * _NS

    return once


def numba_steps() -> Callable[..., tuple[float, ...]]:
    """Return advance(state, p, h_s, duty_left, duty_right, steps) in numba's machine code."""
    numba: Any = importlib.import_module("numba")
    compiled = numba.njit
    step: Step = make_step(
        Functions(
            compiled(lambda v: np.sqrt(v)),  # noqa: PLW0108 - numba compiles functions of Python
            compiled(lambda v: abs(v)),  # noqa: PLW0108
            compiled(lambda v: max(v, 0.0)),
            compiled(lambda v: np.cos(v)),  # noqa: PLW0108
            compiled(lambda v: np.sin(v)),  # noqa: PLW0108
        ),
        compiled,
    )

    def advance(state: Any, p: Any, h_s: float, left: float, right: float, steps: int) -> Any:
        for _ in range(steps):
            state = step(state, p, h_s, left, right)
        return state

    made: Callable[..., tuple[float, ...]] = compiled(advance)
    return made


def numba_ns(robot: RobotConfig) -> Callable[[], float]:
    """Return what gives the processor time of a step in numba."""
    advance, p, start = numba_steps(), numbers_of(robot), start_state(robot)

    def once() -> float:
        start_s = time.process_time()
        advance(start, p, _H_S, *_DUTIES, _NATIVE_STEPS)
        return (time.process_time() - start_s) / _NATIVE_STEPS * _NS

    return once


def mujoco_model(robot: RobotConfig) -> Any:
    """Return a robot of that size and mass on four driven wheels, without motors and battery."""
    mujoco: Any = importlib.import_module("mujoco")
    params, r = plant_params(robot), robot.wheel_radius_m
    wheels, motors = "", ""
    for x_m in (params.front_axle_m, -params.rear_axle_m):
        for y_m in (0.5 * robot.track_m, -0.5 * robot.track_m):
            name = f"w{x_m:+.3f}{y_m:+.3f}"
            friction = robot.floor.friction_ratio
            wheels += _WHEEL.format(x=x_m, y=y_m, name=name, r=r, friction=friction)
            motors += f'<motor joint="{name}"/>'
    text = _MUJOCO.format(
        step=MUJOCO_STEP_S, r=r, mass=robot.mass_kg - 0.2, inertia=robot.inertia_kg_m2,
        lean=0.6 * robot.inertia_kg_m2, wheels=wheels, motors=motors,
    )  # fmt: skip
    return mujoco.MjModel.from_xml_string(text)


def mujoco_ns(robot: RobotConfig) -> Callable[[], float]:
    """Return what gives the processor time of a step of MuJoCo, driving."""
    mujoco: Any = importlib.import_module("mujoco")
    model = mujoco_model(robot)

    def once() -> float:
        data = mujoco.MjData(model)
        data.ctrl[:] = (0.06, 0.04, 0.06, 0.04)  # N m, left and right: enough to roll
        start_s = time.process_time()
        mujoco.mj_step(model, data, nstep=_MUJOCO_STEPS)
        return (time.process_time() - start_s) / _MUJOCO_STEPS * _NS

    return once


def chain_ns(robot: RobotConfig) -> float:
    """Return how long a step's results wait for each other on this core, ns."""
    takes = {}
    for place, kind in enumerate(_native.CHAINS):
        start_s = time.process_time()
        _native.chained(place, _CHAINED)
        takes[kind] = (time.process_time() - start_s) / _CHAINED * _NS
    return counted(robot, takes)[1]


def rate_flop_ns(width: int, *, quotients: bool = False) -> float:
    """Return sums and products, or quotients, a nanosecond of this core, `width` doubles a register.

    Roots go through the same unit as quotients and take no less.
    """
    start_s = time.process_time()
    done = _native.side_by_side(width, _SIDE_BY_SIDE // (10 if quotients else 1), quotients)
    return done / (time.process_time() - start_s) / _NS
