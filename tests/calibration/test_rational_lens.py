"""Rational lenses: OpenCV's eight terms in every place that knows a lens, and told by the views."""

import csv
import gzip
import io
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from hil.config.camera import CameraConfig, LensConfig
from hil.core.errors import BadInput
from hil.core.types import Pose
from tests.calibration.test_wide_lenses import LENS, SIZE, WIDE, held
from tests.system.runs import run, scenario_with
from tests.vision.scenes import at_rest, localiser
from vision.calibration.boards import BoardView
from vision.calibration.files import lens_tables, read_camera, update_camera
from vision.calibration.intrinsics import calibrate_lens
from vision.calibration.lens_fit import KINDS, fit_lens
from vision.calibration.plausible import check_rational, named
from vision.camera import CameraModel
from vision.camera_setup import camera_model

DATA = Path(__file__).parent.parent / "data" / "wide"
# 640 px over 128 degrees; neither five terms nor a fisheye come nearer than 0.15 px to it.
RATIONAL = CameraModel(
    *SIZE, 300.0, 300.6, 322.0, 238.0, (0.3, 0.05, 0.001, -0.001, 0.0, 0.7, 0.1, 0.0),
    np.eye(3), np.zeros(3),
)  # fmt: skip
TRUE = {"pinhole": LENS, "fisheye": WIDE, "rational": RATIONAL}
# The same lens on the twin's camera, as a camera file has it.
LENS_KEYS = {
    "at_width_px": 640, "at_height_px": 480, "fx_px": 400.0, "fy_px": 400.8, "cx_px": 322.0,
    "cy_px": 238.0, "k1": 0.3, "k2": 0.05, "p1": 0.001, "p2": -0.001, "k3": 0.0, "k4": 0.7,
    "k5": 0.1, "k6": 0.0,
}  # fmt: skip


def over_floor(lens):
    """Return a camera of the lens 1.6 m over the floor, looking down."""
    down = np.diag([1.0, -1.0, -1.0])
    return replace(lens, R_world_cam=down, t_world_cam_m=np.array([0.0, 0.0, 1.6]))


def test_the_rational_lens_is_opencvs():
    """Projection is cv2.projectPoints'; pixels go back to their rays, one by one and all at once."""
    rays = np.random.default_rng(1).uniform(-1.5, 1.5, (200, 2))
    points = np.column_stack((rays, np.ones(200)))
    expected, _ = cv2.projectPoints(
        points, np.zeros(3), np.zeros(3), RATIONAL.K, np.array(RATIONAL.dist)
    )
    px = RATIONAL.project(points)
    assert px == pytest.approx(expected.reshape(-1, 2), abs=1e-8)
    assert RATIONAL.normalise(px) == pytest.approx(rays, abs=1e-9)
    assert RATIONAL.normalise_point(*px[3]) == pytest.approx(rays[3], abs=1e-9)
    plain = replace(RATIONAL, dist=RATIONAL.dist[:5]).project(points)
    assert np.abs(plain - px).max() > 100.0


