"""A host and anything between it and its robot: nothing moves unarmed or beyond limits; all ends at rest."""

from __future__ import annotations

import math
import random
import struct
from collections.abc import Callable, Generator
from dataclasses import replace
from pathlib import Path
from typing import Any

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

from hil.config.fit import board_parameters
from hil.config.load import load_scenario
from hil.control.laws.making import make_law
from hil.record.memory import MemoryRecorder
from hil.rigs.opening import open_rig
from hil.runs.assembly import make_parts
from hil.runs.parts import Situation
from hil.runs.provenance import make_manifest, used_things
from hil.runs.session import Session
from hil.runs.spec import RunSpec
from hil.wire import dialect
from hil.wire.framing import BOARD_COMPONENT, BOARD_SYSTEM, FrameWriter
from hil.wire.identity import board_hashes
from sim_twin.twin import Twin
from tests.system.between import Between, nothing_seen, pose_off

_UP = (
    dialect.MAVLINK_MSG_ID_HEARTBEAT, dialect.MAVLINK_MSG_ID_SYS_STATUS,
    dialect.MAVLINK_MSG_ID_PARAM_VALUE, dialect.MAVLINK_MSG_ID_COMMAND_ACK,
    dialect.MAVLINK_MSG_ID_TIMESYNC, dialect.MAVLINK_MSG_ID_STATUSTEXT,
    dialect.MAVLINK_MSG_ID_BOARD_INFO, dialect.MAVLINK_MSG_ID_WHEEL_STATE,
)  # fmt: skip
# The drive is off 0.25 s after the last set-point; what is left is coasting, from 1 m/s at 0.7 m/s^2.
_REST_S, _COAST_S = 0.25, 1.0 / 0.7
# What the host may take beyond its limits: a tick, and what lay on the way.
_SLACK_S = 0.15


def made_up(msg_id: int, rng: random.Random) -> bytes:
    """Return a good frame of the board's with any content: ends of ranges, NaN, and what is likely."""
    kind = dialect.mavlink_map[msg_id]
    return FrameWriter(BOARD_SYSTEM, BOARD_COMPONENT).encode(
        kind(
            *[
                _value(name, of, rng)
                for name, of in zip(kind.fieldnames, kind.fieldtypes, strict=True)
            ]
        )
    )


def _value(name: str, of: str, rng: random.Random) -> Any:
    if of == "char":
        return rng.choice([b"", b"PID_KP", b"\xff" * 16, b"W_MAX", b"\x1b[31m"])
    if of == "float":
        return rng.choice([0.0, 1.0, -1.0, math.nan, math.inf, -1e30, rng.uniform(-20.0, 20.0)])
    if name in {"state", "reason", "result"}:
        return rng.randrange(6)
    if name == "command":
        return rng.choice([dialect.MAV_CMD_COMPONENT_ARM_DISARM, rng.randrange(65536)])
    bits = int("".join(filter(str.isdigit, of)))
    low, high = (
        (0, 2**bits - 1) if of.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    )
    return rng.choice([low, high, 0, rng.randint(low, high)])


def spoilt(data: bytes, rng: random.Random) -> bytes:
    """Return bytes with one changed, some missing, or all twice."""
    at = rng.randrange(len(data))
    match rng.randrange(4):
        case 0:
            return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]
        case 1:
            return data[:at] + data[at + rng.randrange(30) :]
        case 2:
            return data * 2
        case _:
            return struct.pack("<I", rng.getrandbits(32)) + data


