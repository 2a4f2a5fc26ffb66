"""Faults of link, pictures, clocks, gears and host: what each does, and that it does nothing before."""

from __future__ import annotations

import math
from random import Random

import numpy as np
import pytest
from pydantic import ValidationError

from hil.config.camera import CameraConfig
from hil.config.events import OF_PICTURES, Fault
from hil.config.link import LinkConfig
from hil.core.errors import BadInput
from hil.core.rig import whole
from hil.core.types import Pose
from sim_twin.camera_faults import FaultyMaker, covered_front
from sim_twin.camera_sim import RenderedCamera
from sim_twin.host_faults import HostFaults
from sim_twin.link_model import Channel
from sim_twin.twin import Twin, TwinSetup
from tests.twin.rigs import FAST_LINK, Drive, armed, robot

CAMERA = CameraConfig()
POSES = ((0.1, 0.0, 0.3), (0.1, 0.0, 0.3))


def one(kind: str, **fields: object) -> Fault:
    """Return a fault of one second, half a second after the begin."""
    return Fault.model_validate({"kind": kind, "start_s": 0.5, "end_s": 1.5} | fields)


# -- robot -----------------------------------------------------------------------------------------


def test_a_slipping_gear_turns_the_encoder_more_than_the_wheel() -> None:
    """At 0.4 of the turn the motor makes 2.5 turns for one; the other side, and earlier turns, one."""
    drive = armed(faults=(one("gear_slip", side="left", end_s=None),))
    before = drive.run(0.45, 5.0, 5.0)[-1].wire
    wheels = drive.twin._kernel.state()
    assert before.left_counts == pytest.approx(wheels[8] * 1920 / (2 * math.pi), abs=40)
    drive.run(0.6, 5.0, 5.0)
    begin, begin_rad = drive.reports[-1].wire, drive.twin._kernel.state()[8:10]
    end = drive.run(0.5, 5.0, 5.0)[-1].wire
    end_rad = drive.twin._kernel.state()[8:10]
    turned = [(b - a) * 1920 / (2 * math.pi) for a, b in zip(begin_rad, end_rad, strict=True)]
    assert (end.left_counts - begin.left_counts) / turned[0] == pytest.approx(2.5, rel=0.05)
    assert (end.right_counts - begin.right_counts) / turned[1] == pytest.approx(1.0, rel=0.02)


def test_noise_on_an_encoders_wires_is_seen_as_what_no_wheel_does() -> None:
    """Both channels at once change level a thousand times a second: illegal, and no count."""
    drive = armed(faults=(one("encoder_noise", side="left"),))
    drive.run(0.45, 0.0, 0.0)
    assert drive.link.state_name == "ARMED"
    drive.run(0.3, 0.0, 0.0)
    assert drive.link.state_name == "SAFE (ENCODER)"
    assert drive.reports[-1].wire.left_counts == 0


# -- link ------------------------------------------------------------------------------------------


def channel() -> Channel:
    return Channel(LinkConfig(latency_s=0.01, latency_jitter_s=0.0), Random(1))


def test_chunks_are_doubled_within_the_span_only() -> None:
    line = channel()
    line.doubles = [(1.0, 2.0)]
    sent = [line.carry(t_s, b"ab") for t_s in (0.9, 1.1, 2.0)]
    assert [data for _, data in filter(None, sent)] == [b"ab", b"abab", b"ab"]


def test_of_two_chunks_the_second_arrives_first_and_none_is_lost() -> None:
    line = channel()
    line.swaps = [(1.0, 2.0)]
    times_s = (0.9, 1.1, 1.2, 1.9, 2.1)
    sent = [
        line.carry(t_s, data)
        for t_s, data in zip(times_s, (b"a", b"b", b"c", b"d", b"e"), strict=True)
    ]
    assert [one and one[1] for one in sent] == [b"a", None, b"cb", None, b"ed"]


@pytest.mark.parametrize(
    ("kind", "state", "hears"),
    [("link_down_cut", "SAFE (SETPOINT_TIMEOUT)", True), ("link_up_cut", "ARMED", False)],
)
def test_half_open_is_one_way_only(kind: str, state: str, hears: bool) -> None:
    """The board that hears nothing stops and says so; the host that hears nothing goes on speaking."""
    drive = armed(faults=(one(kind, end_s=None),))
    drive.run(0.5, 3.0, 3.0)
    heard = drive.run(0.6, 3.0, 3.0)
    assert drive.link.state_name == state
    assert (len(heard) > 20) is hears


# -- pictures --------------------------------------------------------------------------------------


