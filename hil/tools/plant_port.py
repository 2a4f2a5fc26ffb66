"""The twin's plant written a second time, for the bench: any kind of number goes through it.

What it covers is what a run without disturbances takes: skid steer, rolling wheels, no loads, no jam. Plain
floats, numpy arrays (many runs side by side), numba's machine code, and numbers that count what is done with
them (`Counted`) all take the same lines. Equations, signs and units: docs/twin.md, sim_twin/native/plant.cpp.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sim_twin.setup import plant_params

if TYPE_CHECKING:
    from hil.config.robot import RobotConfig

Step = Callable[..., tuple[Any, ...]]

_GRAVITY_M_S2 = 9.81


class Numbers(NamedTuple):
    """What a step needs of the robot, worked out: `twin::Terms`."""

    half_track_m: float
    d0_m: float
    front_arm_m: float
    rear_arm_m: float
    mass_arm_kg_m: float
    motors: float
    bridge_drop_v: float
    resistance_ohm: float
    bridge_smoothing2_a2: float
    emf_v_s_m: float
    drive_n_a: float
    loss_n_a: float
    steady_n: float
    viscous_n_s_m: float
    stribeck_n_m2_s2: float
    stribeck2_m2_s2: float
    empty_v: float
    span_v: float
    battery_resistance_ohm: float
    idle_a: float
    smoothing2_m2_s2: float
    per_radius: float
    per_inductance: float
    per_charge: float
    front_scrub_n_m: float
    rear_scrub_n_m: float
    per_mass_rim: float
    per_inertia_rim: float


def numbers_of(robot: RobotConfig) -> Numbers:
    """Return a skid-steer robot's numbers."""
    p = plant_params(robot)
    rotor = p.motor_gear_ratio**2 * p.motor_rotor_inertia_kg_m2
    rim_kg = 2.0 * (p.motor_per_side * rotor + 2.0 * p.wheel_inertia_kg_m2) / p.wheel_radius_m**2
    weight_n = p.mass_kg * _GRAVITY_M_S2
    slide_n = p.floor_friction_ratio * weight_n / (p.front_axle_m + p.rear_axle_m)
    turned_kg_m2 = p.inertia_kg_m2 + p.mass_kg * p.d0_m**2 + 0.25 * p.track_m**2 * rim_kg
    at_rim = p.motor_per_side / p.wheel_radius_m
    drive_n_a = p.motor_torque_constant_n_m_a * p.motor_gear_ratio * at_rim
    stribeck2 = (p.motor_stribeck_rad_s * p.wheel_radius_m) ** 2
    front_arm_m, rear_arm_m = p.front_axle_m - p.d0_m, p.rear_axle_m + p.d0_m
    return Numbers(
        half_track_m=0.5 * p.track_m,
        d0_m=p.d0_m,
        front_arm_m=front_arm_m,
        rear_arm_m=rear_arm_m,
        mass_arm_kg_m=p.mass_kg * p.d0_m,
        motors=p.motor_per_side,
        bridge_drop_v=p.bridge_drop_v,
        resistance_ohm=p.motor_resistance_ohm + p.motor_per_side * p.bridge_resistance_ohm,
        bridge_smoothing2_a2=(p.bridge_smoothing_a / p.motor_per_side) ** 2,
        emf_v_s_m=p.motor_emf_constant_v_s_rad * p.motor_gear_ratio / p.wheel_radius_m,
        drive_n_a=drive_n_a,
        loss_n_a=(1.0 - p.motor_gear_efficiency_ratio) * drive_n_a,
        steady_n=p.motor_coulomb_n_m * at_rim + 0.5 * p.floor_rolling_ratio * weight_n,
        viscous_n_s_m=p.motor_viscous_n_m_s_rad * at_rim / p.wheel_radius_m,
        stribeck_n_m2_s2=(p.motor_stiction_n_m - p.motor_coulomb_n_m) * at_rim * stribeck2,
        stribeck2_m2_s2=stribeck2,
        empty_v=p.battery_empty_v,
        span_v=p.battery_full_v - p.battery_empty_v,
        battery_resistance_ohm=p.battery_resistance_ohm,
        idle_a=p.battery_idle_a,
        smoothing2_m2_s2=p.floor_smoothing_m_s**2,
        per_radius=1.0 / p.wheel_radius_m,
        per_inductance=1.0 / p.motor_inductance_h,
        per_charge=1.0 / (3600.0 * p.battery_capacity_a_h),
        front_scrub_n_m=front_arm_m * slide_n * p.rear_axle_m,
        rear_scrub_n_m=rear_arm_m * slide_n * p.front_axle_m,
        per_mass_rim=1.0 / (p.mass_kg + rim_kg),
        per_inertia_rim=1.0 / turned_kg_m2,
    )


