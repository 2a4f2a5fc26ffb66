"""The extended Kalman filter by itself: [z1_x, z1_y, theta, k_d, k_t, d0] against hand calculations."""

import math

import numpy as np
import pytest

from hil.config.control import EstimatorConfig
from hil.control.estimators._fused import PoseFilter, wrap_pi
from hil.control.estimators.fused import Fused, assumptions
from hil.control.estimators.geometry import BelievedGeometry
from hil.core.types import Pose, PoseMeasurement
from hil.core.types import wrap_pi as wrap_pi_of_types

CONFIG = EstimatorConfig(
    sigma_scale=0.1, sigma_d0_m=0.01, slip_ratio=0.02, drift_m_s05=0.001, drift_rad_s05=0.002
)
D0_M = 0.03


def make():
    return PoseFilter(assumptions(CONFIG), D0_M)


def placed(x_m=0.0, y_m=0.0, theta_rad=0.0):
    filter_ = make()
    filter_.place(x_m, y_m, theta_rad, sigma_xy_m=0.002, sigma_theta_rad=0.05)
    return filter_


def test_before_a_pose_only_scales_and_offset_are_known():
    """k_d = k_t = 1 and d0 as believed, with their priors on the diagonal; the rest is zero."""
    filter_ = make()
    assert filter_.x == [0.0, 0.0, 0.0, 1.0, 1.0, D0_M]
    diagonal = [filter_.P[i][i] for i in range(6)]
    assert diagonal == pytest.approx([0.0, 0.0, 0.0, 0.01, 0.01, 1e-4])


def test_a_placed_point_carries_the_errors_of_heading_and_offset():
    """Facing +Y, z1 = X + d0 e_y: its x errs by -d0 dtheta, its y by dd0, both by the pose's own."""
    filter_ = placed(1.0, 2.0, math.pi / 2)
    assert filter_.x[:3] == pytest.approx([1.0, 2.0 + D0_M, math.pi / 2])
    P = filter_.P
    assert P[0][0] == pytest.approx(0.002**2 + (D0_M * 0.05) ** 2)
    assert P[1][1] == pytest.approx(0.002**2 + 0.01**2)
    assert P[0][2] == pytest.approx(-D0_M * 0.05**2)
    assert P[1][5] == pytest.approx(0.01**2)
    assert [list(column) for column in zip(*P, strict=True)] == P


def test_placed_anew_keeps_turns_and_knowledge_of_the_scales():
    """After 10 rad a pose at 10 - 4 pi is 10 rad again, and k_d keeps what was learned of it."""
    filter_ = placed(theta_rad=0.0)
    filter_.move(1.0, 0.0, 10.0, 0.0, 10.0)
    filter_.place(0.5, 0.0, 10.0 - 4 * math.pi, 0.001, 0.01)
    assert filter_.x[2] == pytest.approx(10.0)
    assert filter_.P[3][3] == pytest.approx(0.01)
    assert filter_.P[2][3] == filter_.P[0][3] == 0.0


def test_a_metre_straight_on_moves_the_point_and_spreads_it():
    """Along +X: 1 m of k_d's error ahead, 1 m of the heading's aside, and the random walks."""
    filter_ = placed()
    before = filter_.P
    filter_.move(2.0, 1.0, 0.0, 1.0, 0.0)
    assert filter_.x == pytest.approx([1.0 + D0_M, 0.0, 0.0, 1.0, 1.0, D0_M])
    walk = 0.02**2 * 1.0 + 0.001**2 * 2.0
    P = filter_.P
    assert P[0][0] == pytest.approx(before[0][0] + 0.1**2 + walk)
    # y errs by d0 dtheta + 1 m dtheta.
    assert P[1][1] == pytest.approx(0.002**2 + (1.0 + D0_M) ** 2 * 0.05**2 + walk)
    assert P[2][2] == pytest.approx(0.05**2 + 0.02**2 * 1.0 + 0.002**2 * 2.0)
    assert P[0][3] == pytest.approx(0.1**2)


def test_a_pose_is_weighed_by_its_variance():
    """Heading known to 0.05 rad and seen to 0.05 rad: half of the innovation, half of the variance."""
    filter_ = placed()
    seen = filter_.innovation(0.0, 0.0, 0.04)
    assert seen == pytest.approx((0.0, 0.0, 0.04))
    # Positions a metre uncertain say nothing.
    assert filter_.correct(seen, var_xy=1.0, var_theta=0.05**2, gate=16.3)
    assert filter_.x[2] == pytest.approx(0.02, rel=1e-3)
    assert filter_.P[2][2] == pytest.approx(0.5 * 0.05**2, rel=1e-3)


