"""Bench of the wheel laws: the board's own core on the simulated robot, without an outer loop.

Each case is a tape of wheel set-points, sent 30 times a second as the outer loop sends them, and
the disturbances of the case. Figures come from the true wheel speeds, so neither law can gain by
an estimate that flatters it. Positive is forward, wheels are (left, right), speeds in rad/s.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cache
from random import Random
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.board import _firmware
from hil.board.wheel_laws import WHEEL_LAWS, require_wheel_law
from hil.config.events import Disturbance, Fault, Zone
from hil.config.load import load_scenario
from hil.config.mismatch import true_robot
from hil.core.errors import RigFault
from hil.wire import dialect
from hil.wire.framing import FrameReader, FrameWriter
from hil.wire.identity import dialect_hash, parameter_hash
from hil.wire.messages import arming_message, set_parameter_message

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.config.robot import RobotConfig
    from sim_twin import _native

    Array = NDArray[np.float64]

Speeds = tuple[float, float]

# Robots of the bench: as the host believes it, as the default mismatch of 10 % makes it, or, any
# other number, drawn from the box of that mismatch.
BELIEVED, DEFAULT = -1, 0

_SCENARIO = "scenario-1"
_SETPOINT_HZ = 30
_BAUD = 1_000_000  # the link is not on trial
_BOOT_S = 0.1
_FRAME_S = 0.008  # between two parameters: a frame has to be read before the next one comes
_SETTLE_WINDOW_S = 0.06  # moving mean before a speed is called settled, about the period of chatter
_TAIL_S = 0.5


@dataclass(frozen=True, slots=True)
class Case:
    """One run: set-points by time, what befalls the robot, and the event to settle after."""

    setpoint: Callable[[float], Speeds]
    duration_s: float
    event_s: float | None = None
    disturbances: tuple[Disturbance, ...] = ()
    faults: tuple[Fault, ...] = ()


@dataclass(frozen=True, slots=True)
class Figures:
    """What a run is judged by; both wheels together. NaN: has no meaning in this case."""

    rms_error_rad_s: float
    settling_s: float  # after the event, until within 0.2 rad/s + 5 % for good; inf: never
    peak_error_rad_s: float  # largest error on the far side after the event: overshoot, or dip
    steady_error_rad_s: float  # mean error over the last 0.5 s, the worse wheel
    chatter_duty_s: float  # variation of the duty per second
    energy_j: float  # out of the battery, electronics not counted


def _both(speed: Callable[[float], float]) -> Callable[[float], Speeds]:
    return lambda t_s: (speed(t_s),) * 2


def _step(level: float, t_s: float, at_s: float) -> float:
    return level if t_s >= at_s else 0.0


def _weave(t_s: float) -> Speeds:
    """Return S-bends as the outer loop drives them."""
    turn = 3.0 * math.sin(2.0 * math.pi * 0.5 * t_s)
    return min(4.0 * t_s, 5.0) - turn, min(4.0 * t_s, 5.0) + turn


def _approach(t_s: float) -> Speeds:
    """Return the last metre of a scenario: an arc that dies out with 0.8 s."""
    speed = 6.0 * min(2.0 * t_s, 1.0, math.exp(-(t_s - 0.5) / 0.8))
    return 1.2 * speed, 0.8 * speed


def _reversal(t_s: float) -> Speeds:
    """Return what is asked about the goal: small corrections either way."""
    phase = 2.0 * math.pi * 0.5 * t_s
    return 0.5 * math.sin(phase), 0.5 * math.sin(phase + 1.0)


def _pushed(target: Any, amplitude: float, **where: Any) -> Disturbance:
    return Disturbance(target=target, shape="step", amplitude=amplitude, start_s=1.5, **where)


def _swaying(target: Any, amplitude: float, frequency_hz: float) -> Disturbance:
    return Disturbance(target=target, shape="sine", amplitude=amplitude, frequency_hz=frequency_hz)


# Speeds: 10.4 rad/s is the limit of 0.5 m/s, 5.6 rad/s that of 2.5 rad/s of turn on the spot.
CASES: dict[str, Case] = {
    "step": Case(_both(lambda t: 6.0 if t >= 0.2 else 0.0), 2.2, 0.2),
    "small step": Case(_both(lambda t: 3.0 if t < 1.5 else 3.6), 3.0, 1.5),
    "ramp": Case(_both(lambda t: 10.0 * min(t / 1.5, 1.0, max(3.0 - t, 0.0) / 1.0)), 3.4),
    "crawl": Case(_both(lambda t: 0.1 if t < 2.0 else 0.4), 4.0),
    "turn": Case(lambda t: (-_step(3.0, t, 0.2), _step(3.0, t, 0.2)), 2.4, 0.2),
    "slow turn": Case(lambda t: (-_step(0.4, t, 0.2), _step(0.4, t, 0.2)), 3.0, 0.2),
    "weave": Case(_weave, 4.0),
    "approach": Case(_approach, 4.0),
    "reversal": Case(_reversal, 4.0),
    "load step": Case(
        _both(lambda t: min(8.0 * t, 4.0)), 3.5, 1.5, (_pushed("load_left_n_m", 0.15),)
    ),
    "friction patch": Case(
        lambda t: (min(8.0 * t, 3.0), min(8.0 * t, 5.0)),
        3.5,
        None,
        (
            Disturbance(
                target="friction_change_ratio",
                shape="step",
                amplitude=0.75,
                zone=Zone(x_m=0.28, y_m=0.05, radius_m=0.12),
            ),
        ),
    ),
    "battery sag": Case(
        _both(lambda t: min(8.0 * t, 6.0)), 3.0, 1.5, (_pushed("battery_sag_v", 1.5),)
    ),
    "swaying load": Case(
        _both(lambda t: min(8.0 * t, 3.0)),
        4.0,
        None,
        (_swaying("load_left_n_m", 0.12, 1.0), _swaying("load_right_n_m", 0.08, 0.6)),
    ),
    "brake in bends": Case(_weave, 4.0, None, (_pushed("brake_right_n_m", 0.12),)),
    "twisted crawl": Case(
        _both(lambda t: min(2.0 * t, 0.5)), 4.0, None, (_swaying("torque_yaw_n_m", 0.4, 0.5),)
    ),
}


@cache
def robot(seed: int) -> RobotConfig:
    """Return a robot of the bench: BELIEVED, DEFAULT, or drawn from the box of the mismatch."""
    scenario = load_scenario(_SCENARIO)
    ratios = scenario.mismatch
    if seed == BELIEVED:
        ratios = {}
    elif seed != DEFAULT:
        rng = Random(f"wheel bench {seed}")
        ratios = {key: 1.0 + abs(ratio - 1.0) * rng.uniform(-1.0, 1.0)
                  for key, ratio in ratios.items()}  # fmt: skip
    return true_robot(scenario.model_copy(update={"mismatch": ratios}))


@cache
def _defaults() -> dict[str, float]:
    return {entry.name: entry.default for entry in _firmware.parameter_table()}


class _Rig:
    """Kernel and board, armed over the wire; times count from then."""

    def __init__(self, case: Case, parameters: Mapping[str, float], seed: int) -> None:
        from sim_twin.setup import make_kernel  # noqa: PLC0415 - native, for simulated robots only

        self.kernel: _native.Kernel = make_kernel(
            robot(seed),
            _BAUD,
            Random(f"wheel bench {seed} kernel"),
            case.disturbances,
            case.faults,
        )
        self.kernel.reset(0.0, 0.0, 0.0)
        self._writer = FrameWriter()
        self._reader = FrameReader()
        self.state = dialect.HIL_STATE_DISARMED
        self._seq = 0
        self._begin_us = 0
        self._bring_up(parameters)

    def _bring_up(self, parameters: Mapping[str, float]) -> None:
        self.advance(_BOOT_S)
        for name, value in parameters.items():
            self._send(set_parameter_message(name, value))
            self.advance(self.now_s + _FRAME_S)
        self._send(arming_message(dialect_hash(), parameter_hash({**_defaults(), **parameters})))
        self.advance(self.now_s + 0.05)
        if self.state != dialect.HIL_STATE_ARMED:
            raise RigFault("wheel bench: the board refuses to arm with these parameters")
        self._begin_us = self.kernel.time_us
        self.kernel.begin(self._begin_us)

    @property
    def now_s(self) -> float:
        """Time since arming, before it since power-up."""
        return 1e-6 * (self.kernel.time_us - self._begin_us)

    def _send(self, message: dialect.MAVLink_message) -> None:
        self.kernel.receive(self.kernel.time_us, self._writer.encode(message))

    def send_setpoint(self, left_rad_s: float, right_rad_s: float) -> None:
        """Let a set-point reach the board now."""
        self._seq += 1
        frame = self._writer.encode_setpoint(left_rad_s, right_rad_s, self._seq)
        self.kernel.receive(self.kernel.time_us, frame)

    def advance(self, t_s: float) -> None:
        """Run to `t_s` and read what the board says of its state."""
        until_us = self._begin_us + round(1e6 * t_s)
        while self.kernel.advance(until_us) < until_us:
            self._hear()
        self._hear()

    def _hear(self) -> None:
        for _, data in self.kernel.take_sent():
            for msg_id, message, _ in self._reader.feed(data):
                if msg_id == dialect.MAVLINK_MSG_ID_WHEEL_STATE:
                    self.state = message.state


@dataclass(frozen=True, slots=True)
class Trace:
    """One run, sampled every tick of the board; arrays of (n, 2) are (left, right)."""

    t_s: Array
    setpoint_rad_s: Array
    omega_rad_s: Array
    duty: Array
    energy_j: float
    stopped: bool  # the board left ARMED of its own accord


def run(law: str, case: Case, parameters: Mapping[str, float], seed: int = DEFAULT) -> Trace:
    """Run a case with a wheel law; `parameters` go over the board's defaults."""
    rig = _Rig(case, {**parameters, "LAW": WHEEL_LAWS[require_wheel_law(law)]}, seed)
    left, right = (_state_index(f"omega_{side}_rad_s") for side in ("left", "right"))
    charge = _state_index("charge_ratio")
    charge_start = rig.kernel.state()[charge]
    rows: list[tuple[float, ...]] = []
    wanted = (0.0, 0.0)
    ticks = round(case.duration_s / (1e-6 * _firmware.TICK_US))
    sent = 0
    for tick in range(ticks):
        t_s = tick * 1e-6 * _firmware.TICK_US
        if t_s * _SETPOINT_HZ >= sent:
            wanted = case.setpoint(t_s)
            rig.send_setpoint(*wanted)
            sent += 1
        rig.advance(t_s + 1e-6 * _firmware.TICK_US)
        state = rig.kernel.state()
        rows.append((t_s, *wanted, state[left], state[right], *rig.kernel.duty))
    table = np.array(rows)
    battery = robot(seed).battery
    used_a_s = 3600.0 * battery.capacity_a_h * (charge_start - rig.kernel.state()[charge])
    return Trace(
        t_s=table[:, 0],
        setpoint_rad_s=table[:, 1:3],
        omega_rad_s=table[:, 3:5],
        duty=table[:, 5:7],
        energy_j=(used_a_s - battery.idle_a * case.duration_s) * rig.kernel.battery_v,
        stopped=rig.state != dialect.HIL_STATE_ARMED,
    )