def picture(fault: Fault, t_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a frame as it should be, and as it is at `t_s` after the begin."""
    maker = RenderedCamera(CAMERA, 1)
    faulty = FaultyMaker(maker, (fault,), lambda: RenderedCamera(covered_front(CAMERA), 1))
    faulty.begin(lambda f: (f.start_s, math.inf if f.end_s is None else f.end_s))
    return maker.make(7, POSES), whole(faulty.make(t_s, 7, POSES))


@pytest.mark.parametrize("kind", OF_PICTURES)
def test_a_picture_is_as_ever_before_and_after_its_fault(kind: str) -> None:
    for t_s in (0.4, 1.5):
        good, seen = picture(one(kind), t_s)
        assert np.array_equal(good, seen)
    good, seen = picture(one(kind, y_m=0.3), 1.0)
    assert not np.array_equal(good, seen)


def test_exposure_and_colours_are_those_of_every_pixel() -> None:
    """Three times the light saturates at 255; an exchange of colours is one of channels."""
    good, bright = picture(one("camera_exposure"), 1.0)
    assert np.array_equal(bright, np.minimum(3 * good.astype(int), 255))
    good, exchanged = picture(one("camera_colours"), 1.0)
    assert np.array_equal(exchanged, good[:, :, ::-1])


def test_a_covered_mark_and_a_second_robot_change_their_place_only() -> None:
    """The mark's few hundred pixels go; a second robot is another one where it stands, whole."""
    good, covered = picture(one("camera_mark_covered"), 1.0)
    changed = np.any(good != covered, axis=2)
    assert 50 < changed.sum() < 2000
    good, both = picture(one("camera_second_robot", x_m=0.1, y_m=-0.4), 1.0)
    alone = RenderedCamera(CAMERA, 1).make(7, ((0.1, -0.4, 0.0), (0.1, -0.4, 0.0)))
    empty = RenderedCamera(CAMERA, 1).make(7, ())
    there = np.any(alone != empty, axis=2)
    assert np.array_equal(both[there], alone[there])
    assert np.array_equal(both[~there], good[~there])


def test_drawn_poses_have_no_picture_to_spoil() -> None:
    """Refused where the rig is made, with what to take instead."""
    setup = TwinSetup(
        robot(), FAST_LINK, CAMERA, Pose(0.0, 0.0, 0.0), 1, (), (one("camera_colours"),)
    )
    with pytest.raises(BadInput, match=r"camera_colours is a fault of pictures.*--camera rendered"):
        Twin(setup)


@pytest.mark.parametrize("step_s", [5.0, -5.0])
def test_stamps_step_with_the_cameras_clock(step_s: float) -> None:
    """By so much, while the fault is there; frames come on as ever."""
    plain, stepped = Drive(), Drive(faults=(one("camera_clock_step", step_s=step_s),))
    for drive in (plain, stepped):
        drive.twin.begin(drive.twin.now_s())
        drive.run(2.0, 0.0, 0.0, speak=False)
    pairs = zip(iter(plain.twin.poll_frame, None), iter(stepped.twin.poll_frame, None), strict=True)
    steps = [round(b.t_cam_s - a.t_cam_s, 9) for a, b in pairs]
    assert set(steps) == {0.0, step_s}
    assert steps.count(step_s) == pytest.approx(30, abs=1)


# -- host ------------------------------------------------------------------------------------------


def host(fault: Fault) -> HostFaults:
    faults = HostFaults((fault,))
    faults.begin(lambda f: (f.start_s, math.inf if f.end_s is None else f.end_s))
    return faults


def test_when_a_host_runs() -> None:
    """Stopped, it runs at the end; overloaded, on the next multiple; else at once."""
    assert [host(one("host_stopped")).runs_at_s(t) for t in (0.4, 0.5, 1.2, 1.5)] == [
        0.4,
        1.5,
        1.5,
        1.5,
    ]
    slow = host(one("host_overloaded", late_s=0.2))
    assert [slow.runs_at_s(t) for t in (0.45, 0.5, 0.55, 1.45)] == pytest.approx(
        [0.45, 0.5, 0.7, 1.5]
    )


def test_a_hosts_clock_that_steps_is_waited_for_by_the_worlds() -> None:
    """A wait ends at the step, and past it counts from the clock as it is then."""
    clock = host(one("host_clock_step", step_s=5.0))
    assert [clock.step_s(t) for t in (0.4, 0.5, 1.4, 1.5)] == [0.0, 5.0, 5.0, 0.0]
    assert clock.world_s(0.45, 0.4) == 0.45
    assert clock.world_s(0.8, 0.4) == 0.5
    assert clock.world_s(6.0, 0.6) == 1.0


def test_the_world_goes_on_while_the_host_does_not() -> None:
    """A second of reports waits for a host that was stopped, and its board has stopped the wheels."""
    drive = armed(faults=(one("host_stopped"),))
    begin_s = drive.twin.now_s()
    drive.run(0.5, 5.0, 5.0)
    drive.run(0.1, 5.0, 5.0)
    assert drive.twin.now_s() > begin_s + 1.5
    waited = [report for report in drive.reports if report.t_arrival_s > begin_s + 1.4]
    assert len(waited) == pytest.approx(54, abs=6)
    assert drive.link.state_name == "SAFE (SETPOINT_TIMEOUT)"


@pytest.mark.parametrize("fields", [{"end_s": None}, {"start_s": 0.0}])
def test_a_host_that_never_goes_on_is_no_fault_of_a_run(fields: dict[str, float | None]) -> None:
    with pytest.raises(ValidationError, match="host_stopped needs end_s"):
        one("host_stopped", **fields)
