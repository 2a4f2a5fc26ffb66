"""The thesis's variant: super-twisting on the camera alone."""

import math

import pytest

from hil.config.control import EstimatorConfig
from hil.control.estimators.making import make_estimator
from hil.core.types import Pose, PoseMeasurement
from tests.estimator.world import TRUE, Conditions, World


def test_velocity_and_acceleration_converge_on_a_clean_motion():
    """On a circle of 0.3 m at 0.8 rad/s, z2 and z3 come near the truth without any wheel report."""
    estimator = make_estimator("camera-only", EstimatorConfig(), TRUE)
    for k in range(300):
        a = 0.8 * k / 30
        theta = a + math.pi / 2
        c, s = math.cos(theta), math.sin(theta)
        pose = Pose(0.3 * math.cos(a) - 0.03 * c, 0.3 * math.sin(a) - 0.03 * s, theta)
        estimator.on_pose(k / 30, PoseMeasurement(pose, 1.0))
    here = estimator.estimate_at(299 / 30)
    assert here.eta1_m_s == pytest.approx(0.24, abs=0.02)
    assert here.theta_dot_rad_s == pytest.approx(0.8, abs=0.1)
    assert here.z2_m_s == pytest.approx((-0.24 * math.sin(a), 0.24 * math.cos(a)), abs=0.03)
    assert here.z3_m_s2 == pytest.approx((-0.192 * math.cos(a), -0.192 * math.sin(a)), abs=0.12)


def test_state_is_carried_over_the_delay():
    """At a constant 0.3 m/s the 80 ms from exposure to effect are bridged to a few mm."""
    estimator = make_estimator("camera-only", EstimatorConfig(), TRUE)
    world = World(estimator, TRUE, Conditions(exact=True))
    late = world.run(6.0, lambda _: (0.3, 0.0))[100:]
    assert max(math.hypot(m.estimate.z1_m[0] - m.x, m.estimate.z1_m[1] - m.y) for m in late) < 0.005


def test_a_gap_restarts_the_differentiators():
    """A robot that reappears elsewhere after a second has no speed from the jump."""
    estimator = make_estimator("camera-only", EstimatorConfig(), TRUE)
    for k in range(60):
        estimator.on_pose(k / 30, PoseMeasurement(Pose(0.0, 0.0, 0.0), 1.0))
    estimator.on_pose(4.0, PoseMeasurement(Pose(1.0, 0.0, 0.0), 1.0))
    assert estimator.estimate_at(4.0).z2_m_s == pytest.approx((0.0, 0.0))
    assert estimator.pose_age_s(4.5) == pytest.approx(0.5)
