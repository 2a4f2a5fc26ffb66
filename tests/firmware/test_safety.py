"""The supervisor: its table checked whole, and every limit swept on both sides."""

from __future__ import annotations

import itertools

import pytest

from hil.board import _firmware
from hil.wire import dialect
from tests.firmware.bench import COUNT_RAD, BoardBench, Motor

DISARMED, ARMED, SAFE = (
    dialect.HIL_STATE_DISARMED,
    dialect.HIL_STATE_ARMED,
    dialect.HIL_STATE_SAFE,
)
STATES = (DISARMED, ARMED, SAFE)
REASONS = range(1, dialect.HIL_REASON_ENUM_END)
ACCEPTED = dialect.MAV_RESULT_ACCEPTED


def armed(t_us: int = 1_000_000) -> BoardBench:
    bench = BoardBench(t_us)
    assert bench.arm() == ACCEPTED
    return bench


def motors(**kwargs) -> tuple[Motor, Motor]:
    return Motor(**kwargs), Motor(**kwargs)


# ---- the table ----


def test_every_state_and_condition_leads_where_it_must():
    """All 3 x 2^12 combinations: no fault is ever armed, nothing but arming leaves SAFE."""
    conditions = [1 << reason for reason in REASONS]
    conditions += [_firmware.WANTS_ARM, _firmware.WANTS_DISARM]
    assert sum(1 << reason for reason in REASONS) == _firmware.ANY_FAULT
    for state, picked in itertools.product(STATES, range(1 << len(conditions))):
        held = sum(bit for i, bit in enumerate(conditions) if picked >> i & 1)
        following = _firmware.safety_next(state, held)
        faulty = bool(held & _firmware.ANY_FAULT)
        arms = held & ~_firmware.ANY_FAULT == _firmware.WANTS_ARM and not faulty
        assert following in STATES
        assert not (faulty and following == ARMED)
        if state == ARMED and faulty:
            assert following == SAFE
        if state == SAFE:
            assert following == (ARMED if arms else SAFE)
        if state == DISARMED and held & _firmware.WANTS_DISARM:
            assert following != ARMED
        if held == 0:
            assert following == state


def test_the_reason_of_highest_rank_is_named():
    """Of several faults the lowest HIL_REASON is reported; none gives NONE."""
    for low, high in itertools.combinations(REASONS, 2):
        assert _firmware.safety_reason(1 << low | 1 << high) == low
    assert _firmware.safety_reason(_firmware.WANTS_ARM) == dialect.HIL_REASON_NONE


# ---- set-point time-out ----


@pytest.mark.parametrize(
    ("age_ms", "state"),
    [
        (100, ARMED),
        (245, ARMED),
        (246, ARMED),
        (246.001, SAFE),
        (249, SAFE),
        (250, SAFE),
        (251, SAFE),
    ],
)
def test_wheels_are_off_before_250_ms_without_a_set_point(age_ms, state):
    """A tick that finds the set-point older than 246 ms is the last one before 250 ms: it stops."""
    bench = armed()
    bench.setpoint(5.0)
    bench.tick()
    assert bench.pwm[0] > 0
    bench.t_us += round(age_ms * 1000) - _firmware.TICK_US
    bench.tick()
    assert bench.board.state == state
    assert (bench.pwm == (0, 0)) == (state == SAFE)


def test_the_time_out_latches_and_says_why():
    """After the time-out fresh set-points do nothing; a new arming does."""
    bench = armed()
    bench.tick(70)
    assert (bench.board.state, bench.board.reason) == (SAFE, dialect.HIL_REASON_SETPOINT_TIMEOUT)
    bench.setpoint(5.0)
    bench.tick()
    assert bench.pwm == (0, 0)
    assert "stopped: no set-point within SP_TIMEOUT" in bench.texts()
    assert bench.arm() == ACCEPTED
    bench.setpoint(5.0)
    bench.tick(2)
    assert bench.pwm[0] > 0


@pytest.mark.parametrize("start_us", [2**32 - 100_000, 2**32 - 4000, 2**32 - 1, 2**31 - 50_000])
def test_the_clock_may_wrap(start_us):
    """Across 2^32 us nothing trips while set-points come, and the time-out still works."""
    bench = armed(start_us)
    bench.run(motors(), 100, setpoint=3.0)
    assert bench.board.state == ARMED
    assert bench.board.overruns == 0
    bench.tick(58)  # 244 ms after the last set-point
    assert bench.board.state == ARMED
    bench.tick()
    assert bench.board.state == SAFE


def test_30_hz_set_points_with_delay_and_jitter_keep_it_armed():
    """One set-point in ten lost, the others 10 to 30 ms late: far from the time-out."""
    bench, wheels = armed(), motors()
    arrivals = [33.3 * k + (10, 30, 20, 14, 26)[k % 5] for k in range(300) if k % 10]
    for tick in range(2500):
        while arrivals and arrivals[0] <= 4 * tick:
            arrivals.pop(0)
            bench.setpoint(4.0 + (tick % 7) * 0.1)
        bench.run(wheels, 1)
    assert bench.board.state == ARMED


