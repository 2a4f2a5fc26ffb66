"""Rolling shutter: what it does to a pose, and that the correction takes it away."""

import math

import numpy as np

from hil.core.types import Estimate, Pose
from tests.vision.scenes import DEFAULT, errors, localiser, rendered
from vision.rolling import unrolled

LINE_S = 30e-6
ROLLING = DEFAULT.model_copy(update={"line_time_s": LINE_S})
SPEED_M_S, TURN_RAD_S = 0.5, 1.5


def frame(middle, index):
    """Return a frame of a robot that drives and turns; `middle` is its pose when the middle row is."""
    whole_s = DEFAULT.exposure_s + LINE_S * (DEFAULT.height_px - 1)
    poses = []
    for t in np.linspace(-0.5 * whole_s, 0.5 * whole_s, 17):
        theta = middle.theta_rad + 0.5 * TURN_RAD_S * t
        poses.append((
            middle.x_m + SPEED_M_S * t * math.cos(theta), middle.y_m + SPEED_M_S * t * math.sin(theta),
            middle.theta_rad + TURN_RAD_S * t,
        ))  # fmt: skip
    return rendered(ROLLING).make(index, poses)


def moving(pose):
    """Return the true state; the flat output is taken to be the centre of mass."""
    speed = (SPEED_M_S * math.cos(pose.theta_rad), SPEED_M_S * math.sin(pose.theta_rad))
    return Estimate(0.0, pose, SPEED_M_S, TURN_RAD_S, (pose.x_m, pose.y_m), speed)


def test_the_correction_takes_a_rolling_shutter_away():
    """30 us a row, 0.5 m/s, 1.5 rad/s: 1.3 mm without it, a fifth of that or less with it."""
    places = [(-0.55, 0.3, 0.4), (0.5, -0.3, 1.6), (0.1, 0.4, -1.2), (-0.4, -0.35, 2.8)]
    before, after, turned, righted = [], [], [], []
    for index, (x, y, theta) in enumerate(places):
        truth = Pose(x, y, theta)
        seen = localiser(ROLLING).locate(frame(truth, index), truth, 0.06)
        assert seen.pose is not None, seen.reason
        right = unrolled(seen, ROLLING, moving(truth))
        for pose, off, turn in ((seen.pose, before, turned), (right.pose, after, righted)):
            dx, dy, dtheta = errors(pose, truth)
            off.append(math.hypot(dx, dy))
            turn.append(abs(dtheta))
    assert np.sqrt(np.mean(np.square(before))) > 1e-3
    assert np.sqrt(np.mean(np.square(after))) < 0.3e-3
    assert np.max(turned) > 4e-3
    assert np.max(righted) < 2e-3


def test_nothing_is_changed_where_nothing_is_known():
    """No line time, no state, no pose: the same object comes back."""
    truth = Pose(0.1, 0.1, 0.3)
    seen = localiser(DEFAULT).locate(frame(truth, 0), truth, 0.06)
    assert unrolled(seen, DEFAULT, moving(truth)) is seen
    assert unrolled(seen, ROLLING, None) is seen
    lost = localiser(DEFAULT).locate(np.zeros((480, 640, 3), np.uint8), None, 0.06)
    assert unrolled(lost, ROLLING, moving(truth)) is lost