class Functions(NamedTuple):
    """What a kind of number needs besides sums, products and quotients."""

    root: Callable[[Any], Any]
    size: Callable[[Any], Any]
    not_below_0: Callable[[Any], Any]
    cos: Callable[[Any], Any]
    sin: Callable[[Any], Any]


def _not_below_0(value: Any) -> Any:
    return max(value, 0.0)


OF_FLOATS = Functions(math.sqrt, abs, _not_below_0, math.cos, math.sin)
OF_ARRAYS = Functions(np.sqrt, np.abs, lambda v: np.maximum(v, 0.0), np.cos, np.sin)


def _as_it_is(function: Any) -> Any:
    return function


def make_step(f: Functions, made: Callable[[Any], Any] = _as_it_is) -> Step:  # noqa: PLR0915 - closures
    """Return step(state, p, h_s, duty_left, duty_right): one step of Runge and Kutta, order 4.

    `state` is in the order of `_native.STATES`. Each function goes through `made` (numba's compiler).
    """
    root, size, not_below_0, cos, sin = f

    def side(p: Numbers, amps: Any, rim: Any, slide: Any) -> Any:
        """Return soft signs of a current and of an axle's sliding, and friction at a rim (N)."""
        bridge2 = amps * amps + p.bridge_smoothing2_a2
        slide2 = slide * slide + p.smoothing2_m2_s2
        rim2 = rim * rim
        roll2, stribeck2 = rim2 + p.smoothing2_m2_s2, rim2 + p.stribeck2_m2_s2
        others2, dry2 = bridge2 * slide2, roll2 * stribeck2
        per_all = 1.0 / (dry2 * others2)
        dry = (p.steady_n + p.loss_n_a * size(amps)) * stribeck2 + p.stribeck_n_m2_s2
        return (
            amps * slide2 * dry2 * root(bridge2) * per_all,
            slide * bridge2 * dry2 * root(slide2) * per_all,
            rim * dry * others2 * root(roll2) * per_all,
        )

    side = made(side)

    def motor(
        p: Numbers, amps: Any, sign: Any, rim: Any, dry: Any, duty: Any, supply_v: Any
    ) -> Any:
        """Return rate of the current (A/s) and force at the rim (N) of one side."""
        left_v = (
            duty * supply_v - p.emf_v_s_m * rim - p.resistance_ohm * amps - p.bridge_drop_v * sign
        )
        return p.per_inductance * left_v, p.drive_n_a * amps - p.viscous_n_s_m * rim - dry

    motor = made(motor)

    def slope(x: Any, p: Numbers, c: Any, s: Any, duty_left: Any, duty_right: Any) -> Any:
        """Return the state's rate, at a heading of cosine c and sine s; of what follows, nothing."""
        _, _, _, eta1, turn, left_a, right_a, _, _, charge = x
        drawn_a = p.idle_a + p.motors * (duty_left * left_a + duty_right * right_a)
        supply_v = not_below_0(p.empty_v + p.span_v * charge - p.battery_resistance_ohm * drawn_a)
        eta2, aside = -p.d0_m * turn, p.half_track_m * turn
        left_v, right_v = eta1 - aside, eta1 + aside
        left_sign, front_sign, left_dry = side(p, left_a, left_v, p.front_arm_m * turn)
        right_sign, rear_sign, right_dry = side(p, right_a, right_v, -p.rear_arm_m * turn)
        left_rate, left_n = motor(p, left_a, left_sign, left_v, left_dry, duty_left, supply_v)
        right_rate, right_n = motor(
            p, right_a, right_sign, right_v, right_dry, duty_right, supply_v
        )
        scrub_n_m = p.front_scrub_n_m * front_sign - p.rear_scrub_n_m * rear_sign
        turn_n_m = p.mass_arm_kg_m * (eta1 * turn) - scrub_n_m
        moment = p.half_track_m * (right_n - left_n) + turn_n_m
        return (
            c * eta1 - s * eta2,
            s * eta1 + c * eta2,
            turn,
            (left_n + right_n - p.mass_arm_kg_m * (turn * turn)) * p.per_mass_rim,
            moment * p.per_inertia_rim,
            left_rate,
            right_rate,
            left_v * p.per_radius,
            right_v * p.per_radius,
            -p.per_charge * drawn_a,
        )

    slope = made(slope)

    def moved(x: Any, h: Any, k: Any) -> Any:
        """Return x + h k, of what a slope looks at."""
        return (
            x[0], x[1], x[2] + h * k[2], x[3] + h * k[3], x[4] + h * k[4], x[5] + h * k[5],
            x[6] + h * k[6], x[7], x[8], x[9] + h * k[9],
        )  # fmt: skip

    moved = made(moved)

    def turned(x: Any, p: Numbers, c: Any, s: Any, by: Any, duties: Any) -> Any:
        """Return the rate of a state turned by `by` from cosine c and sine s: the series of both."""
        d2 = by * by
        less = d2 * (0.5 - d2 * (1.0 / 24.0))
        sine = by * (1.0 - d2 * (1.0 / 6.0 - d2 * (1.0 / 120.0)))
        return slope(
            x, p, c - (c * less + s * sine), s - (s * less - c * sine), duties[0], duties[1]
        )

    turned = made(turned)

    def ahead(x: Any, sixth: Any, k1: Any, k2: Any, k3: Any, k4: Any) -> Any:
        """Return a number of the state a step later, from its four slopes."""
        return x + sixth * (k1 + 2.0 * (k2 + k3) + k4)

    ahead = made(ahead)

    def step(whole: Any, p: Numbers, h: Any, duty_left: Any, duty_right: Any) -> Any:
        """Return the state a step later."""
        x = (
            whole[0], whole[1], whole[2], whole[3], whole[5], whole[6], whole[7], whole[8],
            whole[9], whole[12],
        )  # fmt: skip
        theta = x[2]
        c, s = cos(theta), sin(theta)
        duties = (duty_left, duty_right)
        k1 = slope(x, p, c, s, duty_left, duty_right)
        x2 = moved(x, 0.5 * h, k1)
        k2 = turned(x2, p, c, s, x2[2] - theta, duties)
        x3 = moved(x, 0.5 * h, k2)
        k3 = turned(x3, p, c, s, x3[2] - theta, duties)
        x4 = moved(x, h, k3)
        k4 = turned(x4, p, c, s, x4[2] - theta, duties)
        sixth = h / 6.0
        eta1 = ahead(x[3], sixth, k1[3], k2[3], k3[3], k4[3])
        turn = ahead(x[4], sixth, k1[4], k2[4], k3[4], k4[4])
        aside = p.half_track_m * turn
        return (
            ahead(x[0], sixth, k1[0], k2[0], k3[0], k4[0]),
            ahead(x[1], sixth, k1[1], k2[1], k3[1], k4[1]),
            ahead(x[2], sixth, k1[2], k2[2], k3[2], k4[2]),
            eta1,
            -p.d0_m * turn,
            turn,
            ahead(x[5], sixth, k1[5], k2[5], k3[5], k4[5]),
            ahead(x[6], sixth, k1[6], k2[6], k3[6], k4[6]),
            ahead(x[7], sixth, k1[7], k2[7], k3[7], k4[7]),
            ahead(x[8], sixth, k1[8], k2[8], k3[8], k4[8]),
            (eta1 - aside) * p.per_radius,
            (eta1 + aside) * p.per_radius,
            ahead(x[9], sixth, k1[9], k2[9], k3[9], k4[9]),
        )

    return made(step)  # type: ignore[no-any-return]