# ---- commands ----


def test_stop_latches_from_armed_and_from_disarmed():
    """The emergency stop leads to SAFE from anywhere; disarming does not leave SAFE, arming does."""
    for bench in (armed(), BoardBench()):
        assert bench.command(dialect.MAV_CMD_DO_FLIGHTTERMINATION, 1.0) == ACCEPTED
        bench.tick()
        assert (bench.board.state, bench.pwm) == (SAFE, (0, 0))
        assert bench.board.reason == dialect.HIL_REASON_STOP_COMMAND
        bench.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0.0)
        assert bench.board.state == SAFE
        assert bench.arm() == ACCEPTED
        assert bench.board.state == ARMED


def test_disarming_stops_at_the_next_tick():
    """PWM goes from full to 0 at once: cutting off is not slew-limited."""
    bench = armed()
    for _ in range(30):
        bench.setpoint(15.0)
        bench.tick()
    assert bench.pwm[0] > 300
    bench.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0.0)
    bench.tick()
    assert (bench.board.state, bench.pwm) == (DISARMED, (0, 0))


# ---- battery ----


@pytest.mark.parametrize(
    ("millivolts", "ticks", "state"),
    [(9600, 400, ARMED), (9599, 249, ARMED), (9599, 250, SAFE), (9599, 251, SAFE), (0, 250, SAFE)],
)
def test_low_battery_stops_after_its_debounce(millivolts, ticks, state):
    """BATT_LOW 9.6 V for BATT_MS 1,000 ms = 250 ticks; at the limit itself nothing happens."""
    bench = armed()
    bench.battery_mv = millivolts
    bench.run(motors(), ticks, setpoint=2.0)
    assert bench.board.state == state
    if state == SAFE:
        assert bench.board.reason == dialect.HIL_REASON_BATTERY_LOW


def test_a_dip_shorter_than_the_debounce_is_forgotten():
    """0.9 s low, one tick good, 0.9 s low: still armed."""
    bench, wheels = armed(), motors()
    for millivolts, ticks in ((9000, 225), (9700, 1), (9000, 225)):
        bench.battery_mv = millivolts
        bench.run(wheels, ticks, setpoint=2.0)
    assert bench.board.state == ARMED


@pytest.mark.parametrize(("millivolts", "result"), [(9999, 1), (10_000, 0), (10_001, 0)])
def test_a_low_battery_bars_arming_until_it_has_recovered(millivolts, result):
    """Hysteresis: after a stop at 9.6 V arming is refused below 10.0 V."""
    bench = BoardBench()
    bench.battery_mv = 9000
    bench.tick(260)
    bench.battery_mv = millivolts
    bench.tick()
    assert bench.arm() == result
    if result != ACCEPTED:
        assert "not armed: battery below BATT_LOW" in bench.texts()


# ---- wheels and encoders ----


@pytest.mark.parametrize(
    ("asked", "ticks", "state"),
    [(2.0, 124, ARMED), (2.0, 125, SAFE), (1.99, 300, ARMED)],
)
def test_a_set_point_without_counts_is_a_stall_whatever_the_duty(asked, ticks, state):
    """STALL_W 2 rad/s for 125 ticks, PWM_MAX far below STALL_DUTY; just below it nothing happens."""
    bench = BoardBench()
    bench.set_param("PWM_MAX", 0.1)
    assert bench.arm() == ACCEPTED
    for i in range(ticks):
        if i % 8 == 0:
            bench.setpoint(asked)
        bench.tick()
    assert bench.board.state == state


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("law", [0.0, 1.0])
def test_a_dead_encoder_stops_the_robot(side, law):
    """One side's counts stand still under either law: STALL of that side, within 0.6 s."""
    bench, wheels = BoardBench(), motors()
    bench.set_param("LAW", law)
    assert bench.arm() == ACCEPTED
    for tick in range(150):
        if tick % 8 == 0:
            bench.setpoint(4.0)
        bench.counts = [0 if i == side else motor.counts for i, motor in enumerate(wheels)]
        bench.tick()
        for motor, pwm in zip(wheels, bench.pwm, strict=True):
            motor.turn(pwm)
    expected = (dialect.HIL_REASON_STALL_LEFT, dialect.HIL_REASON_STALL_RIGHT)[side]
    assert (bench.board.state, bench.board.reason) == (SAFE, expected)


