"""Any sequence of messages, silences, resets and garbage: no motion without arming, none beyond limits."""

from __future__ import annotations

import math

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    rule,
    run_state_machine_as_test,
)

from hil.board import _firmware
from hil.wire import dialect
from tests.firmware.bench import TICK_S, BoardBench, Motor

_LONGEST_FRAME = 280
_TIMEOUT_S = 0.25  # SP_TIMEOUT, its default and its largest value
_W_MAX_RAD_S = {entry.name: entry.default for entry in _firmware.parameter_table()}["W_MAX"]
# What a duty step may be in a tick is the slew limit's affair; here only the end of the range counts.
_SPEEDS = st.floats(-2.0 * _W_MAX_RAD_S, 2.0 * _W_MAX_RAD_S) | st.sampled_from(
    [math.nan, math.inf, -math.inf, 1e30, -1e30, 0.0]
)


class AnyHost(RuleBasedStateMachine):
    """A host that does anything, and a board with two motors; judged after every tick."""

    make_bench = BoardBench

    @initialize()
    def power_up(self) -> None:
        """Switch on: nothing was ever armed."""
        self.bench = self.make_bench()
        self.motors = (Motor(), Motor())
        self.may_move = False  # since an arming that the board acknowledged
        self.silent_s = math.inf  # since the last set-point of finite value within the limit
        self.broken: list[str] = []

    def pass_time(self, ticks: int) -> None:
        """Let the board tick, the motors follow."""
        for _ in range(ticks):
            left, right = self.motors
            self.bench.counts[:] = [left.counts, right.counts]
            self.bench.tick()
            self.silent_s += TICK_S
            for motor, pwm in zip(self.motors, self.bench.pwm, strict=True):
                motor.turn(pwm)
            self.judge()

    def judge(self) -> None:
        """Hold the board to its promises."""
        moving = any(self.bench.pwm)
        if moving and not self.may_move:
            self.broken.append("motion without arming")
        if moving and self.silent_s > _TIMEOUT_S + 2.0 * TICK_S:
            self.broken.append(f"motion {self.silent_s:.3f} s after the last set-point")
        if max(abs(pwm) for pwm in self.bench.pwm) > _firmware.PWM_TOP:
            self.broken.append(f"PWM {self.bench.pwm}")
        if moving and self.bench.board.state != dialect.HIL_STATE_ARMED:
            self.broken.append(f"motion in state {self.bench.board.state}")
        if self.bench.board.state != dialect.HIL_STATE_ARMED:
            self.may_move = False

    @rule(ticks=st.integers(1, 120))
    def wait(self, ticks: int) -> None:
        """Say nothing for up to half a second."""
        self.pass_time(ticks)

    @rule(right_hashes=st.booleans())
    def arm(self, right_hashes: bool) -> None:
        """Ask for arming; with a wrong hash it must be refused."""
        wrong = None if right_hashes else 0xDEAD_BEEF
        self.bench.setpoint(0.0)  # a good one, whatever becomes of the arming
        self.silent_s = 0.0
        result = self.bench.arm(wrong)
        accepted = result == dialect.MAV_RESULT_ACCEPTED
        assert right_hashes or not accepted
        if accepted:
            self.may_move = True
        self.pass_time(1)

    @rule(left=_SPEEDS, right=_SPEEDS, ticks=st.integers(1, 20))
    def set_point(self, left: float, right: float, ticks: int) -> None:
        """Ask for any speed; only one that is finite and within the limit keeps the wheels on."""
        self.bench.setpoint(left, right)
        if all(math.isfinite(w) and abs(w) <= _W_MAX_RAD_S for w in (left, right)):
            self.silent_s = 0.0
        self.pass_time(ticks)

    @rule(left=st.floats(2.0, 10.0), right=st.floats(2.0, 10.0), ticks=st.integers(5, 60))
    def drive(self, left: float, right: float, ticks: int) -> None:
        """Arm and drive as a good host does, so that there is motion to be judged."""
        self.arm(right_hashes=True)
        self.set_point(left, right, ticks)

    @rule(data=st.binary(min_size=1, max_size=200))
    def garbage(self, data: bytes) -> None:
        """Send bytes that are no frame; what they promise to be is over when the next one begins."""
        self.bench.receive(data + bytes(_LONGEST_FRAME))
        self.pass_time(2)

    @rule(command=st.sampled_from([dialect.MAV_CMD_DO_FLIGHTTERMINATION]))
    def stop(self, command: int) -> None:
        """Stop at once."""
        self.bench.command(command, 1.0)
        self.pass_time(2)
        assert not any(self.bench.pwm)

    @rule()
    def reset(self) -> None:
        """Take the supply away and bring it back: the wheels turn on, the board is disarmed."""
        self.bench = self.make_bench(
            self.bench.t_us + 100_000, tuple(m.counts for m in self.motors)
        )  # type: ignore[arg-type]
        self.may_move, self.silent_s = False, math.inf
        assert self.bench.board.state != dialect.HIL_STATE_ARMED
        self.pass_time(1)

    @invariant()
    def promises_hold(self) -> None:
        """Nothing was broken so far."""
        assert not getattr(self, "broken", [])


TestAnyHost = AnyHost.TestCase
TestAnyHost.settings = settings(
    max_examples=25, stateful_step_count=25, deadline=None, derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)  # fmt: skip


def test_the_rules_do_move_the_wheels() -> None:
    """A right arming and a set-point turn them, so that the promises above are about something."""
    machine = AnyHost()
    machine.power_up()
    machine.arm(right_hashes=True)
    machine.set_point(8.0, 8.0, 20)
    assert any(machine.bench.pwm)
    machine.wait(70)
    assert not any(machine.bench.pwm)
    assert not machine.broken


class NeverSilent(BoardBench):
    """A board as if it had no time-out: it is given its last set-point again, whatever the host does."""

    def tick(self, *args: float, **kwargs: float) -> None:
        """Hear the last set-point once more, then tick."""
        again = getattr(self, "last", None)
        if again is not None:
            super().setpoint(*again)
        super().tick(*args, **kwargs)  # type: ignore[arg-type]

    def setpoint(self, *speeds: float) -> None:
        """Keep what was asked."""
        self.last = speeds
        super().setpoint(*speeds)


class AnyHash(BoardBench):
    """A board as if it compared no hashes: it is always given the right one."""

    def arm(self, _wrong: int | None = None) -> int:
        """Arm, whatever was presented."""
        return super().arm()


@pytest.mark.parametrize("bench", [NeverSilent, AnyHash])
def test_a_board_without_its_checks_is_caught(bench: type[BoardBench]) -> None:
    """Negative control: a promise is broken, and found so."""
    machine = type("Broken", (AnyHost,), {"make_bench": bench})
    found_only = settings(TestAnyHost.settings, phases=[Phase.generate])
    with pytest.raises(AssertionError):
        run_state_machine_as_test(machine, settings=found_only)
