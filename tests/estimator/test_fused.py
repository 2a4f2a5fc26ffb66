"""The default estimator: delay, mismatch, gating, lost signals."""

import math
import time

import pytest

from hil.config.control import EstimatorConfig
from hil.config.load import load_robot
from hil.control.estimators.geometry import BelievedGeometry
from hil.control.estimators.making import make_estimator
from hil.core.errors import BadInput
from hil.core.types import Pose, PoseMeasurement, WheelSample
from tests.estimator.world import LAG_S, TRUE, Conditions, World

USUAL = Conditions()
CONFIG = EstimatorConfig(wheel_lag_s=LAG_S)
# The host believes 10 % less radius and d0, and 10 % more track, than is true: turns are 22 % off.
WRONG = BelievedGeometry(
    TRUE.wheel_radius_m / 1.1, TRUE.track_width_m / 0.9, TRUE.d0_m / 1.1, TRUE.counts_per_turn
)


def weave(t):
    """Return a lively motion: speed and turn rate both change all the time."""
    return 0.25 + 0.15 * math.sin(1.7 * t), 1.2 * math.sin(1.1 * t)


def make(believed=TRUE, conditions=USUAL, config=CONFIG, **k):
    estimator = make_estimator("fused", config, believed)
    return estimator, World(estimator, believed, conditions, **k)


def position_errors(moments):
    return [
        math.hypot(m.estimate.z1_m[0] - m.x, m.estimate.z1_m[1] - m.y)
        for m in moments
        if m.estimate
    ]


def test_exact_sensors_and_geometry_leave_only_quantisation():
    """Despite 60 ms camera and 20 ms link delay the state at the effect time is right."""
    _, world = make(conditions=Conditions(exact=True))
    late = world.run(8.0, weave)[60:]
    # One encoder count is 0.158 mm of wheel path; speed noise from it is a few mm/s.
    assert max(position_errors(late)) < 0.002
    assert max(abs(m.estimate.pose.theta_rad - m.theta) for m in late) < 0.004
    assert max(abs(m.estimate.eta1_m_s - m.eta1) for m in late) < 0.01
    assert max(abs(m.estimate.theta_dot_rad_s - m.w) for m in late) < 0.10


def test_ignoring_the_delay_would_be_seen(monkeypatch):
    """Negative control: poses taken as of their arrival are off by delay times speed."""
    estimator, world = make(conditions=Conditions(exact=True))
    right = estimator.on_pose
    monkeypatch.setattr(estimator, "on_pose", lambda t, m: right(t + 0.06, m))
    late = world.run(6.0, lambda _: (0.4, 0.0))[60:]
    assert max(position_errors(late)) > 0.015


def test_scales_absorb_ten_percent_of_radius_and_track():
    """k_d tends to 1.1 and k_t to 1.1/0.9, and the prediction is as good as with the true robot."""
    estimator, world = make(WRONG)
    late = world.run(15.0, weave)[300:]
    k_d, k_t = estimator.scales
    assert k_d == pytest.approx(1.1, abs=0.015)
    assert k_t == pytest.approx(1.1 / 0.9, abs=0.02)
    errors = position_errors(late)
    assert math.sqrt(sum(e * e for e in errors) / len(errors)) < 0.003


def test_offset_of_the_flat_output_is_found_in_turns():
    """10 % of d0 would be 3 mm of z1 for good; after some turning it is below 1 mm."""
    estimator, world = make(WRONG)
    world.run(10.0, weave)
    assert estimator.d0_m == pytest.approx(TRUE.d0_m, abs=0.001)
    at_rest = world.run(4.0, lambda _: (0.0, 0.0))[60:]
    assert max(position_errors(at_rest)) < 0.0012


def test_driving_straight_says_nothing_about_the_offset():
    """Without a turn d0 stays as believed, and its uncertainty as it was."""
    estimator, world = make(WRONG, Conditions(exact=True))
    world.run(5.0, lambda _: (0.2, 0.0))
    assert estimator.d0_m == pytest.approx(WRONG.d0_m, abs=2e-4)
    assert estimator.covariance[5][5] > 0.8 * CONFIG.sigma_d0_m**2


def test_estimate_of_a_resting_robot_is_quieter_than_the_camera():
    """At rest the wheels say so, and a second of poses averages out: no limit cycle from noise."""
    _, world = make()
    world.run(3.0, lambda _: (0.0, 0.0))
    late = world.run(5.0, lambda _: (0.0, 0.0))
    xs = [m.estimate.z1_m[0] for m in late]
    mean = sum(xs) / len(xs)
    assert math.sqrt(sum((x - mean) ** 2 for x in xs) / len(xs)) < 0.5e-3
    assert max(abs(m.estimate.eta1_m_s) for m in late) < 1e-3