@pytest.mark.parametrize("bad", [(0.3, 0.0, 0.0), (math.nan, 0.0, 0.0), (0.0, 0.0, math.inf)])
def test_what_exceeds_the_gate_changes_nothing(bad):
    """0.3 m off at 3 mm of uncertainty is refused, and so is what is no number."""
    filter_ = placed()
    before = filter_.x, filter_.P
    assert not filter_.correct(bad, 1e-6, 1e-5, gate=16.3)
    assert (filter_.x, filter_.P) == before


def test_the_heading_is_compared_across_the_cut():
    """Believed at 3.1 rad and seen at -3.1 rad: 0.083 rad apart, not 6.2."""
    assert placed(theta_rad=3.1).innovation(0.0, 0.0, -3.1)[2] == pytest.approx(2 * math.pi - 6.2)


@pytest.mark.parametrize(
    "angle",
    [0.0, -0.0, 3.0, -3.0, 7.0, -7.0, 1e6, -1e6, 1e-320, -1e-320]
    + [
        math.nextafter(sign * turns * math.pi, towards)
        for sign in (1, -1)
        for turns in (1, 2, 3)
        for towards in (0.0, sign * turns * math.pi, sign * 20.0)
    ],
)
def test_angles_are_wrapped_as_everywhere_else(angle):
    """The same bits as hil.core.types.wrap_pi, right at the cut and one unit in the last place aside."""
    assert wrap_pi(angle).hex() == wrap_pi_of_types(angle).hex()


def test_an_angle_that_is_no_number_stays_none():
    """NaN and both infinities give NaN."""
    assert all(math.isnan(wrap_pi(angle)) for angle in (math.nan, math.inf, -math.inf))


def test_a_whole_covariance_is_the_textbook_update():
    """Errors of x, y and theta that go together: x + K y and (1 - K H) P of numpy, to 1e-12."""
    filter_ = placed(0.1, -0.2, 0.7)
    filter_.move(0.1, 0.03, 0.2, 0.03, 0.2)
    x, P = np.array(filter_.x), np.array(filter_.P)
    R = np.array([[4e-6, 1.5e-6, 2e-6], [1.5e-6, 2e-6, -1e-6], [2e-6, -1e-6, 9e-6]])
    theta, d0 = x[2], x[5]
    H = np.zeros((3, 6))
    H[0, 0] = H[1, 1] = H[2, 2] = 1.0
    H[0, 2], H[1, 2] = d0 * math.sin(theta), -d0 * math.cos(theta)
    H[0, 5], H[1, 5] = -math.cos(theta), -math.sin(theta)
    seen = np.array((0.002, -0.001, 0.01))
    gain = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
    excess = (R - np.diag((3e-6, 3e-6, 9e-6)))[np.triu_indices(3)]
    assert filter_.correct(tuple(seen), 3e-6, 9e-6, gate=16.3, excess=excess.tolist())
    assert np.abs(np.array(filter_.x) - (x + gain @ seen)).max() < 1e-12
    assert np.abs(np.array(filter_.P) - (np.eye(6) - gain @ H) @ P).max() < 1e-12


def test_an_estimator_believes_a_pose_across_the_blur_more_than_along_it():
    """A second pose 1 mm off in x and y, doubtful along x alone: y follows it, x hardly does."""
    fused = Fused(CONFIG, BelievedGeometry(0.0482, 0.2166, 0.03, 1920))
    sharp = (1e-7, 0.0, 0.0, 1e-7, 0.0, 1e-5)
    long_in_x = (4e-6, 0.0, 0.0, 1e-8, 0.0, 1e-5)
    for t_s, at_m, claim in ((0.0, 0.0, sharp), (0.03, 1e-3, long_in_x)):
        sigma_xy_m = math.sqrt(0.5 * (claim[0] + claim[3]))
        seen = PoseMeasurement(
            Pose(at_m, at_m, 0.0), 1.0, "", sigma_xy_m, math.sqrt(claim[5]), covariance=claim
        )
        fused.on_pose(t_s, seen)
    pose = fused.estimate_at(0.04).pose
    assert pose.x_m < 0.3e-3
    assert pose.y_m > 0.8e-3
