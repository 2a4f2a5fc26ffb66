"""A served twin that is held up: the run goes on, in virtual time."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from hil.config.load import load_scenario
from hil.core.rig import Frame
from hil.record.reader import RunRecord
from hil.rigs.opening import open_rig
from hil.runs.execute import RunSpec, execute_in_memory
from hil.tools.serve_twin import FollowedClock
from sim_twin.twin import Twin

HELD_UP_S = 0.3


class HeldUp:
    """A twin as a host meets it through a server that is held up once, for HELD_UP_S.

    Meanwhile the host's clock goes on and nothing comes; what the host sends waits. With `stamps_slip`
    the camera's clock stands still with the twin's.
    """

    def __init__(self, twin: Twin, at_s: float, stamps_slip: bool) -> None:
        self._twin = twin
        self._at_s = at_s
        self._stamps_slip = stamps_slip
        self._clock = FollowedClock(0.0)
        self._start_s = float("inf")
        self._host_s: float | None = None  # while the server is held up
        self._waiting: list[bytes] = []
        self.stream = self
        self.truth, self.close = twin.truth, twin.close

    def now_s(self) -> float:
        """Return the host's clock."""
        return self._host_s or self._twin.now_s() - self._clock.ahead_s

    def begin(self, t_start_s: float) -> None:
        """Let the instant count from here."""
        self._start_s = t_start_s
        self._twin.begin(t_start_s)

    def wait(self, until_s: float) -> None:
        """Let time pass; the twin's only while its server runs."""
        now_s, end_s = self.now_s(), self._start_s + self._at_s + HELD_UP_S
        if self._host_s is None and now_s >= end_s - HELD_UP_S and not self._clock.slipped_s:
            self._host_s = now_s
        if self._host_s is None:
            self._twin.wait(until_s + self._clock.ahead_s)
        elif until_s < end_s:
            self._host_s = max(self._host_s, until_s)
        else:
            self._host_s = None
            self._twin.wait(self._clock.follow(end_s, self._twin.now_s()))
            for data in self._waiting:
                self._twin.stream.write(data)

    def read(self) -> bytes:
        """Return what has come."""
        return self._twin.stream.read() if self._host_s is None else b""

    def write(self, data: bytes) -> None:
        """Send, or let it wait."""
        if self._host_s is None:
            self._twin.stream.write(data)
        else:
            self._waiting.append(data)

    def poll_frame(self) -> Frame | None:
        """Return the next frame as the server stamps it."""
        frame = self._twin.poll_frame() if self._host_s is None else None
        return frame if frame is None or self._stamps_slip else self._clock.stamped(frame)


def runs(stamps_slip: bool) -> list[RunRecord]:
    """Return runs of two scenarios under both laws, held up at instants that are drawn."""
    rng = random.Random(7)
    found = []
    for seed in range(1, 9):
        at_s = rng.uniform(0.0, 2.0)
        scenario = load_scenario(f"scenario-{1 + seed % 2}", [f"duration_s={at_s + 2.0:.2f}"])
        twin = open_rig("twin", scenario, "pose", seed)
        assert isinstance(twin, Twin)
        law = ("pid", "asg-ism")[seed // 2 % 2]
        spec = RunSpec(scenario, "twin", "pose", law, "asg-ism", seed, Path())
        found.append(execute_in_memory(spec, HeldUp(twin, at_s, stamps_slip)))
    return found


def test_a_run_goes_on_after_its_twins_server_was_held_up() -> None:
    """Poses are believed again in time; the board's clock, which did stand still, is tied anew."""
    records = runs(stamps_slip=False)
    assert [record.manifest.outcome_detail for record in records] == [""] * 8
    for record in records:
        t_s, believed = record.samples["t_s"], record.samples["pose_accepted"] > 0.0
        assert max(b - a for a, b in zip(t_s[believed], t_s[believed][1:], strict=False)) < 0.65
        assert believed[-30:].sum() > 15  # not every tick has a frame of its own


def test_frames_that_look_late_by_what_was_missed_end_runs() -> None:
    """The same without the server's stamps: what is tested above is needed."""
    said = [record.manifest.outcome_detail for record in runs(stamps_slip=True)]
    assert any(text.startswith("camera and wheels disagree") for text in said)


def test_a_clock_that_is_followed_slips_by_what_was_missed() -> None:
    """Behind by 0.05 s it catches up; by 0.4 s it is put back by all but the 1 ms of a step."""
    clock = FollowedClock(ahead_s=100.0)
    assert clock.follow(5.05, 105.0) == pytest.approx(105.05)
    assert (clock.slipped_s, clock.worst_lag_s) == (0.0, pytest.approx(0.05))
    frame = Frame(0, 7.0, None)
    assert clock.stamped(frame) is frame
    assert clock.follow(5.4, 105.0) == pytest.approx(105.001)
    assert clock.slipped_s == pytest.approx(0.399)
    assert clock.worst_lag_s == pytest.approx(0.4)
    assert clock.follow(5.401, 105.001) == pytest.approx(105.002)
    assert clock.stamped(frame).t_cam_s == pytest.approx(7.399)
