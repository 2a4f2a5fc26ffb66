"""The rig as the host meets it: clock, arrivals, faults, determinism, with the real firmware core."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hil.config.camera import CameraConfig, MarkConfig, MarksConfig
from hil.config.events import Disturbance, Fault
from hil.config.link import LinkConfig
from hil.core.errors import RigFault
from hil.core.types import Pose, wrap_pi
from hil.wire import dialect
from sim_twin.twin import HOST_START_S, Twin, TwinSetup
from tests.twin.rigs import Drive, armed, first, robot

SAFE = dialect.HIL_STATE_SAFE


def twin(maker=None, **changes):
    values = {
        "robot": robot(), "link": LinkConfig(), "camera": CameraConfig(),
        "start": Pose(0.1, -0.2, 0.3), "seed": 1,
    }  # fmt: skip
    return Twin(TwinSetup(**(values | changes)), maker)


class Sketches:
    """A frame maker that keeps what it was asked for."""

    def __init__(self):
        self.asked = []

    def make(self, index, poses):
        self.asked.append((index, list(poses)))
        return np.zeros((2, 2, 3), np.uint8)

    draw = make


# -- clock and arrivals ------------------------------------------------------------------------


def test_wait_ends_exactly_when_asked_or_with_an_arrival():
    """Nothing arrives early on: the clock is the wanted time to the bit; later frames end it."""
    rig = twin()
    until = rig.now_s() + 1e-3 / 3
    rig.wait(until)
    assert rig.now_s() == until
    begin = rig.now_s()
    rig.wait(begin + 10.0)
    assert begin < rig.now_s() < begin + 1.0
    assert rig.stream.read() or rig.poll_frame()
    rig.wait(rig.now_s())  # no time to pass: returns at once


def test_truth_is_the_start_pose_while_the_board_is_not_armed():
    """At rest nothing moves, and the flat output lies d0 ahead of the centre (2.35)."""
    rig = twin()
    for _ in range(50):
        rig.wait(rig.now_s() + 0.02)
    truth = rig.truth()
    assert truth.pose == Pose(0.1, -0.2, 0.3)
    assert truth.eta1_m_s == truth.theta_dot_rad_s == 0.0
    d0 = robot().d0_m
    assert truth.z1_m == pytest.approx((0.1 + d0 * math.cos(0.3), -0.2 + d0 * math.sin(0.3)))


def test_frames_are_drawn_only_when_taken():
    """Two seconds without taking a frame draw nothing; then each is drawn once, from five poses."""
    maker = Sketches()
    rig = twin(maker)
    while rig.now_s() < HOST_START_S + 2.0:
        rig.wait(HOST_START_S + 2.0)
    assert maker.asked == []
    taken = [frame.index for frame in iter(rig.poll_frame, None)]
    assert taken == [index for index, _ in maker.asked]
    assert len(taken) > 50
    assert all(poses == [(0.1, -0.2, 0.3)] * 5 for _, poses in maker.asked)


def test_poses_over_an_exposure_follow_the_motion():
    """At 0.5 m/s the five poses of one exposure lie 0.75 mm apart, along the heading."""
    maker = Sketches()
    drive = armed(maker=maker)
    drive.run(1.5, 10.0, 10.0)
    list(iter(drive.twin.poll_frame, None))
    speed = drive.twin.truth().eta1_m_s
    assert speed == pytest.approx(0.482, rel=0.1)
    steps = np.diff(np.array(maker.asked[-1][1])[:, 0])
    assert steps == pytest.approx(np.full(4, speed * 0.006 / 4), rel=0.02)


def test_poses_between_samples_are_interpolated():
    """pose_at half way between two milliseconds is their mean to a micrometre; outside: refused."""
    drive = armed()
    drive.run(1.0, 10.0, 8.0)
    kernel = drive.twin._kernel
    t_us = kernel.time_us // 1000 * 1000 - 200_000
    before, middle, after = (kernel.pose_at(t_us + dt) for dt in (0, 500, 1000))
    assert after[0] > before[0] + 2e-4
    assert middle == pytest.approx([(a + b) / 2 for a, b in zip(before, after, strict=True)])
    assert kernel.pose_at(kernel.time_us) == kernel.state()[:3]
    for outside in (kernel.time_us + 100.0, -1.0):
        with pytest.raises(IndexError):
            kernel.pose_at(outside)


def test_board_clock_drifts_by_the_robots_figure():
    """200 ppm fast in the robot file: TIMESYNC finds the host 200 ppm slow, and some offset."""
    drive = Drive()
    drive.run(20.0, 0.0, 0.0, speak=False)
    assert drive.link.clock.drift_ratio == pytest.approx(-200e-6, abs=20e-6)


def test_link_delays_what_the_serial_line_and_the_radio_delay():
    """57,600 baud and 20 +- 10 ms each way: the round trip lies between 40 and 80 ms."""
    drive = Drive(link=LinkConfig())
    drive.run(5.0, 0.0, 0.0, speak=False)
    assert 0.025 < drive.link.clock.rtt_s < 0.080


# -- drive -------------------------------------------------------------------------------------


def test_forward_is_forward_from_bytes_to_counts():
    """Equal set-points: PWM, counts, speeds and X rise, heading stays (bytes, core and robot)."""
    drive = armed()
    last = drive.run(2.0, 5.0, 5.0)[-1].wire
    assert last.left_counts > 300
    assert last.right_counts > 300
    assert last.omega_left_rad_s == pytest.approx(5.0, abs=1.0)
    assert drive.twin.truth().pose.x_m > 0.2
    assert abs(drive.twin.truth().pose.theta_rad) < 0.02


def test_left_turn_has_the_right_wheel_faster():
    """Set-points -4 and 4 rad/s: right counts rise, left fall, theta rises, nothing else moves."""
    drive = armed()
    last = drive.run(2.0, -4.0, 4.0)[-1].wire
    assert last.right_counts > 300 > -300 > last.left_counts
    truth = drive.twin.truth()
    assert truth.pose.theta_rad > 1.0
    assert truth.theta_dot_rad_s > 0.5


def test_counts_are_the_wheel_angle_in_steps_of_a_1920th_turn():
    """Board counts equal those of the true wheel angle when the robot stands."""
    drive = armed()
    drive.run(1.0, 6.0, 3.0)
    last = drive.run(1.0, 0.0, 0.0)[-1].wire
    assert (last.left_counts, last.right_counts) == drive.twin._kernel.true_counts
    left_rad = drive.twin._kernel.state()[8]
    assert last.left_counts == round(left_rad * 1920 / (2 * math.pi))


# -- determinism -------------------------------------------------------------------------------


def journey(seed, **changes):
    """Everything a host can see of three seconds, as one value."""
    drive = armed(
        seed=seed,
        link=LinkConfig(loss_ratio=0.05, corruption_ratio=0.001),
        disturbances=(
            Disturbance(target="force_left_n", shape="noise", amplitude=1.0, frequency_hz=3.0),
        ),
        **changes,
    )
    drive.run(3.0, 6.0, 3.0)
    frames = [(f.index, f.t_cam_s, f.pose) for f in iter(drive.twin.poll_frame, None)]
    wires = [str(report.wire) for report in drive.reports]
    return drive.twin.truth(), drive.twin._kernel.state(), wires, frames


def test_the_same_seed_gives_the_same_run_bit_for_bit():
    """State, telemetry and frames repeat exactly; another seed gives another run."""
    once = journey(1)
    assert once == journey(1)
    other = journey(2)
    assert once[1] != other[1]
    assert once[3] != other[3]


# -- faults and disturbances --------------------------------------------------------------------


def fault(kind, start_s=0.5, end_s=None, side="both"):
    return (Fault(kind=kind, side=side, start_s=start_s, end_s=end_s),)


def test_dead_encoder_stops_the_counts_of_its_side():
    """From half a second on the left count stands while the wheels turn on."""
    drive = armed(faults=fault("dead_encoder", side="left"))
    drive.run(0.6, 5.0, 5.0)
    counts = [(r.wire.left_counts, r.wire.right_counts) for r in drive.run(0.3, 5.0, 5.0)]
    assert counts[-1][0] == counts[2][0]
    assert counts[-1][1] > counts[2][1] + 50


@pytest.mark.parametrize("kind", ["dead_channel_a", "dead_channel_b"])
def test_dead_channel_freezes_the_count_within_one(kind):
    """One channel alone counts up and down on the spot."""
    drive = armed(faults=fault(kind, side="right"))
    drive.run(0.6, 5.0, 5.0)
    counts = [r.wire.right_counts for r in drive.run(0.3, 5.0, 5.0)]
    assert max(counts) - min(counts) <= 1
    assert drive.twin._kernel.state()[11] > 1.0


def test_swapped_phases_count_against_the_motion():
    """Wired wrongly from power-up: the wheel runs away forward and the count falls."""
    drive = armed(faults=fault("swapped_phases", start_s=0.0, side="left"))
    last = drive.run(0.3, 3.0, 3.0)[-1].wire
    assert drive.twin._kernel.true_counts[0] > 5
    assert last.left_counts < -5
    assert last.right_counts > 5


def test_reversed_motor_turns_against_its_pwm():
    """Left polarity exchanged: positive PWM, falling counts."""
    drive = armed(faults=fault("motor_reversed", start_s=0.0, side="left"))
    wire = first(drive.run(0.5, 5.0, 5.0), lambda w: w.pwm_left_counts > 100)
    assert wire is not None
    assert drive.twin._kernel.true_counts[0] < -5


def test_stuck_motor_stands_against_full_drive():
    """A jammed side turns below 0.15 rad/s whatever the board does; the other one is free."""
    drive = armed(faults=fault("motor_stuck", start_s=0.0, side="right"))
    drive.run(1.0, 5.0, 5.0)
    state = drive.twin._kernel.state()
    assert abs(state[11]) < 0.15
    assert abs(state[10]) > 1.0


def test_board_reset_stops_the_wheels_and_clears_the_board():
    """Held in reset for 0.3 s: silent, PWM off; afterwards disarmed with counts from zero."""
    drive = armed(faults=fault("board_reset", start_s=0.5, end_s=0.8))
    drive.run(0.45, 5.0, 5.0)
    assert drive.reports[-1].wire.left_counts > 50
    silent = drive.run(0.3, 5.0, 5.0)
    assert len(silent) <= 4
    assert drive.twin._kernel.duty == (0.0, 0.0)
    after = drive.run(0.5, 0.0, 0.0)[-1].wire
    assert after.state == dialect.HIL_STATE_DISARMED
    assert after.left_counts < 20
    assert after.t_mcu_us < 1_000_000


def test_a_cut_link_stops_the_robot_within_the_time_out_and_some_braking():
    """Set-points lost from 1 s on: PWM is off 250 ms later, the robot stands, the board is SAFE."""
    drive = armed(faults=fault("link_cut", start_s=1.0, end_s=2.0))
    drive.run(1.0, 5.0, 5.0)
    assert drive.twin.truth().eta1_m_s > 0.1
    assert drive.run(0.3, 5.0, 5.0) == [] or drive.twin._kernel.duty == (0.0, 0.0)
    assert drive.twin._kernel.duty == (0.0, 0.0)
    drive.run(0.5, 5.0, 5.0)
    assert abs(drive.twin.truth().eta1_m_s) < 0.01
    assert first(drive.run(1.0, 5.0, 5.0), lambda w: w.state == SAFE) is not None


def test_a_silent_host_stops_the_robot_too():
    """No cut, no set-point: the board's own time-out ends the motion."""
    drive = armed()
    drive.run(1.0, 5.0, 5.0)
    drive.run(0.6, 0.0, 0.0, speak=False)
    assert drive.twin._kernel.duty == (0.0, 0.0)
    assert drive.reports[-1].wire.state == SAFE


