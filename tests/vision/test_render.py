"""The renderer: its geometry against OpenCV's, its noise, its memory of earlier frames."""

import cv2
import numpy as np
import pytest

from hil.config.camera import CameraConfig, RobotLookConfig, SceneConfig
from sim_twin import camera_sim
from sim_twin.camera_sim import RenderedCamera
from tests.vision.scenes import DEFAULT, rendered

POSE = (0.3, -0.2, 0.7)


def opencv_pixels(camera, points):
    """Return where cv2.projectPoints has world points, from eye and target by hand."""
    eye, target = np.array(camera.pose.eye_m), np.array(camera.pose.target_m)
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    R_cam_world = np.stack((right, np.cross(ahead, right), ahead))
    lens = camera.lens
    K = np.array([[lens.fx_px, 0, lens.cx_px], [0, lens.fy_px, lens.cy_px], [0, 0, 1]])
    dist = np.array([lens.k1, lens.k2, lens.p1, lens.p2, lens.k3])
    px, _ = cv2.projectPoints(points, cv2.Rodrigues(R_cam_world)[0], -R_cam_world @ eye, K, dist)
    return px.reshape(-1, 2)


@pytest.mark.parametrize("pose", [POSE, (-0.7, 0.4, -2.0), (0.6, -0.4, 3.0)])
def test_marks_are_drawn_where_opencv_projects_them(pose):
    """The centroid of each mark's colour is that of its disc projected by OpenCV, to 0.05 px.

    Nothing of vision/camera is used: axes from eye and target, lens by cv2.projectPoints.
    """
    scene = SceneConfig(gradient_ratio=0.0, read_noise_dn=0.0, full_well_e=1e9)
    camera = CameraConfig(scene=scene)
    image = rendered(camera).make(0, [pose] * 2).astype(float)
    x, y, theta = pose
    angles = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    for ahead_m, channel in ((0.08, 2), (-0.08, 1)):
        rim = np.zeros((400, 3))
        rim[:, 0] = x + ahead_m * np.cos(theta) + 0.03 * np.cos(angles)
        rim[:, 1] = y + ahead_m * np.sin(theta) + 0.03 * np.sin(angles)
        rim[:, 2] = 0.10
        outline = opencv_pixels(camera, rim).astype(np.float32)
        moments = cv2.moments(outline)
        expected = np.array((moments["m10"], moments["m01"])) / moments["m00"]
        u, v = (expected - 12).astype(int)
        part = image[v : v + 26, u : u + 26]
        others = part[..., [c for c in range(3) if c != channel]].max(axis=2)
        excess = np.clip(part[..., channel] - others - 15.0, 0.0, None)
        rows, columns = np.mgrid[v : v + 26, u : u + 26]
        seen = np.array((np.sum(excess * columns), np.sum(excess * rows))) / excess.sum()
        assert seen == pytest.approx(expected, abs=0.05)


def test_a_frame_depends_on_its_arguments_alone():
    """The same index and poses give the same bytes whatever was drawn before; another index not."""
    poses = [(0.3, -0.2, 0.70), (0.301, -0.2, 0.71)]
    camera = rendered()
    first = camera.make(5, poses)
    camera.make(6, [POSE] * 2)
    camera.make(7, ())
    assert np.array_equal(camera.make(5, poses), first)
    assert not np.array_equal(camera.make(8, poses), first)
    assert not np.array_equal(rendered(seed=2).make(5, poses), first)


def test_noise_is_what_the_sensor_makes():
    """Variance of a pixel over frames: read noise^2 + signal * DN per electron + rounding 1/12."""
    frames = np.stack([rendered().make(i, ())[::4] for i in range(40)]).astype(np.float32)
    mean, variance = frames.mean(axis=0), frames.var(axis=0, ddof=1)
    scene = DEFAULT.scene
    expected = scene.read_noise_dn**2 + mean * 255.0 / scene.full_well_e + 1.0 / 12.0
    assert float((variance / expected).mean()) == pytest.approx(1.0, abs=0.02)


