"""Encoders that tell part of the truth: a dead channel, loose contacts; and wheels that are sound."""

from __future__ import annotations

import math

import pytest

from hil.board import _firmware
from hil.config.events import Fault
from hil.wire import dialect
from tests.firmware.bench import BoardBench, Motor
from tests.twin.rigs import armed, first

ARMED, SAFE = dialect.HIL_STATE_ARMED, dialect.HIL_STATE_SAFE
STALL = {"left": dialect.HIL_REASON_STALL_LEFT, "right": dialect.HIL_REASON_STALL_RIGHT}


def name(reason: int) -> str:
    return str(dialect.enums["HIL_REASON"][reason].name)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("kind", ["dead_channel_a", "dead_channel_b", "dead_encoder"])
@pytest.mark.parametrize("asked", [1.0, 1.9, 5.0, -1.0, -5.0])
def test_an_encoder_of_which_a_channel_is_dead_stops_the_robot(kind, side, asked):
    """One channel alone makes the count flicker by one: STALL of that side, as for both dead.

    STALL_MS after the set-point is at STALL_W, or after the duty has grown to STALL_DUTY.
    """
    drive = armed(faults=(Fault(kind=kind, side=side, start_s=0.5),))
    drive.run(0.5, asked, asked)
    stopped = first(drive.run(1.2 if abs(asked) < 2.0 else 0.65, asked, asked), _is_safe)
    assert stopped is not None
    assert stopped.reason == STALL[side], name(stopped.reason)
    assert drive.twin._kernel.duty == (0.0, 0.0)


def _is_safe(wire) -> bool:
    return bool(wire.state == SAFE)


@pytest.mark.parametrize("kind", ["dead_channel_a", "dead_encoder"])
@pytest.mark.parametrize(
    ("dead_s", "sound_s"), [(0.35, 0.05), (0.35, 0.35), (0.35, 1.0), (0.2, 0.2)]
)
@pytest.mark.parametrize("asked", [5.0, -5.0])
def test_a_loose_contact_adds_up(kind, dead_s, sound_s, asked):
    """Dead for less than STALL_MS at a time, again and again: STALL before 2 s are over."""
    period_s = dead_s + sound_s
    faults = tuple(
        Fault(kind=kind, side="right", start_s=start_s, end_s=start_s + dead_s)
        for start_s in (0.5 + period_s * i for i in range(math.ceil(2.5 / period_s)))
    )
    drive = armed(faults=faults)
    drive.run(0.5, asked, asked)
    stopped = first(drive.run(2.0, asked, asked), _is_safe)
    assert stopped is not None
    assert stopped.reason == STALL["right"], name(stopped.reason)


@pytest.mark.parametrize("kind", ["swapped_phases", "motor_reversed"])
@pytest.mark.parametrize(("wrong_s", "sound_s"), [(0.25, 0.1), (0.25, 0.25), (0.2, 0.2)])
@pytest.mark.parametrize("asked", [1.0, 5.0, -5.0])
def test_a_wheel_that_runs_the_wrong_way_now_and_then_adds_up(kind, wrong_s, sound_s, asked):
    """Wrong for less than RUN_MS at a time, again and again: RUNAWAY before 2 s are over."""
    period_s = wrong_s + sound_s
    faults = tuple(
        Fault(kind=kind, side="left", start_s=start_s, end_s=start_s + wrong_s)
        for start_s in (0.5 + period_s * i for i in range(math.ceil(2.5 / period_s)))
    )
    drive = armed(faults=faults)
    drive.run(0.5, asked, asked)
    stopped = first(drive.run(2.0, asked, asked), _is_safe)
    assert stopped is not None
    assert stopped.reason == dialect.HIL_REASON_RUNAWAY_LEFT, name(stopped.reason)