def test_stalled_camera_gives_no_frames_and_hidden_robot_is_not_seen():
    """During a stall no frame comes; during an occlusion frames come without the robot."""
    stalled = armed(faults=fault("camera_stall", start_s=0.2, end_s=1.2))
    stalled.run(1.2, 0.0, 0.0)
    assert len(list(iter(stalled.twin.poll_frame, None))) < 15
    hidden = armed(faults=fault("camera_occluded", start_s=0.0))
    hidden.run(0.5, 0.0, 0.0)
    frames = list(iter(hidden.twin.poll_frame, None))
    assert len(frames) > 10
    assert all(f.pose.pose is None and "hidden" in f.pose.reason for f in frames)
    maker = Sketches()
    hidden = armed(faults=fault("camera_occluded", start_s=0.0), maker=maker)
    list(iter(hidden.twin.poll_frame, None))  # of before
    before = len(maker.asked)
    hidden.run(0.5, 0.0, 0.0)
    list(iter(hidden.twin.poll_frame, None))
    assert len(maker.asked) > before + 10
    assert all(poses == [] for _, poses in maker.asked[before:])


def test_exchanged_marks_show_the_robot_turned_round():
    """Marks at +9 and -7 cm exchanged: heading off by half a turn, place by 2 cm ahead."""
    red, green = (0.07, 0.06, 0.62), (0.12, 0.42, 0.08)
    marks = MarksConfig(
        front=MarkConfig(colour=red, x_m=0.09), rear=MarkConfig(colour=green, x_m=-0.07),
        swapped_marks=True,
    )  # fmt: skip
    rig = twin(camera=CameraConfig(marks=marks), start=Pose(0.0, 0.0, 0.0))
    while (frame := rig.poll_frame()) is None or frame.pose.pose is None:
        rig.wait(rig.now_s() + 0.1)
    assert abs(wrap_pi(frame.pose.pose.theta_rad - math.pi)) < 0.02
    assert frame.pose.pose.x_m == pytest.approx(0.02, abs=0.002)


