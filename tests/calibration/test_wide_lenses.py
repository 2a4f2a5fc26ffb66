"""Wide lenses: the fisheye model against OpenCV's, and which lens the views say it is."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from hil.core.errors import BadInput
from tests.calibration.render import LENS, hand_held
from vision.calibration.boards import BoardView, parse_board
from vision.calibration.files import lens_tables, read_camera, update_camera
from vision.calibration.intrinsics import calibrate_lens
from vision.calibration.lens_fit import Lens
from vision.camera import CameraModel
from vision.camera_setup import camera_model
from vision.disc_fit import compiled

SIZE = (640, 480)
NOISE_PX = 0.1
# 640 px over 134 degrees: f theta with the terms of an ordinary M12 lens.
WIDE = CameraModel(
    *SIZE, 280.0, 280.5, 322.0, 238.0, (-0.02, 0.004, 0.0, 0.0, -0.001),
    np.eye(3), np.zeros(3), fisheye=True,
)  # fmt: skip
GRID_M = np.array([(x, y, 0.0) for y in range(1, 6) for x in range(1, 8)]) * 0.03


def held(model, count=14, near=0.55):
    """Return noisy views of a board in all parts of the image, tilted, near enough to fill it."""
    views = []
    aim = np.random.default_rng(7)
    for k, (R, _) in enumerate(hand_held(parse_board("charuco:8x6:30:22"), count)):
        ray = aim.uniform((-1.1, -0.8), (1.1, 0.8)) * (400.0 / model.fx_px)
        middle = near * aim.uniform(0.5, 1.1) * np.array([*ray, 1.0]) / np.linalg.norm([*ray, 1.0])
        px = model.project((GRID_M - GRID_M.mean(axis=0)) @ R.T + middle)
        px += np.random.default_rng(k).normal(0.0, NOISE_PX, px.shape)
        inside = (px > 0.0).all(axis=1) & (px < np.array(SIZE) - 1.0).all(axis=1)
        if inside.sum() >= 12:
            views.append(BoardView(f"view {k}", GRID_M[inside], px[inside]))
    return views


def test_the_fisheye_is_opencvs():
    """Projection is cv2.fisheye's with k4 = 0; pixels go back to their rays, scalar and compiled alike."""
    rays = np.random.default_rng(1).uniform(-2.5, 2.5, (200, 2))
    points = np.column_stack((rays, np.ones(200)))
    terms = np.array([*WIDE.dist[:2], WIDE.dist[4], 0.0])
    expected, _ = cv2.fisheye.projectPoints(
        points.reshape(1, -1, 3), np.zeros((3, 1)), np.zeros((3, 1)), WIDE.K, terms
    )
    px = WIDE.project(points)
    assert px == pytest.approx(expected.reshape(-1, 2), abs=1e-7)
    assert WIDE.normalise(px) == pytest.approx(rays, abs=1e-7)
    assert WIDE.normalise_point(*px[0]) == pytest.approx(rays[0], abs=1e-9)
    assert compiled(WIDE) is not None
    flat = replace(WIDE, fisheye=False).project(points)
    assert np.abs(flat - px).max() > 100.0


def test_the_slopes_of_a_fisheye_are_those_of_its_projection():
    """floor_jacobian inverts a small move on the floor, at the middle and far out."""
    over = replace(
        WIDE, R_world_cam=np.diag([1.0, -1.0, -1.0]), t_world_cam_m=np.array([0, 0, 2.0])
    )
    for at in ((0.0, 0.0), (1e-7, 0.0), (2.5, 1.5)):
        u, v = over.project_point(*at, 0.0)
        steps = np.array([(1e-5, 0.0, 0.0), (0.0, 1e-5, 0.0)])
        moves = (over.project(steps + np.array([*at, 0.0])) - (u, v)) / 1e-5
        assert over.floor_jacobian(u, v) @ moves.T == pytest.approx(np.eye(2), abs=1e-3)