def test_covariance_is_consistent_with_the_errors():
    """Normalised squared position errors average near 2 (two axes), not ten times off."""
    estimator, world = make()
    squares = []

    def collect(moment):
        if moment.estimate and moment.t_s > 3.0:
            P = estimator.covariance
            ex, ey = moment.estimate.z1_m[0] - moment.x, moment.estimate.z1_m[1] - moment.y
            squares.append(ex * ex / P[0][0] + ey * ey / P[1][1])

    world.run(12.0, weave, collect)
    assert 0.2 < sum(squares) / len(squares) < 8.0


def test_an_implausible_pose_is_gated_and_changes_nothing():
    """One pose 0.3 m off (marks swapped with a reflection) moves the estimate by nothing."""
    estimator, world = make(conditions=Conditions(exact=True))
    world.run(3.0, weave)
    before = estimator.estimate_at(world.t)
    wrong = PoseMeasurement(Pose(before.pose.x_m + 0.3, before.pose.y_m, 0.0), 1.0)
    estimator.on_pose(world.t - 0.005, wrong)
    after = estimator.estimate_at(world.t)
    assert estimator.gated_total == 1
    assert after.z1_m == pytest.approx(before.z1_m, abs=1e-3)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_pose_without_a_number_is_gated(bad):
    """Whichever of X, Y, theta it is, nothing of it reaches the estimate."""
    estimator, world = make()
    world.run(1.0, weave)
    for k, pose in enumerate((Pose(bad, 0.0, 0.0), Pose(0.0, bad, 0.0), Pose(0.0, 0.0, bad))):
        estimator.on_pose(world.t - 0.005 + 0.001 * k, PoseMeasurement(pose, 1.0))
    assert estimator.gated_total == 3
    assert math.isfinite(sum(estimator.estimate_at(world.t).z1_m))
    late = world.run(1.0, weave)
    assert position_errors(late)[-1] < 0.005


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_first_pose_without_a_number_is_gated(bad):
    """Whether pose or time, the estimator waits for the next one and starts there."""
    estimator, world = make()
    estimator.on_pose(world.t, PoseMeasurement(Pose(bad, 0.0, 0.0), 1.0))
    estimator.on_pose(math.nan, PoseMeasurement(Pose(0.0, 0.0, 0.0), 1.0))
    assert estimator.estimate_at(world.t) is None
    late = world.run(1.0, weave)
    assert position_errors(late)[-1] < 0.005


def test_a_count_beyond_32_bits_is_refused():
    """The board's counters are int32: a value that none can have is the caller's mistake."""
    estimator, _ = make()
    with pytest.raises(TypeError):
        estimator.on_wheels(WheelSample(0.0, 1 << 31, 0, 0.0, 0.0))


def test_a_moved_robot_is_found_again():
    """Lifted and put down 0.3 m away: after five agreeing poses the estimate is there."""
    estimator, world = make()
    world.run(3.0, lambda _: (0.1, 0.0))
    world.z[0] += 0.3
    world.z[2] += 0.8
    late = world.run(1.0, lambda _: (0.1, 0.0))
    assert 4 <= estimator.gated_total <= 6
    assert position_errors(late)[-1] < 0.005


def test_scattered_wrong_poses_are_never_believed():
    """Wrong poses that disagree with each other do not add up to a recovery."""
    estimator, world = make()
    world.run(3.0, lambda _: (0.0, 0.0))
    before = estimator.estimate_at(world.t)
    for k in range(40):
        jump = 0.3 + 0.1 * (k % 3)
        wrong = PoseMeasurement(Pose(before.pose.x_m + jump, before.pose.y_m, 0.0), 1.0)
        estimator.on_pose(world.t - 0.03 + k / 30, wrong)
    assert estimator.gated_total == 40
    assert estimator.estimate_at(world.t + 1.3).z1_m == pytest.approx(before.z1_m, abs=2e-3)


def test_lost_camera_is_bridged_by_the_wheels_and_its_age_is_told():
    """One second without a pose at 0.4 m/s: the error stays in the millimetres."""
    estimator, world = make(WRONG)
    world.run(12.0, weave)
    world.camera_on = False
    late = world.run(1.0, weave)
    assert 0.9 < estimator.pose_age_s(world.t) < 1.2
    assert position_errors(late)[-1] < 0.015


def test_lost_wheel_reports_are_bridged_by_the_commands():
    """Reports missing for 0.2 s: command history and lag model carry the state."""
    _, world = make()
    world.run(4.0, weave)
    world.link_on = False
    world.run(0.2, weave)
    world.link_on = True
    late = world.run(1.0, weave)
    assert max(position_errors(late)) < 0.008