class AnyWorld(RuleBasedStateMachine):
    """One run of a host; each rule spoils something for a while, then some ticks pass."""

    @initialize(
        seed=st.integers(0, 2**16), law=st.sampled_from(["pid", "asg-ism"]),
        scenario=st.sampled_from(["scenario-1", "scenario-3", "circle"]),
        reset_s=st.none() | st.floats(0.05, 3.0), early=st.integers(0, 6),
    )  # fmt: skip
    def power_up(
        self, seed: int, law: str, scenario: str, reset_s: float | None, early: int
    ) -> None:
        """Begin to connect; up to six things go wrong before the first tick."""
        reset = f'{{kind = "board_reset", start_s = {reset_s}, end_s = {(reset_s or 0.0) + 0.2}}}'
        loaded = load_scenario(
            scenario, ["duration_s=6", f"faults=[{reset}]" if reset_s else "faults=[]"]
        )
        twin = open_rig("twin", loaded, "pose", 1 + seed)
        assert isinstance(twin, Twin)
        self.limits = loaded.safety
        self.rng = random.Random(seed)
        parameters = board_parameters(loaded, "asg-ism")
        self.rig = Between(twin, parameters["W_MAX"])
        for at_s in sorted(self.rng.uniform(0.0, 2.0) for _ in range(early)):
            self.rig.later.append((twin.now_s() + at_s, self.anything))
        spec = RunSpec(loaded, "twin", "pose", law, "asg-ism", 1 + seed, Path())
        self.recorder = MemoryRecorder(make_manifest(spec, parameters, used_things(spec)))
        parts = make_parts(spec, self.rig, self.recorder, make_law(law, loaded))
        self.session = Session(loaded, parts, parameters, board_hashes)
        self.steps: Generator[Situation] | None = self.session.steps()
        self.pass_ticks(1)

    def anything(self) -> None:
        """Do one of what the rules below do, for a short time."""
        short: list[Callable[[], None]] = [
            lambda: self.rig.make_up(made_up(self.rng.choice(_UP), self.rng)),
            lambda: self.cut("up_cut_s", self.rng.uniform(0.0, 0.3)),
            lambda: self.cut("down_cut_s", self.rng.uniform(0.0, 0.3)),
            lambda: self.cut("blind_s", self.rng.uniform(0.0, 0.3)),
            lambda: self.rig.make_up(self.rng.randbytes(self.rng.randrange(200))),
        ]
        self.rng.choice(short)()

    def cut(self, what: str, for_s: float) -> None:
        """Let nothing pass for so long."""
        setattr(self.rig, what, self.rig.now_s() + for_s)

    def pass_ticks(self, count: int) -> None:
        """Let the host run on; judge after each tick that it did not refuse."""
        for _ in range(count):
            if self.steps is None:
                return
            try:
                next(self.steps)
            except StopIteration:
                self.ended()
                return
            self.judge()

    def judge(self) -> None:
        """Hold a host that runs on to its own limits."""
        now_s, rig = self.rig.now_s(), self.rig
        if now_s - rig.report_s > self.limits.link_lost_s + _SLACK_S:
            rig.broken.append(f"no report for {now_s - rig.report_s:.2f} s and the run goes on")
        if now_s - rig.pose_s > self.limits.pose_lost_s + _SLACK_S:
            rig.broken.append(f"no pose for {now_s - rig.pose_s:.2f} s and the run goes on")

    def ended(self) -> None:
        """Judge a host that has let go: the robot comes to rest, and the record says how it ended."""
        self.steps, rig = None, self.rig
        assert self.session.error is None, self.session.error
        assert self.session.ending.outcome in {"complete", "fault", "interrupted"}
        kinds = [event.kind for event in self.recorder.events]
        if "armed" in kinds:
            assert {"stopped", "stop"} & set(kinds), kinds
        end_s = rig.now_s()
        while rig.now_s() < end_s + _REST_S + _COAST_S + 0.5:
            rig.wait(rig.now_s() + 0.005)
            rig.read()
            while rig.poll_frame() is not None:
                pass
        if rig.moving_s > end_s + _REST_S + _COAST_S:
            rig.broken.append(f"moves {rig.moving_s - end_s:.2f} s after the end")
        rig.close()

    @rule(ticks=st.integers(1, 20))
    def undisturbed(self, ticks: int) -> None:
        """Let it run, with nothing spoilt any more."""
        self.rig.spoil, self.rig.spoil_pose = bytes, lambda frame: frame
        self.pass_ticks(ticks)

    @rule(msg_id=st.sampled_from(_UP), count=st.integers(1, 5))
    def message(self, msg_id: int, count: int) -> None:
        """Somebody else speaks as the board."""
        for _ in range(count):
            self.rig.make_up(made_up(msg_id, self.rng))
        self.pass_ticks(2)

    @rule(what=st.sampled_from(["up_cut_s", "down_cut_s", "blind_s"]), for_s=st.floats(0.02, 1.2))
    def silence(self, what: str, for_s: float) -> None:
        """One direction, or the camera, is gone for a while."""
        self.cut(what, for_s)
        self.pass_ticks(8)

    @rule(ticks=st.integers(1, 10))
    def bad_line(self, ticks: int) -> None:
        """Every chunk is damaged, cut or doubled."""
        self.rig.spoil = lambda data: spoilt(data, self.rng)
        self.pass_ticks(ticks)

    @rule(data=st.binary(min_size=1, max_size=150))
    def garbage(self, data: bytes) -> None:
        """Bytes that are no frame."""
        self.rig.make_up(data)
        self.pass_ticks(1)

    @rule(count=st.integers(1, 30))
    def said_before(self, count: int) -> None:
        """Repeat what the board said a while ago."""
        for data in list(self.rig.kept)[:count]:
            self.rig.make_up(data)
        self.pass_ticks(2)

    @rule(
        off=st.sampled_from([(0.0, 0.0), (0.05, 0.0), (9.0, 0.0), (math.nan, 0.0), (0.0, math.inf)]),
        late_s=st.sampled_from([0.0, -0.2, 0.2, 1e9, math.nan]), seen=st.booleans(),
    )  # fmt: skip
    def bad_frames(self, off: tuple[float, float], late_s: float, seen: bool) -> None:
        """Poses, and stamps, that are wrong, until something else happens."""
        self.rig.spoil_pose = lambda frame: replace(
            pose_off(frame, *off) if seen else nothing_seen(frame), t_cam_s=frame.t_cam_s + late_s
        )
        self.pass_ticks(6)

    @rule()
    def let_go(self) -> None:
        """Whoever runs it closes the iterator: the robot is stopped all the same."""
        if self.steps is not None:
            self.steps.close()
            self.ended()

    @invariant()
    def promises_hold(self) -> None:
        """Nothing was broken so far."""
        assert not self.rig.broken

    def teardown(self) -> None:
        """Let the run come to its end."""
        if getattr(self, "steps", None) is not None:
            self.undisturbed(400)
            self.promises_hold()


_SETTINGS = settings(
    max_examples=40, stateful_step_count=12, deadline=None, derandomize=True, database=None,
    suppress_health_check=[HealthCheck.too_slow],
)  # fmt: skip
TestAnyWorld = AnyWorld.TestCase
TestAnyWorld.settings = _SETTINGS


@pytest.mark.parametrize("name", ["_check_safety", "_stop"])
def test_a_host_without_its_checks_or_its_stop_is_caught(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Negative control: a promise is broken, and found so."""
    monkeypatch.setattr(Session, name, lambda *_: None)
    found_only = settings(_SETTINGS, phases=[Phase.generate])
    with pytest.raises(AssertionError):
        run_state_machine_as_test(AnyWorld, settings=found_only)


def test_the_rules_do_move_the_robot() -> None:
    """So that the promises are about something: armed, under way, and at rest in the end."""
    machine = AnyWorld()
    machine.power_up(seed=1, law="pid", scenario="scenario-1", reset_s=None, early=0)
    machine.undisturbed(40)
    assert machine.rig.arming_acknowledged
    assert machine.rig.now_s() - machine.rig.moving_s < 0.1
    machine.let_go()
    assert not machine.rig.broken
    assert machine.session.ending.detail == "closed before its end"