def test_a_fisheye_is_told_by_held_out_views(tmp_path):
    """A lens of 134 degrees is found out, its figures come back, and the camera file holds it."""
    result = calibrate_lens(held(WIDE), SIZE)
    pinhole_px, fisheye_px, _ = result.evidence_px
    assert result.fisheye
    assert fisheye_px < 0.25
    assert pinhole_px > 2.0 * fisheye_px
    assert result.lens[:2] == pytest.approx((WIDE.fx_px, WIDE.fy_px), rel=0.01)
    assert abs(result.lens[0] - WIDE.fx_px) < 4.0 * result.sigma[0]
    assert result.held_out_px < 0.3
    model = camera_model(update_camera(tmp_path / "wide.toml", lens_tables(result)))
    assert model.fisheye
    assert read_camera(tmp_path / "wide.toml").lens.fisheye
    points = np.column_stack((GRID_M[:, :2] * 8.0, np.ones(len(GRID_M))))
    seen = model.project((points) @ model.R_world_cam.T + model.t_world_cam_m)
    assert seen == pytest.approx(result.model().project(points), abs=1e-6)


def test_an_ordinary_lens_stays_a_pinhole():
    """Negative control: 54 degrees and barrel distortion. Asked for, a fisheye is fitted all the same."""
    views = held(LENS, 20)
    result = calibrate_lens(views, SIZE)
    assert not result.fisheye
    assert len(result.evidence_px) == 3
    forced = calibrate_lens(views, SIZE, "fisheye")
    assert forced.fisheye
    assert forced.lens[0] == pytest.approx(LENS.fx_px, rel=0.02)
    assert not calibrate_lens(views, SIZE, "pinhole").evidence_px


def bent(view, most_px):
    """Return the view of a board that is bent along its length, by up to so many pixels."""
    along = view.px[:, 0] - view.px[:, 0].mean()
    off = most_px * (along / np.abs(along).max()) ** 2
    return replace(view, px=view.px + np.column_stack((0.0 * off, off)))


@pytest.mark.parametrize("which", [1, 2, 4])
def test_a_bent_view_among_nine_is_left_out(which):
    """2.5 px at its ends: it stands out more when left out, and the rest give the true lens."""
    views = held(LENS, 24)[:9]
    seen = [bent(view, 2.5) if k == which else view for k, view in enumerate(views)]
    result = calibrate_lens(seen, SIZE)
    gone = [view for view in result.views if view.dropped]
    assert [view.name for view in gone] == [views[which].name]
    assert gone[0].left_out_px > gone[0].error_px
    assert result.lens[0] == pytest.approx(LENS.fx_px, rel=0.005)
    assert not any(view.dropped for view in calibrate_lens(views, SIZE).views)


def test_views_that_say_little_are_named():
    """Six boards that face the camera at one distance near the middle, beside six tilted ones."""
    from vision.calibration.advice import Sight, advise  # noqa: PLC0415

    frontal = [Sight(f"flat {k}", 3.0, 0.50 + 0.01 * k, 0.4) for k in range(6)]
    said = advise(np.zeros((6, 8), dtype=int), [3.0] * 6, frontal)
    assert "only the middle is seen in flat 0, flat 1" in said[0]
    assert (
        "the board faces the camera in flat 0, flat 1, flat 2, flat 3, flat 4 and 1 more" in said[1]
    )
    assert said[2] == "bring the board nearer and further: it is 0.50 to 0.55 m away in all 6 views"
    good = [Sight(f"good {k}", 30.0, 0.4 + 0.1 * k, 0.9) for k in range(10)]
    assert advise(np.ones((6, 8), dtype=int), [30.0] * 10, good) == []


def test_partly_seen_boards_count():
    """Boards cut by the image's edge, three views at least, are kept and the lens is the true one."""
    views = held(WIDE, near=0.4)
    assert sum(len(view.px) < len(GRID_M) for view in views) >= 3
    result = calibrate_lens(views, SIZE)
    assert len([view for view in result.views if not view.dropped]) >= len(views) - 1
    assert result.lens[0] == pytest.approx(WIDE.fx_px, rel=0.01)


def test_a_view_no_fisheye_can_see():
    """Corners beyond 90 degrees from the axis have no ray: named, not a trace from inside."""
    lens = Lens(np.array([280.0, 280.0, 320.0, 240.0, 0.0, 0.0, 0.0, 0.0, 0.0]), fisheye=True)
    view = held(WIDE)[0]
    assert lens.error_px(view) < 10.0
    with pytest.raises(BadInput, match=r"^lens: view 0 has too few corners"):
        lens.place(replace(view, name="view 0", px=view.px + 2000.0))