def test_restarted_board_is_noticed():
    """Counters that fall to zero are not taken for motion."""
    estimator, world = make()
    world.run(4.0, lambda _: (0.3, 0.0))
    world.board_restarts_at = world.t
    late = world.run(1.0, lambda _: (0.3, 0.0))
    assert position_errors(late)[-1] < 0.005
    assert estimator.gated_total == 0


@pytest.mark.parametrize(("counts", "gap_s"), [(1000, 0.02), (5000, 0.3), (15_000, 0.5)])
def test_a_restarted_counter_is_no_travel(counts, gap_s):
    """A board that was reset counts from 0: no wheel turns back so far in that time."""
    estimator = make_estimator("fused", CONFIG, TRUE)
    estimator.on_pose(0.0, PoseMeasurement(Pose(0.0, 0.0, 0.0), 1.0))
    for k in range(5):
        estimator.on_wheels(WheelSample(0.01 + 0.02 * k, counts, counts, 0.0, 0.0))
    estimator.on_wheels(WheelSample(0.09 + gap_s, 0, 0, 0.0, 0.0))
    after = estimator.estimate_at(0.09 + gap_s)
    assert abs(after.pose.x_m) < 1e-3
    assert abs(after.eta1_m_s) < 0.01


def test_the_fastest_motors_are_no_restart():
    """At the no-load speed of the robot's motors every report counts, half a second apart or not."""
    geometry = BelievedGeometry.of(load_robot("thesis-4wd"))
    estimator = make_estimator("fused", CONFIG, geometry)
    estimator.on_pose(0.0, PoseMeasurement(Pose(0.0, 0.0, 0.0), 1.0))
    omega_rad_s = load_robot("thesis-4wd").no_load_rad_s
    for t in (0.001, 0.021, 0.041, 0.541):
        count = round(omega_rad_s * t / geometry.rad_per_count)
        estimator.on_wheels(WheelSample(t, count, count, 0.0, 0.0))
    travelled_m = omega_rad_s * 0.54 * geometry.wheel_radius_m
    assert estimator.estimate_at(0.541).pose.x_m == pytest.approx(travelled_m, rel=0.01)


def straight_after(turn_s):
    """Turn on the spot for a while, then drive; the gap in the poses begins at 4 s."""
    return lambda t: (0.0, 2.5) if 4.0 <= t < 4.0 + turn_s else (0.4, 0.0)


@pytest.mark.parametrize(
    ("motion", "gap_s"),
    [
        (lambda t: (0.4, 2.5 if t < 4.33 else -2.5), 0.65),
        (straight_after(0.33), 0.65),
        (straight_after(0.15), 0.3),
        (lambda _: (0.3, 2.0), 0.65),
        (lambda t: (0.4 if t < 4.3 else -0.4, 2.0), 0.6),
    ],
)
def test_the_first_pose_after_a_gap_makes_nothing_worse(motion, gap_s):
    """Perfect wheels and poses: whatever was driven unseen, the pose is believed and changes little."""
    geometry = BelievedGeometry(0.0482, 0.2166, 0.03, 2_000_000)
    estimator = make_estimator("fused", EstimatorConfig(), geometry)
    x = y = theta = left = right = 0.0
    unit = geometry.rad_per_count
    believed = []
    for k in range(5000):
        t = 0.001 * k
        if k % 20 == 0:
            sample = WheelSample(t, round(left / unit), round(right / unit), 0.0, 0.0)
            estimator.on_wheels(sample)
        if k % 33 == 7 and not 4.0 <= t < 4.0 + gap_s:
            off = [math.dist(e.z1_m, (x, y)) for e in [estimator.estimate_at(t)] if e]
            seen = Pose(
                x - 0.03 * math.cos(theta),
                y - 0.03 * math.sin(theta),
                math.remainder(theta, math.tau),
            )
            believed.append(estimator.on_pose(t, PoseMeasurement(seen, 1.0, "", 6e-5, 7.4e-4)))
            if t > 4.0:
                after = math.dist(estimator.estimate_at(t).z1_m, (x, y))
                assert after < max(off[0], 5e-5)
        v, w = motion(t)
        middle = theta + 0.0005 * w
        x, y, theta = (
            x + 0.001 * v * math.cos(middle),
            y + 0.001 * v * math.sin(middle),
            theta + 0.001 * w,
        )
        d_left, d_right = geometry.wheels(0.001 * v, 0.001 * w)
        left, right = left + d_left, right + d_right
    assert all(believed)
    assert estimator.gated_total == 0
    assert estimator.scales[0] == pytest.approx(1.0, abs=3e-3)


