"""What the rendered camera shows of lens, light, clutter and tag, against OpenCV and by hand."""

import math

import cv2
import numpy as np
import pytest

from hil.config.camera import (
    BarConfig,
    CameraConfig,
    CameraPoseConfig,
    ClutterConfig,
    GlareConfig,
    LensConfig,
    MarksConfig,
    RobotLookConfig,
    SceneConfig,
    ShadowEdgeConfig,
    TagConfig,
)
from hil.core.errors import BadInput
from sim_twin import _native
from sim_twin.camera_sim import RenderedCamera, _view
from vision.camera_setup import camera_model

GREY = (0.4, 0.4, 0.4)
# No colour but that of the marks, no noise: what remains is geometry.
QUIET = SceneConfig(
    floor_colour=GREY,
    texture_ratio=0.0,
    tile_m=9.0,
    gradient_ratio=0.0,
    read_noise_dn=0.0,
    full_well_e=1e9,
    blur_px=0.5,
)
PLAIN = RobotLookConfig(hub_colour=GREY, side_colour=(0.1,) * 3, tyre_colour=(0.06,) * 3)
LEVELLED = CameraPoseConfig(eye_m=(0.0, 0.0, 2.2), target_m=(0.0, 0.0, 0.0))


def still(x, y, theta):
    return [(x, y, theta), (x, y, theta)]


def redness(image):
    """Return red over the mean of blue and green, none below zero: red things alone."""
    b, g, r = (image[..., k].astype(float) for k in range(3))
    red = r - 0.5 * (b + g)
    return np.where(red > 1.5, red, 0.0)  # a step of rounding is no colour


def centroid(weight):
    v, u = np.mgrid[0 : weight.shape[0], 0 : weight.shape[1]]
    return np.array([(weight * u).sum(), (weight * v).sum()]) / weight.sum()


def projected(config, points):
    """Return pixels of world points by OpenCV."""
    lens, model = config.lens, camera_model(config)
    rotation = model.R_world_cam.T
    px, _ = cv2.projectPoints(
        np.asarray(points, dtype=float),
        cv2.Rodrigues(rotation)[0],
        -rotation @ model.t_world_cam_m,
        model.K,
        np.array([lens.k1, lens.k2, lens.p1, lens.p2, lens.k3]),
    )
    return px.reshape(-1, 2)


def disc_image_centroid(config, x, y):
    """Return the centroid of the image of a mark's disc about world (x, y), by OpenCV's polygon."""
    angles = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    radius = 0.5 * config.marks.diameter_m
    rim = np.column_stack(
        (
            x + radius * np.cos(angles),
            y + radius * np.sin(angles),
            np.full(400, config.marks.height_m),
        )
    )
    moments = cv2.moments(projected(config, rim).astype(np.float32).reshape(-1, 1, 2))
    return np.array([moments["m10"], moments["m01"]]) / moments["m00"]


def test_the_renderers_lens_is_that_of_opencv():
    """The lens written in C++ puts world points where cv2.projectPoints does, to 1e-6 px."""
    config = CameraConfig()
    points = [(x, y, z) for x in (-1.0, 0.2, 0.9) for y in (-0.7, 0.7) for z in (0.0, 0.1)]
    mine = [_native.project(_view(config), *p) for p in points]
    assert np.allclose(mine, projected(config, points), atol=1e-6)


def test_floor_map_is_the_inverse_of_opencvs_projection():
    """Projecting each pixel's floor point by OpenCV gives the pixel back, corners included."""
    config = CameraConfig()
    floor = np.asarray(_native.floor_map(_view(config)))
    for u, v in ((0, 0), (639, 0), (0, 479), (639, 479), (200, 300)):
        px = projected(config, [(*floor[v, u], 0.0)])[0]
        assert px == pytest.approx((u, v), abs=1e-3)


def test_motion_blur_spreads_a_mark_by_the_way_driven():
    """Over 20 mm of way the centroid stays at the middle and variance grows by way^2 / 12."""
    config = CameraConfig(scene=QUIET, robot_look=PLAIN, pose=LEVELLED)
    camera = RenderedCamera(config, 1)
    way_m = 0.02
    poses = [(way_m * (i / 8 - 0.5), 0.0, 0.0) for i in range(9)]
    sharp, blurred = redness(camera.make(0, still(0, 0, 0))), redness(camera.make(0, poses))
    assert np.hypot(*(centroid(sharp) - centroid(blurred))) < 0.05
    u = np.arange(640)

    def variance(weight):
        along = weight.sum(axis=0)
        return (along * (u - (along * u).sum() / along.sum()) ** 2).sum() / along.sum()

    # 620 px focal length over 2.1 m to the marks: 0.02 m is 5.905 px.
    assert variance(blurred) - variance(sharp) == pytest.approx(5.905**2 / 12.0, rel=0.06)


def test_a_moving_robots_noise_is_that_of_the_still_scene():
    """Pixels the robot covers carry the same noise law as the background."""
    scene = QUIET.model_copy(update={"read_noise_dn": 3.0})
    camera = RenderedCamera(CameraConfig(scene=scene, pose=LEVELLED), 3)
    u, v = np.round(projected(CameraConfig(pose=LEVELLED), [(0.08, 0.0, 0.1)])[0]).astype(int)
    frames = [camera.make(i, still(0, 0, 0))[v - 3 : v + 4, u - 3 : u + 4] for i in range(200)]
    assert np.stack(frames).astype(float).var(axis=0).mean() == pytest.approx(9.08, rel=0.05)