def test_motion_blur_is_as_long_as_the_way():
    """A mark that moves 8.5 px at even speed spreads by 8.5^2 / 12 px^2 along its way.

    The exposure is drawn in eight parts, which lack 1/64 of that.
    """
    # Nothing but the front mark is red here, so the red channel is its coverage.
    black = (0.0, 0.0, 0.0)
    look = RobotLookConfig(
        plate_colour=black, board_colour=black, side_colour=black, tyre_colour=black,
        hub_colour=black,
    )  # fmt: skip
    scene = SceneConfig(
        gradient_ratio=0.0, read_noise_dn=0.0, full_well_e=1e9, floor_colour=(0.3, 0.3, 0.0)
    )
    camera = rendered(CameraConfig(scene=scene, robot_look=look))
    half_m = 0.015
    places = np.array([[0.08 - half_m, 0, 0.1], [0.08 + half_m, 0, 0.1]])
    (u0, v0), (u1, _) = opencv_pixels(DEFAULT, places)
    rows = slice(int(v0) - 12, int(v0) + 13)
    columns = np.arange(int(u0) - 15, int(u1) + 16)

    def spread_px2(image):
        red = image[rows, columns, 2].sum(axis=0, dtype=float)
        mean = np.sum(red * columns) / red.sum()
        return np.sum(red * (columns - mean) ** 2) / red.sum()

    still = spread_px2(camera.make(0, [(0.0, 0.0, 0.0)] * 2))
    moved = spread_px2(camera.make(0, [(-half_m, 0.0, 0.0), (half_m, 0.0, 0.0)]))
    expected = (u1 - u0) ** 2 / 12.0 * (1.0 - 1.0 / 64.0)
    assert moved - still == pytest.approx(expected, rel=0.08)


def test_shade_lies_beside_the_robot_and_nowhere_else():
    """The floor darkens next to the robot; beyond 0.4 m the frame is the empty floor's."""
    empty, full = rendered().make(3, ()), rendered().make(3, [(0.0, 0.0, 0.0)] * 2)
    changed = np.any(empty != full, axis=2)
    centre = opencv_pixels(DEFAULT, np.zeros((1, 3)))[0]
    v, u = np.nonzero(changed)
    assert np.hypot(u - centre[0], v - centre[1]).max() < 0.4 / 0.0034
    beside = opencv_pixels(DEFAULT, np.array([[0.0, -0.15, 0.0]]))[0].round().astype(int)
    at = np.s_[beside[1] - 2 : beside[1] + 3, beside[0] - 2 : beside[0] + 3]
    assert full[at].mean() < 0.9 * empty[at].mean()


def test_a_camera_drawn_again_is_that_of_a_renderer_of_its_own():
    """Scene and lines of sight are kept from run to run: whatever was drawn before, frames are the same.

    Other seeds and poses before, and another camera between, change nothing; another seed does.
    """
    other = CameraConfig(scene=SceneConfig(gradient_ratio=0.3))
    poses = [POSE, (0.301, -0.2, 0.71)]
    wanted = {}
    for camera in (DEFAULT, other):
        camera_sim._kept.clear()
        wanted[camera is other] = RenderedCamera(camera, 5).make(3, poses)
    camera_sim._kept.clear()
    for camera in (DEFAULT, DEFAULT, other, DEFAULT):
        RenderedCamera(camera, 6).make(0, [(0.0, 0.0, 0.0)] * 2)
        again = RenderedCamera(camera, 5).make(3, poses)
        np.testing.assert_array_equal(again, wanted[camera is other])
    assert (RenderedCamera(DEFAULT, 6).make(3, poses) != wanted[False]).any()
    assert len(camera_sim._kept) == 1


def test_a_frame_that_is_held_is_not_drawn_over():
    """Memory of frames is used again only when nobody holds the frame any more."""
    camera = RenderedCamera(DEFAULT, 1)
    held = [camera.make(index, [POSE] * 2) for index in range(6)]
    before = [frame.copy() for frame in held]
    part = camera.make(6, [POSE] * 2)[100:200, 100:200]
    kept = part.copy()
    for index in range(7, 20):
        camera.make(index, [(-0.3, 0.2, 0.1)] * 2)
    for frame, copy in zip((*held, part), (*before, kept), strict=True):
        np.testing.assert_array_equal(frame, copy)