@pytest.mark.parametrize("speed_m_s", [0.8, 1.5])
def test_a_robot_that_slides_is_followed(speed_m_s):
    """Carried off sideways faster than any two poses lie close: the estimate goes along with it."""
    estimator, world = make(conditions=Conditions(exact=True))
    world.run(3.0, lambda _: (0.1, 0.0))
    start_s = world.t
    apart = []

    def slide(moment):
        world.jump = (0.0, speed_m_s * (world.t - start_s), 0.0)
        apart.append(
            abs(
                moment.estimate.pose.y_m
                - (moment.y - 0.03 * math.sin(moment.theta))
                - world.jump[1]
            )
        )

    world.run(0.8, lambda _: (0.1, 0.0), slide)
    # What is seen is 60 ms old, a frame 33 ms and a tick as much; without it 0.8 s times the speed.
    assert max(apart[-8:]) < 0.14 * speed_m_s
    assert estimator.agreement_age_s(world.t) > 0.7


def test_poses_believed_are_told_from_those_refused():
    """`on_pose` says so, and `refused` by how much the last one was off."""
    estimator, world = make(conditions=Conditions(exact=True))
    world.run(2.0, lambda _: (0.0, 0.0))
    here = estimator.estimate_at(world.t).pose
    assert not estimator.on_pose(world.t, PoseMeasurement(Pose(here.x_m + 0.3, here.y_m, 0.3), 1.0))
    assert estimator.refused[:2] == pytest.approx((0.3, 0.0), abs=2e-3)
    assert estimator.on_pose(world.t + 0.03, PoseMeasurement(here, 1.0))
    assert estimator.agreement_age_s(world.t + 0.03) == 0.0
    assert not estimator.on_pose(world.t, PoseMeasurement(here, 1.0))  # older than the last one


def test_nothing_is_said_before_the_first_pose():
    """Wheel reports alone give no estimate; the age of the pose is infinite."""
    estimator = make_estimator("fused", CONFIG, TRUE)
    estimator.on_wheels(WheelSample(0.0, 0, 0, 0.0, 0.0))
    estimator.on_wheels(WheelSample(0.02, 5, 5, 0.0, 0.0))
    assert estimator.estimate_at(0.05) is None
    assert estimator.pose_age_s(0.05) == math.inf
    estimator.on_pose(0.01, PoseMeasurement(None, 0.0, "not seen"))
    assert estimator.estimate_at(0.05) is None


def test_heading_is_unwrapped_over_several_turns():
    """Turning on the spot for three turns, theta passes 2 pi each time without a jump."""
    _, world = make()
    moments = world.run(10.0, lambda _: (0.0, 2.0))
    assert moments[-1].theta > 5 * math.pi
    assert max(abs(m.estimate.pose.theta_rad - m.theta) for m in moments[10:]) < 0.05


def test_same_inputs_give_the_same_estimates():
    """The estimator is a pure function of its inputs."""
    runs = [make(WRONG)[1].run(2.0, weave) for _ in range(2)]
    assert [m.estimate for m in runs[0]] == [m.estimate for m in runs[1]]


def test_a_tick_is_cheap():
    """One pose, two reports, one estimate, one command: well under a millisecond."""
    estimator, world = make()
    world.run(1.0, weave)
    best = math.inf
    for k in range(200):
        t = world.t + k / 30
        begin = time.perf_counter()
        for half in (0, 1):
            estimator.on_wheels(WheelSample(t + half / 60, 0, 0, 0.0, 0.0))
        estimator.on_pose(t - 0.05, PoseMeasurement(Pose(0.0, 0.0, 0.0), 1.0))
        estimator.estimate_at(t + 0.02)
        estimator.on_command(t + 0.02, 0.0, 0.0)
        best = min(best, time.perf_counter() - begin)
    assert best < 500e-6


def test_unknown_estimator_is_refused_by_name():
    """The message names the value and the choice."""
    with pytest.raises(BadInput, match=r"'magic'.*camera-only, fused"):
        make_estimator("magic", CONFIG, TRUE)


def test_a_time_just_passed_is_answered_from_the_path():
    """Asked for the last exposure itself, the estimate is where the robot was then."""
    estimator, world = make(conditions=Conditions(exact=True))
    track = []
    world.run(4.0, lambda _: (0.4, 0.5), lambda m: track.append((m.t_s, m.x, m.y)))
    t, x, y = track[-2]  # about 40 ms ago, after the anchor
    here = estimator.estimate_at(t)
    assert math.hypot(here.z1_m[0] - x, here.z1_m[1] - y) < 0.003
    ahead = estimator.estimate_at(world.t + 0.02)
    assert math.hypot(ahead.z1_m[0] - x, ahead.z1_m[1] - y) > 0.015