class Counted:
    """A number that counts what is done with it, and how long it has waited: the chain before it.

    `counts` holds sums, products, quotients, roots and sines; `takes` how long each keeps a result
    waiting, in any unit.
    """

    def __init__(
        self, value: float, at: float, counts: Counter[str], takes: dict[str, float]
    ) -> None:
        self.value, self.at = value, at
        self._counts, self._takes = counts, takes

    def _result(self, kind: str, value: float, *operands: Any) -> Counted:
        self._counts[kind] += 1
        ready = max([self.at, *(o.at for o in operands if isinstance(o, Counted))])
        return Counted(value, ready + self._takes.get(kind, 0.0), self._counts, self._takes)

    def __add__(self, other: Any) -> Counted:
        """Return the sum."""
        return self._result("sum", self.value + _value(other), other)

    def __sub__(self, other: Any) -> Counted:
        """Return the difference."""
        return self._result("sum", self.value - _value(other), other)

    def __rsub__(self, other: float) -> Counted:
        """Return the difference from a plain number."""
        return self._result("sum", other - self.value)

    def __mul__(self, other: Any) -> Counted:
        """Return the product."""
        return self._result("product", self.value * _value(other), other)

    def __truediv__(self, other: Any) -> Counted:
        """Return the quotient."""
        return self._result("quotient", self.value / _value(other), other)

    def __rtruediv__(self, other: float) -> Counted:
        """Return the quotient of a plain number."""
        return self._result("quotient", other / self.value)

    __radd__, __rmul__ = __add__, __mul__

    def root(self) -> Counted:
        """Return the square root."""
        return self._result("root", math.sqrt(self.value))

    def sine(self, function: Callable[[float], float]) -> Counted:
        """Return a sine or cosine."""
        return self._result("sine", function(self.value))

    def kept(self, value: float) -> Counted:
        """Return what costs no arithmetic: a sign taken off, a bound."""
        return Counted(value, self.at, self._counts, self._takes)


def _value(number: Any) -> float:
    return number.value if isinstance(number, Counted) else number


OF_COUNTED = Functions(
    Counted.root,
    lambda v: v.kept(abs(v.value)),
    lambda v: v.kept(max(v.value, 0.0)),
    lambda v: v.sine(math.cos),
    lambda v: v.sine(math.sin),
)


def counted(
    robot: RobotConfig, takes: dict[str, float], steps: int = 8
) -> tuple[dict[str, float], float]:
    """Return operations of a step by kind, and how long a step's results wait for each other.

    `takes` is how long a sum, product, quotient, root and sine do, in any unit; the wait is in the same.
    Of many steps the mean is taken, which leaves out what the first and the last do side by side.
    """
    step, p, counts = make_step(OF_COUNTED), numbers_of(robot), Counter[str]()
    state: tuple[Any, ...] = tuple(
        Counted(value, 0.0, counts, takes) for value in (0.0, 0.0, 0.3, *(0.1,) * 9, 1.0)
    )
    for _ in range(steps):
        state = step(state, p, 1e-4, 0.5, 0.3)
    wait = max(number.at for number in state) / steps
    return {kind: count / steps for kind, count in counts.items()}, wait