def test_disturbances_count_from_the_begin_of_the_run():
    """A push at 0.5 s of the run is not felt before `begin`, nor before 0.5 s after it."""
    push = Disturbance(target="force_forward_n", shape="step", amplitude=20.0, start_s=0.5)
    drive = Drive(disturbances=(push,))
    drive.run(1.0, 0.0, 0.0, speak=False)
    assert drive.twin.truth().pose.x_m == 0.0
    drive.twin.begin(drive.twin.now_s())
    drive.run(0.4, 0.0, 0.0, speak=False)
    assert drive.twin.truth().pose.x_m == 0.0
    drive.run(1.0, 0.0, 0.0, speak=False)
    assert drive.twin.truth().pose.x_m > 0.01


def test_drawn_poses_of_a_robot_at_rest():
    """Over 3,000 frames half the variance stands still, hardly one unseen, outliers rare."""
    rig = twin(camera=CameraConfig(rate_hz=200.0, exposure_s=0.002, drop_ratio=0.0))
    while rig.now_s() < HOST_START_S + 15.2:
        rig.wait(HOST_START_S + 20.0)
    seen = [f.pose.pose for f in iter(rig.poll_frame, None)]
    errors = np.array([(p.x_m - 0.1, p.y_m + 0.2, p.theta_rad - 0.3) for p in seen if p])
    good = errors[np.hypot(errors[:, 0], errors[:, 1]) < 0.002]
    fresh = math.sqrt(0.5)
    assert good.std(axis=0)[:2] == pytest.approx(fresh * 0.000057, rel=0.05)
    assert good.std(axis=0)[2] == pytest.approx(fresh * 0.00074, rel=0.05)
    assert np.abs(good.mean(axis=0) / (0.000057, 0.000057, 0.00074)).max() > 0.2
    assert seen.count(None) < 8  # 1.5 expected
    assert len(good) > 0.99 * len(errors)


def test_a_robot_the_integrator_cannot_follow_is_a_rig_fault():
    """Motor and gear far stiffer than the step can follow end the run with one line."""
    wild = robot(
        motor_gear_ratio=500.0, motor_rotor_inertia_kg_m2=0.0,
        motor_torque_constant_n_m_a=1.0, motor_emf_constant_v_s_rad=1.0,
    )  # fmt: skip
    push = Disturbance(target="force_forward_n", shape="step", amplitude=20.0)
    drive = armed(config=wild, disturbances=(push,))
    with pytest.raises(RigFault, match="diverges"):
        drive.run(1.0, 5.0, 5.0)