def test_shadow_glare_and_gradient_change_the_light_as_stated():
    """Half the light left of a shadow edge, a lamp's DN added at its spot, a share lost across."""
    base = (
        RenderedCamera(CameraConfig(scene=QUIET, robot_look=PLAIN, pose=LEVELLED), 1)
        .make(0, [])
        .astype(float)
    )

    def ratio(**changes):
        scene = QUIET.model_copy(update=changes)
        frame = RenderedCamera(CameraConfig(scene=scene, pose=LEVELLED), 1).make(0, [])
        return frame.astype(float).mean(axis=2) / base.mean(axis=2)

    shadow = ratio(shadow_edge=ShadowEdgeConfig(azimuth_rad=0.0, depth_ratio=0.5))
    assert shadow[100, 320] == pytest.approx(0.5, abs=0.01), "+Y, left of +X, lies in shade"
    assert shadow[400, 320] == pytest.approx(1.0, abs=0.01)
    bright = ratio(glare=GlareConfig(x_m=0.0, y_m=0.0, radius_m=0.05, peak_dn=50.0))
    u, v = np.round(projected(CameraConfig(pose=LEVELLED), [(0.0, 0.0, 0.0)])[0]).astype(int)
    assert (bright[v, u] - 1.0) * base[v, u].mean() == pytest.approx(50.0, abs=1.5)
    across = ratio(gradient_ratio=0.4, gradient_azimuth_rad=0.0)
    assert across[240, 0] == pytest.approx(0.6, abs=0.01)
    assert across[240, 639] == pytest.approx(1.0, abs=0.01)


def test_things_on_the_floor_stand_where_they_are_put():
    """A red disc on the floor shows at its projection, and the robot above it hides it."""
    config = CameraConfig(scene=QUIET, robot_look=PLAIN, pose=LEVELLED)
    thing = ClutterConfig(x_m=0.3, y_m=-0.2, size_m=(0.05, 0.05), colour=(0.07, 0.06, 0.62))
    scene = QUIET.model_copy(update={"clutter": (thing,)})
    camera = RenderedCamera(config.model_copy(update={"scene": scene}), 1)
    at = projected(config, [(0.3, -0.2, 0.0)])[0]
    assert np.hypot(*(centroid(redness(camera.make(0, []))) - at)) < 0.1
    u, v = np.round(at).astype(int)
    hidden = redness(camera.make(0, still(0.3, -0.2, 0.0)))[v - 4 : v + 5, u - 4 : u + 5]
    assert hidden.sum() == 0.0


def test_a_bar_covers_the_mark_below_it():
    """A cable that rides over the front mark takes its share of the mark's area, dark on red."""
    bar = BarConfig(frame="body", start_m=(0.08, -0.1), end_m=(0.08, 0.1), width_m=0.012,
                    height_m=0.101)  # fmt: skip
    free = RenderedCamera(CameraConfig(scene=QUIET, robot_look=PLAIN, pose=LEVELLED), 1)
    covered = RenderedCamera(
        CameraConfig(
            scene=QUIET.model_copy(update={"bars": (bar,)}), robot_look=PLAIN, pose=LEVELLED
        ),
        1,
    )
    pose = still(0.0, 0.0, 0.5)
    left = redness(covered.make(0, pose)).sum() / redness(free.make(0, pose)).sum()
    # A strip 12 mm wide through the middle of a disc of 30 mm radius: (12 * 59.6) / 2827 = 25.3 %.
    assert left == pytest.approx(1.0 - 0.253, abs=0.02)


def test_swapped_marks_are_the_robot_turned_round():
    """With the fault set the red disc is at the rear."""
    config = CameraConfig(
        scene=QUIET, robot_look=PLAIN, pose=LEVELLED, marks=MarksConfig(swapped_marks=True)
    )
    seen = centroid(redness(RenderedCamera(config, 1).make(0, still(0.0, 0.0, 0.0))))
    assert np.hypot(*(seen - disc_image_centroid(config, -0.08, 0.0))) < 0.06


def test_an_aruco_tag_is_read_by_opencv_the_right_way_round():
    """The tag decodes to its id, and its image x axis points along body x."""
    look = RobotLookConfig(tag=TagConfig(tag_id=11, size_m=0.09))
    config = CameraConfig(
        scene=QUIET, pose=LEVELLED, robot_look=look, width_px=1280, height_px=960,
        lens=LensConfig(),
    )  # fmt: skip
    theta = 0.4
    frame = RenderedCamera(config, 1).make(0, still(0.0, 0.0, theta))
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(frame)
    assert np.asarray(ids).ravel().tolist() == [11]
    square = np.asarray(corners[0]).reshape(4, 2)
    right = square[1] - square[0]
    assert math.atan2(-right[1], right[0]) == pytest.approx(theta, abs=0.05)


def test_an_unknown_tag_is_refused_in_one_line():
    """A dictionary OpenCV lacks and an id past its end are bad input, with the limit."""
    for tag, text in (
        (TagConfig(dictionary="DICT_9X9"), "DICT_9X9"),
        (TagConfig(tag_id=50), "ends at 49"),
    ):
        with pytest.raises(BadInput, match=text):
            RenderedCamera(CameraConfig(robot_look=RobotLookConfig(tag=tag)), 1)


def test_a_robot_beyond_the_edge_is_drawn_in_part_or_not_at_all():
    """Poses on and over the border, and far outside, give whole frames without a fault."""
    camera = RenderedCamera(CameraConfig(scene=QUIET, robot_look=PLAIN), 1)
    empty = camera.make(0, [])
    assert not np.array_equal(camera.make(0, still(1.1, 0.0, 0.3)), empty)
    assert np.array_equal(camera.make(0, still(40.0, 0.0, 0.3)), empty)
    assert np.array_equal(camera.make(0, still(0.0, -30.0, 0.3)), empty)