def _state_index(name: str) -> int:
    from sim_twin import _native  # noqa: PLC0415 - as above

    return _native.STATES.index(name)


def figures(case: Case, trace: Trace) -> Figures:
    """Return what a run is judged by."""
    error = trace.omega_rad_s - trace.setpoint_rad_s
    tail = trace.t_s >= case.duration_s - _TAIL_S
    variation = float(np.sum(np.abs(np.diff(trace.duty, axis=0)))) / 2.0
    return Figures(
        rms_error_rad_s=float(np.sqrt(np.mean(error**2))),
        settling_s=_settling_s(case, trace),
        peak_error_rad_s=_peak(case, trace),
        steady_error_rad_s=float(np.max(np.abs(np.mean(error[tail], axis=0)))),
        chatter_duty_s=variation / case.duration_s,
        energy_j=trace.energy_j,
    )


def _settling_s(case: Case, trace: Trace) -> float:
    """Return the time after the event from which both wheels stay near their set-points."""
    if case.event_s is None:
        return math.nan
    width = round(_SETTLE_WINDOW_S / (1e-6 * _firmware.TICK_US))
    kernel = np.full(width, 1.0 / width)
    error = trace.omega_rad_s - trace.setpoint_rad_s
    smooth = np.column_stack([np.convolve(error[:, i], kernel, "same") for i in (0, 1)])
    band = 0.2 + 0.05 * np.abs(trace.setpoint_rad_s)
    outside = np.flatnonzero(np.any(np.abs(smooth) > band, axis=1)[: len(smooth) - width])
    if len(outside) == 0 or trace.t_s[outside[-1]] < case.event_s:
        return 0.0
    last_s = float(trace.t_s[outside[-1]])
    return math.inf if outside[-1] == len(smooth) - width - 1 else last_s - case.event_s