def test_the_slopes_of_a_rational_lens_are_those_of_its_projection():
    """floor_jacobian inverts a small move on the floor, at the middle and far out."""
    over = over_floor(RATIONAL)
    for at in ((0.0, 0.0), (1.2, 0.4), (1.8, 1.4)):
        u, v = over.project_point(*at, 0.0)
        steps = np.array([(1e-5, 0.0, 0.0), (0.0, 1e-5, 0.0)])
        moves = (over.project(steps + np.array([*at, 0.0])) - (u, v)) / 1e-5
        assert over.floor_jacobian(u, v) @ moves.T == pytest.approx(np.eye(2), abs=1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_lens_is_told_by_its_views(kind):
    """Noise of 0.1 px: the kind comes back, and the truth within 4 of the deviations stated."""
    true = TRUE[kind]
    result = calibrate_lens(held(true, 16), SIZE)
    assert result.kind == kind
    truth = np.array([true.fx_px, true.fy_px, true.cx_px, true.cy_px, *true.dist])
    moved = result.sigma > 0.0
    assert np.all(np.abs(result.lens - truth)[moved] < 4.0 * result.sigma[moved])
    assert result.sigma[0] < 0.01 * true.fx_px
    assert result.held_out_px < 0.4


def test_a_plain_lens_is_not_taken_for_a_rational_one():
    """Negative control: asked for, the quotient fits as well, and the views do not choose it."""
    views = held(LENS, 16)
    pinhole_px, _, rational_px = calibrate_lens(views, SIZE).evidence_px
    assert pinhole_px < 1.15 * rational_px
    forced = calibrate_lens(views, SIZE, "rational")
    assert forced.kind == "rational"
    assert forced.lens[0] == pytest.approx(LENS.fx_px, rel=0.01)


def test_a_quotient_that_folds_the_views_is_refused():
    """k1 = -0.9 bends back at 0.4 of 1.3 half diagonals; a term beyond the camera file is no lens."""
    numbers = np.array([300.0, 300.0, 320.0, 240.0, *RATIONAL.dist])
    px = np.array([(0.0, 0.0), (639.0, 479.0)])
    check_rational(numbers, px)
    for place, value, said in (
        (4, -0.9, "folds the image"),
        (9, 70.0, r"k4 = 70, the limits are -50 to 50"),
    ):
        other = numbers.copy()
        other[place] = value
        with pytest.raises(BadInput, match=said):
            check_rational(other, px)


def test_the_camera_file_holds_a_rational_lens(tmp_path):
    """Twelve numbers go out and come back as the same projection; a plain lens writes nine."""
    result = calibrate_lens(held(RATIONAL, 16), SIZE, "rational")
    model = camera_model(update_camera(tmp_path / "wide.toml", lens_tables(result)))
    assert model.rational
    assert read_camera(tmp_path / "wide.toml").lens.k4 == pytest.approx(result.lens[9])
    points = np.column_stack((np.random.default_rng(2).uniform(-1.2, 1.2, (50, 2)), np.ones(50)))
    seen = model.project(points @ model.R_world_cam.T + model.t_world_cam_m)
    assert seen == pytest.approx(result.model().project(points), abs=1e-6)
    plain = lens_tables(calibrate_lens(held(LENS, 12), SIZE, "pinhole"))
    assert "k4" not in plain[1].values


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"fisheye": True, "k1": 0.0, "k4": 0.1}, "k4 = 0.1 with fisheye = true"),
        ({"k1": 1.5}, "k1 = 1.5, the limits are -1 to 1 for a lens without k4, k5 and k6"),
    ],
)
def test_terms_that_no_lens_has_are_refused(keys, said):
    """k1 = 1.5 is good only in a quotient; a fisheye has none."""
    with pytest.raises(ValueError, match=said):
        LensConfig(**keys)
    assert LensConfig(k1=1.5, k4=1.9).k1 == 1.5


def wide_camera():
    return CameraConfig().model_copy(update={"lens": LensConfig(**LENS_KEYS)})


def test_the_twin_draws_and_the_marks_are_found_through_it():
    """Ten places come back within 0.4 mm; read as a plain lens most are refused, the rest further off."""
    camera = wide_camera()
    finder = localiser(camera)
    plain = LensConfig(**LENS_KEYS | {"k4": 0.0, "k5": 0.0})
    wrong = localiser(camera.model_copy(update={"lens": plain}))
    rng, misled = np.random.default_rng(3), []
    for _ in range(10):
        pose = Pose(*rng.uniform((-0.7, -0.5, -3.0), (0.7, 0.5, 3.0)))
        image = at_rest(pose, camera)
        seen, other = (f.locate(image, pose, 0.06).pose for f in (finder, wrong))
        assert seen is not None
        off_m = np.hypot(seen.x_m - pose.x_m, seen.y_m - pose.y_m)
        assert off_m < 0.4e-3
        if other is not None:
            misled.append(np.hypot(other.x_m - pose.x_m, other.y_m - pose.y_m) > 2.0 * off_m)
    assert len(misled) <= 5
    assert all(misled)


