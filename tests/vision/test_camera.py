"""Camera model against OpenCV's projection and hand-calculated floor points."""

import math

import cv2
import numpy as np
import pytest

from vision.camera import CameraModel, look_at

DIST = (-0.27, 0.09, 0.0012, -0.0007, -0.01)


def ceiling(dist=(0.0,) * 5, height_m=3.0):
    """600 px focal length, straight down: 5 mm a pixel on the floor."""
    eye = (0.0, 0.0, height_m)
    return CameraModel(
        640, 480, 600.0, 600.0, 319.5, 239.5, dist, look_at(eye, (0, 0, 0)), np.array(eye)
    )


def oblique(dist=DIST):
    """Tilt a strong lens about 35 degrees, with unequal focal lengths."""
    eye = (0.4, -1.4, 2.0)
    return CameraModel(
        640, 480, 536.0, 539.0, 331.0, 236.0, dist, look_at(eye, (0, 0, 0)), np.array(eye)
    )


def floor_grid(z_m=0.0):
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, 9), np.linspace(-0.75, 0.75, 7))
    return np.column_stack((x.ravel(), y.ravel(), np.full(x.size, z_m)))


def test_projection_is_that_of_opencv():
    """Every floor point lands where cv2.projectPoints puts it."""
    camera = oblique()
    points = floor_grid(0.1)
    R_cam_world = camera.R_world_cam.T
    rvec, _ = cv2.Rodrigues(R_cam_world)
    tvec = -R_cam_world @ camera.t_world_cam_m
    expected, _ = cv2.projectPoints(points, rvec, tvec, camera.K, np.array(camera.dist))
    assert np.allclose(camera.project(points), expected.reshape(-1, 2), atol=1e-9)
    one = camera.project_point(*points[5])
    assert one == pytest.approx(tuple(expected.reshape(-1, 2)[5]), abs=1e-9)


def test_pixel_to_floor_undoes_the_projection_to_the_corners():
    """Corner pixels of a strong lens come back to 1e-9 px; cv2's default criteria leave more."""
    camera = oblique()
    u, v = np.meshgrid(np.linspace(0, 639, 9), np.linspace(0, 479, 7))
    px = np.column_stack((u.ravel(), v.ravel()))
    for height_m in (0.0, 0.1):
        floor = camera.floor_points(px, height_m)
        world = np.column_stack((floor, np.full(len(floor), height_m)))
        assert np.allclose(camera.project(world), px, atol=1e-9)
        assert camera.floor_point(*px[3], height_m) == pytest.approx(tuple(floor[3]), abs=1e-12)


def test_floor_points_by_hand():
    """Under 3 m of height and 600 px of focal length a pixel is 5 mm, X right and Y up."""
    camera = ceiling()
    assert camera.floor_point(319.5, 239.5) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert camera.floor_point(419.5, 239.5) == pytest.approx((0.5, 0.0), abs=1e-12)
    assert camera.floor_point(319.5, 139.5) == pytest.approx((0.0, 0.5), abs=1e-12)
    assert camera.floor_point(419.5, 239.5, 0.3) == pytest.approx((0.45, 0.0), abs=1e-12)


def test_a_mark_height_left_out_costs_its_share_of_the_distance():
    """A mark 0.1 m up and 1 m from the foot of a 3 m camera seems 34.5 mm too far: 0.1 * 1 / 2.9.

    This is the negative control of height correction; the error's size is by similar triangles.
    """
    camera = ceiling()
    px = camera.project_point(1.0, 0.0, 0.1)
    x_m, _ = camera.floor_point(*px, 0.0)
    assert x_m - 1.0 == pytest.approx(0.1 / 2.9, abs=1e-9)
    at_45_deg = math.hypot(*camera.lean(*camera.project_point(3.0, 0.0, 0.0)))
    assert at_45_deg == pytest.approx(1.0, abs=1e-9)


def test_jacobian_is_the_slope_of_floor_point():
    """The analytic m/px matrix agrees with central differences; 5 mm/px by hand at the ceiling."""
    assert np.allclose(ceiling().floor_jacobian(319.5, 239.5), np.diag([0.005, -0.005]))
    camera, step = oblique(), 1e-3
    for u, v in ((50.0, 60.0), (320.0, 240.0), (600.0, 430.0)):
        du = np.subtract(camera.floor_point(u + step, v, 0.1), camera.floor_point(u - step, v, 0.1))
        dv = np.subtract(camera.floor_point(u, v + step, 0.1), camera.floor_point(u, v - step, 0.1))
        numeric = np.stack((du, dv), axis=1) / (2 * step)
        assert np.allclose(camera.floor_jacobian(u, v, 0.1), numeric, rtol=1e-5, atol=1e-9)


def test_covariance_adds_pixel_noise_and_height_doubt():
    """At the foot of the camera only pixel noise counts; 1 m out a 3 mm height doubt adds 1 mm."""
    camera = ceiling()
    foot = camera.floor_covariance(319.5, 239.5, 0.0, 0.1, 0.003)
    assert np.allclose(foot, np.diag([0.0005**2, 0.0005**2]))
    out = camera.floor_covariance(*camera.project_point(1.0, 0.0, 0.0), 0.0, 0.0, 0.003)
    assert math.sqrt(out[0, 0]) == pytest.approx(0.001, abs=1e-9)


def test_no_answer_is_nan():
    """A ray that never meets the floor and a point behind the camera give NaN, not a number."""
    level = CameraModel(
        640, 480, 600.0, 600.0, 319.5, 239.5, (0.0,) * 5, look_at((0, 0, 1), (0, 5, 1)), (0, 0, 1)
    )
    assert all(map(math.isnan, level.floor_point(320.0, 10.0)))
    assert np.isnan(level.floor_points([(320.0, 10.0)])).all()
    assert all(map(math.isnan, level.project_point(0.0, -1.0, 1.0)))
    assert np.isnan(level.project([(0.0, -1.0, 1.0)])).all()


def test_another_resolution_sees_the_same_world():
    """Doubling the width doubles pixel distances; 16:9 rows are cut evenly from 4:3."""
    camera = oblique()
    big = camera.scaled(1280, 720)
    u, v = camera.project_point(0.3, 0.2, 0.1)
    expected = ((u + 0.5) * 2 - 0.5, (v + 0.5) * 2 - 0.5 - 120)
    assert big.project_point(0.3, 0.2, 0.1) == pytest.approx(expected, abs=1e-9)


def test_a_matrix_that_is_no_rotation_is_refused():
    """A scaled matrix in place of R raises at once."""
    with pytest.raises(ValueError, match="not a rotation"):
        CameraModel(640, 480, 1, 1, 0, 0, (0.0,) * 5, 2 * np.eye(3), np.zeros(3))