def test_one_short_failure_is_forgotten():
    """Dead for 0.35 s every 4 s: no stall, the robot goes on."""
    faults = tuple(
        Fault(kind="dead_encoder", side="left", start_s=s, end_s=s + 0.35) for s in (1.0, 5.0, 9.0)
    )
    drive = armed(faults=faults)
    reports = drive.run(11.0, 3.0, 3.0)
    assert first(reports, _is_safe) is None


@pytest.mark.parametrize("counts_per_turn", [100, 1920])
@pytest.mark.parametrize("setpoint", [0.6, 2.0, 8.0])
def test_a_coarse_encoder_on_a_sound_wheel_is_no_stall(counts_per_turn, setpoint):
    """100 counts a turn give one every 0.1 s at 0.6 rad/s, under a load near STALL_DUTY: armed."""
    bench = BoardBench()
    bench.set_param("ENC_COUNTS", float(counts_per_turn))
    bench.set_param("LAW", 1.0)
    assert bench.arm() == dialect.MAV_RESULT_ACCEPTED
    wheels = Motor(dead=0.05), Motor(dead=0.05)
    for motor in wheels:
        motor.load = 0.45
    for tick in range(1500):
        if tick % 8 == 0:
            bench.setpoint(setpoint)
        bench.counts = [
            math.floor(motor.angle_rad * counts_per_turn / math.tau) for motor in wheels
        ]
        bench.tick()
        for motor, pwm in zip(wheels, bench.pwm, strict=True):
            motor.turn(pwm)
    assert bench.board.state == ARMED, name(bench.board.reason)


def test_starting_stopping_and_turning_about_trips_nothing():
    """A sound robot on its floor, started, reversed and turned on the spot twice a second for 12 s."""
    drive = armed()
    for left, right in (
        (4.0, 4.0),
        (-4.0, -4.0),
        (3.0, -3.0),
        (0.0, 0.0),
        (2.0, 8.0),
        (-2.0, 2.0),
    ) * 4:
        assert first(drive.run(0.5, left, right), _is_safe) is None


def _held(setpoint: float, hold_until_ratio: float) -> tuple[BoardBench, float]:
    """Return a bench after 6 s at a set-point, its wheels held up to that duty, and the highest duty."""
    bench = BoardBench()
    bench.set_param("LAW", 0.0)
    assert bench.arm() == dialect.MAV_RESULT_ACCEPTED
    wheels = Motor(dead=hold_until_ratio), Motor(dead=hold_until_ratio)
    highest = 0.0
    for _ in range(60):
        bench.run(wheels, 25, setpoint)
        highest = max(highest, abs(bench.pwm[0]) / _firmware.PWM_TOP)
    return bench, highest


def test_a_sound_wheel_that_creeps_against_scrubbing_tyres_is_no_stall():
    """Held up to 0.6 of the duty and asked for 0.1 rad/s: above STALL_DUTY for seconds, and armed."""
    bench, highest = _held(0.1, 0.6)
    assert highest > 0.5, "never above STALL_DUTY: the case says nothing"
    assert bench.board.state == ARMED, name(bench.board.reason)


@pytest.mark.parametrize("setpoint", [0.3, 1.0])
def test_a_wheel_that_is_blocked_is_a_stall_all_the_same(setpoint):
    """Asked for more than a creep, or pushed at three quarters of the duty and more."""
    bench, _ = _held(setpoint, 2.0)
    assert bench.board.state == SAFE
    assert bench.board.reason in STALL.values(), name(bench.board.reason)


@pytest.mark.parametrize("kind", ["dead_channel_a", "dead_encoder"])
def test_a_dead_encoder_of_a_creeping_wheel_stops_the_robot(kind):
    """Asked for 0.4 rad/s the duty grows past three quarters, as nothing comes back; then it is a stall."""
    drive = armed(faults=(Fault(kind=kind, side="left", start_s=0.5),))
    drive.run(0.5, 0.4, 0.4)
    stopped = first(drive.run(6.0, 0.4, 0.4), _is_safe)
    assert stopped is not None
    assert stopped.reason == STALL["left"], name(stopped.reason)