@pytest.mark.parametrize("asked", [0.3, -4.0, 11.0])
@pytest.mark.parametrize("law", [0.0, 1.0])
@pytest.mark.parametrize("side", [0, 1])
def test_swapped_phases_stop_the_robot(side, law, asked):
    """One side counts against its PWM: RUNAWAY of that side within 0.7 s, crawl or full speed."""
    bench, wheels = BoardBench(), motors()
    bench.set_param("LAW", law)
    assert bench.arm() == ACCEPTED
    for tick in range(175):
        if tick % 8 == 0:
            bench.setpoint(asked)
        bench.counts = [-m.counts if i == side else m.counts for i, m in enumerate(wheels)]
        bench.tick()
        for motor, pwm in zip(wheels, bench.pwm, strict=True):
            motor.turn(pwm)
    expected = (dialect.HIL_REASON_RUNAWAY_LEFT, dialect.HIL_REASON_RUNAWAY_RIGHT)[side]
    assert (bench.board.state, bench.board.reason) == (SAFE, expected)


def test_a_dragged_wheel_may_brake():
    """The outer side of a turn drags the inner one along: 3 s of braking near the set-point."""
    bench, wheels = BoardBench(), motors(dead=0.05)
    bench.set_param("LAW", 1.0)
    assert bench.arm() == ACCEPTED
    for motor in wheels:
        motor.load = -0.4
    bench.run(wheels, 750, setpoint=0.5)
    assert bench.pwm[0] < -100
    assert bench.board.state == ARMED


def test_hard_driving_trips_nothing():
    """Full reversals between -11 and 11 rad/s, a crawl and stops: a sound robot stays armed."""
    bench, wheels = armed(), motors()
    for wanted in (11.0, -11.0, 11.0, 0.05, 0.0, -0.05, -11.0, 0.0, 3.0):
        bench.run(wheels, 175, setpoint=wanted)
        assert bench.board.state == ARMED, dialect.enums["HIL_REASON"][bench.board.reason].name


@pytest.mark.parametrize(("ticks", "state"), [(124, ARMED), (125, ARMED), (126, SAFE), (127, SAFE)])
def test_the_stall_time_is_counted_in_ticks(ticks, state):
    """STALL_MS 500 ms = 125 ticks with PWM above STALL_DUTY and no count.

    Gains give full duty at the first tick, which is the first that a later tick can see.
    """
    bench = BoardBench()
    for name, value in (("FF_GAIN", 1.0), ("PWM_SLEW", 1000.0), ("STALL_W", 60.0)):
        bench.set_param(name, value)
    assert bench.arm() == ACCEPTED
    for i in range(ticks):
        if i % 8 == 0:
            bench.setpoint(10.0)
        bench.tick()
    assert bench.board.state == state


@pytest.mark.parametrize(("omega", "state"), [(27.8, ARMED), (28.3, SAFE)])
def test_overspeed_stops_the_robot(omega, state):
    """OVER_W 28 rad/s: wheels spun up from outside to just below and just above it."""
    bench = BoardBench()
    for name in ("RUN_MS", "STALL_MS"):
        bench.set_param(name, 10_000.0)
    assert bench.arm() == ACCEPTED
    angle_rad = 0.0
    for tick in range(250):
        if tick % 8 == 0:
            bench.setpoint(15.0)
        angle_rad += min(0.2 * tick, omega) * 0.004
        bench.counts = [int(angle_rad / COUNT_RAD)] * 2
        bench.tick()
    assert bench.board.state == state
    if state == SAFE:
        assert bench.board.reason == dialect.HIL_REASON_OVERSPEED_LEFT


@pytest.mark.parametrize(("illegal", "state"), [(49, ARMED), (50, ARMED), (51, SAFE)])
def test_illegal_transitions_are_counted_per_second(illegal, state):
    """ILL_MAX 50 a second: 50 pass, 51 stop; the 16-bit total may wrap."""
    bench = BoardBench()
    bench.board = _firmware.Board()
    bench.faults = 65_530
    bench.tick()
    assert bench.arm() == ACCEPTED
    bench.setpoint(2.0)
    bench.tick()
    bench.faults += illegal
    bench.tick()
    assert bench.board.state == state
    if state == SAFE:
        assert bench.board.reason == dialect.HIL_REASON_ENCODER
        assert bench.arm() != ACCEPTED
        bench.tick(600)  # a clean second clears it
        assert bench.arm() == ACCEPTED


def test_slow_illegal_transitions_never_add_up():
    """40 a second for ten seconds stay below 50 a second."""
    bench, wheels = armed(), motors()
    for _ in range(10):
        bench.run(wheels, 250, setpoint=2.0)
        bench.faults += 40
    assert bench.board.state == ARMED


def test_nothing_moves_without_arming():
    """Set-points to a disarmed board are refused, counted and named; PWM stays 0."""
    bench = BoardBench()
    for _ in range(50):
        bench.setpoint(5.0)
        bench.tick()
        assert bench.pwm == (0, 0)
    assert bench.board.refused_setpoints == 50
    assert "set-point refused: not armed" in bench.texts()