def test_a_rational_lens_drives_a_rendered_run(tmp_path):
    """The robot reaches the point by what the marks show through it."""
    keys = [f"camera.lens.{key}={value}" for key, value in LENS_KEYS.items()]
    record = run(scenario_with("scenario-2", keys), tmp_path / "run", camera="rendered")
    assert record.manifest.outcome == "complete", record.manifest.outcome_detail
    assert all(verdict.holds for verdict in record.verdicts())


def read_views(name):
    """Return the image size and the views of a packed table of corners."""
    text = gzip.decompress((DATA / f"{name}.csv.gz").read_bytes()).decode()
    head, table = text.split("\n", 1)
    width, height = (int(word) for word in head.split() if word.isdigit())
    views: dict[str, list[list[float]]] = {}
    for row in csv.reader(list(io.StringIO(table))[1:]):
        views.setdefault(row[0], []).append([float(x) for x in row[1:]])
    found = []
    for key, rows in views.items():
        numbers = np.array(rows)
        board_m = np.column_stack((numbers[:, :2], np.zeros(len(numbers))))
        found.append(BoardView(key, board_m, np.ascontiguousarray(numbers[:, 2:])))
    return (width, height), found


def test_a_real_fisheye_is_told_and_is_opencvs():
    """13 views of OpenCV's own omnidirectional camera: `cv2.fisheye.calibrate` has these figures.

    704 x 576 px are not square: 16 : 15, and so are the focal lengths.
    """
    size_px, views = read_views("fisheye")
    result = calibrate_lens(views, size_px)
    pinhole_px, fisheye_px, _ = result.evidence_px
    assert result.kind == "fisheye"
    assert pinhole_px > 2.5 * fisheye_px
    assert result.lens[:4] == pytest.approx((240.532, 256.188, 363.591, 301.056), abs=0.01)
    assert result.lens[[4, 5, 8]] == pytest.approx((-0.02999833, -0.0012116, -0.002167), abs=2e-5)
    assert result.error_px == pytest.approx(0.45859, abs=1e-4)
    assert result.held_out_px < 0.55
    assert result.lens[1] / result.lens[0] == pytest.approx(16.0 / 15.0, rel=0.005)


def test_a_real_wide_lens_is_opencvs_in_each_kind():
    """34 photographs of an action camera, 97 deg across: OpenCV's figures of the same corners."""
    size_px, views = read_views("gopro")
    fisheye = fit_lens(views, size_px, "fisheye")
    rational = fit_lens(views, size_px, "rational")
    pinhole = fit_lens(views, size_px)
    expected = (563.787, 564.812, 650.613, 499.114)
    assert fisheye.lens.numbers[:4] == pytest.approx(expected, abs=0.02)
    expected = (565.522, 566.343, 650.566, 500.147)
    assert rational.lens.numbers[:4] == pytest.approx(expected, abs=0.02)
    assert rational.sigma[:4] == pytest.approx((0.532, 0.507, 0.155, 0.253), rel=0.02)
    rms = [float(np.sqrt(np.mean(fit.errors**2))) for fit in (pinhole, fisheye, rational)]
    assert rms == pytest.approx((0.5309, 0.4330, 0.4282), abs=1e-3)
    assert named(rational.lens.numbers)["k4"] > 0.0


def test_a_bent_board_among_real_photographs_is_left_out():
    """A photograph whose corners are up to 6 px off at the board's ends is left out by name."""
    size_px, views = read_views("gopro")
    some = views[:16]
    along = np.linspace(-1.0, 1.0, len(some[4].px)) ** 2
    bad = replace(some[4], px=some[4].px + np.column_stack((0.0 * along, 6.0 * along)))
    result = calibrate_lens([*some[:4], bad, *some[5:]], size_px, "fisheye")
    assert [view.name for view in result.views if view.dropped] == [some[4].name]
    assert result.lens[0] == pytest.approx(564.0, rel=0.005)