def _peak(case: Case, trace: Trace) -> float:
    """Return the largest error after the event on the side away from where the step began."""
    if case.event_s is None:
        return math.nan
    after = trace.t_s >= case.event_s
    error = trace.omega_rad_s - trace.setpoint_rad_s
    way = np.sign(error[np.argmax(after)])
    beyond = -error[after] * way if not case.disturbances else np.abs(error[after])
    return float(max(np.max(beyond), 0.0))


def table(
    parameters: Mapping[str, float], seeds: tuple[int, ...] = (DEFAULT,)
) -> dict[str, dict[str, dict[str, float]]]:
    """Return figures by case, law and name, each the mean over the seeds."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for name, case in CASES.items():
        found[name] = {}
        for law in WHEEL_LAWS:
            runs = [figures(case, run(law, case, parameters, seed)) for seed in seeds]
            found[name][law] = {
                field.name: float(np.mean([getattr(item, field.name) for item in runs]))
                for field in fields(Figures)
            }
    return found


def held_out(count: int) -> tuple[int, ...]:
    """Return robots that no search has seen."""
    return tuple(range(101, 101 + count))


COLUMNS = ("rms rad/s", "settles s", "peak rad/s", "steady rad/s", "chatter duty/s", "energy J")


def row(values: Mapping[str, float]) -> list[str]:
    """Return the figures as they are printed, in the order of COLUMNS."""
    return [_text(value) for value in values.values()]


def _text(value: float) -> str:
    if math.isnan(value):
        return "-"
    return "never" if math.isinf(value) else f"{value:.3g}"


def as_document(
    found: Mapping[str, Mapping[str, Mapping[str, float]]],
) -> dict[str, Any]:
    """Return what `hil bench wheels --json` prints; None: has no meaning, or is never reached."""
    return {
        "cases": {
            case: {
                law: {
                    name: value if math.isfinite(value) else None for name, value in values.items()
                }
                for law, values in laws.items()
            }
            for case, laws in found.items()
        }
    }
