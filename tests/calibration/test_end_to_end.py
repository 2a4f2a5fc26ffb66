"""Everything calibrated by the tools from rendered pictures, then believed over the whole floor."""

import json
import math
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from hil.cli.calibrate import command as calibrate
from hil.cli.localise import command as localise
from hil.config.camera import CameraConfig
from hil.config.load import load_scenario
from hil.core.errors import BadInput
from hil.core.types import wrap_pi
from sim_twin.camera_sim import RenderedCamera
from tests.calibration.render import LENS, TagFloor, board_image, hand_held
from vision.calibration.boards import parse_board
from vision.calibration.files import Table, read_camera, update_camera
from vision.camera_setup import camera_model
from vision.cv_compat import read_image, write_image
from vision.localisers.marks import MarkLocaliser

BOARD = "charuco:8x6:30:22"
TAGS = {1: (0.15, 0.15), 2: (1.0, 0.12), 3: (1.75, 0.15), 4: (0.2, 0.7), 5: (1.7, 0.7),
        6: (0.15, 1.25), 7: (1.0, 1.25), 8: (1.75, 1.25)}  # fmt: skip
TAG_M = 0.096
CORNER = np.array([-1.0, -0.75, 0.0])
SURVEY_M = 0.001


def call(command, *arguments):
    """Run a command and return what it printed; errors come through as raised."""
    result = CliRunner().invoke(command, [str(a) for a in arguments], catch_exceptions=True)
    if result.exception is not None:
        raise result.exception
    return result.stdout


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """Make a lab with the twin's camera: pictures of boards, of tags on the floor, and of the robot."""
    folder = tmp_path_factory.mktemp("lab")
    config = CameraConfig()
    camera = camera_model(config)
    board = parse_board(BOARD)
    (folder / "boards").mkdir()
    for k, (R, t) in enumerate(hand_held(board, 10)):
        write_image(folder / "boards" / f"view{k}.png", board_image(LENS, board, R, t, k))
    write_image(folder / "tags.png", board_image(camera, TagFloor(TAGS, TAG_M), np.eye(3), CORNER))
    rng = np.random.default_rng(7)
    centres = {k: np.array(at) + TAG_M / 2 + CORNER[:2] for k, at in TAGS.items()}
    rows = [f"{k},{x},{y}" for k, (x, y) in
            ((k, at + rng.normal(0, SURVEY_M, 2)) for k, at in centres.items())]  # fmt: skip
    (folder / "tags.csv").write_text("\n".join(["id,x_m,y_m", *rows]))
    twin = RenderedCamera(config, 1)
    lines = ["image,front_u_px,front_v_px,rear_u_px,rear_v_px"]
    for k, pose in enumerate([(0.6, 0.4, 1.0), (-0.6, -0.4, 2.0), (0.5, -0.4, -1.0)]):
        write_image(folder / f"robot{k}.png", twin.make(k, [pose, pose]))
        c, s = math.cos(pose[2]), math.sin(pose[2])
        px = [camera.project_point(pose[0] + d * c, pose[1] + d * s, 0.1) for d in (0.08, -0.08)]
        lines.append(f"robot{k}.png," + ",".join(f"{v:.0f}" for pair in px for v in pair))
    (folder / "marks.csv").write_text("\n".join(lines))
    return SimpleNamespace(folder=folder, config=config, twin=twin, file=folder / "lab.toml")


@pytest.fixture(scope="module")
def calibrated(lab):
    """Run the three commands on the lab and return what they said."""
    said = [
        call(calibrate, "camera", lab.folder / "boards", "--board", BOARD, "--camera-file", lab.file,
             "--picture", lab.folder / "coverage.png", "--json"),
        call(calibrate, "floor", lab.folder / "tags.png", "--fiducials", lab.folder / "tags.csv",
             "--camera-file", lab.file, "--picture", lab.folder / "floor.png", "--json"),
        call(calibrate, "colours", "--samples", lab.folder / "marks.csv", "--camera-file", lab.file,
             "--json"),
    ]  # fmt: skip
    return [json.loads(text) for text in said]


def test_poses_over_the_floor_with_everything_calibrated(lab, calibrated):
    """At most 3 mm and 0.3 deg RMS over the floor, with a survey good to 1 mm."""
    config = read_camera(lab.file)
    localiser = MarkLocaliser(camera_model(config), config.marks)
    rng = np.random.default_rng(11)
    off = []
    for k in range(30):
        pose = (rng.uniform(-0.8, 0.8), rng.uniform(-0.5, 0.5), rng.uniform(-3.1, 3.1))
        seen = localiser.locate(lab.twin.make(k, [pose, pose]), None, 0.1)
        assert seen.pose is not None, seen.reason
        turn = wrap_pi(seen.pose.theta_rad - pose[2])
        off.append((seen.pose.x_m - pose[0], seen.pose.y_m - pose[1], turn))
    off = np.array(off)
    assert np.sqrt(np.mean(np.sum(off[:, :2] ** 2, axis=1))) <= 3e-3
    assert np.degrees(np.sqrt(np.mean(off[:, 2] ** 2))) <= 0.3
    # What the floor calibration says of itself holds for the robot.
    assert calibrated[1]["held_out_rms_mm"] < 5.0


def test_what_the_commands_say_and_draw(lab, calibrated):
    """Views, held-out residuals and pictures are there; the camera hangs where it hangs."""
    lens, floor, colours = calibrated
    assert len(lens["views"]) == 10
    assert lens["held_out_px"] < 0.2
    assert lens["lens"]["fx_px"] == pytest.approx(620.0, rel=0.01)
    assert floor["eye_m"] == pytest.approx(lab.config.pose.eye_m, abs=0.03)
    assert floor["points"] == 8
    assert colours["separation"] > 6
    for name in ("coverage.png", "floor.png"):
        assert read_image(lab.folder / name).shape == (480, 640, 3)
    text = lab.file.read_text()
    assert "on held-out views" in text
    assert "on held-out points" in text


@pytest.mark.usefixtures("calibrated")
def test_one_command_leaves_the_tables_of_the_others_alone(lab, tmp_path):
    """Calibrating the floor again changes [pose] and nothing else, comments included."""
    copy = tmp_path / "lab.toml"
    copy.write_text(lab.file.read_text().replace("[pose]", "[pose]\n# by hand"))
    before = copy.read_text()
    call(calibrate, "floor", lab.folder / "tags.png", "--fiducials", lab.folder / "tags.csv",
         "--camera-file", copy)  # fmt: skip
    after = copy.read_text()
    assert "# by hand" in before
    assert "# by hand" not in after
    for table in ("[lens]", "[marks.front]", "[marks.rear]"):
        assert after.split(table)[1].split("[")[0:1] == before.split(table)[1].split("[")[0:1]


@pytest.mark.usefixtures("calibrated")
def test_a_scenario_takes_the_camera_file(lab, tmp_path):
    """`[camera] file` lays the calibration under what the scenario says of the camera itself."""
    copy = tmp_path / "lab.toml"
    copy.write_text("# top\nlatency_s = 0.041\n" + lab.file.read_text())
    update_camera(copy, [Table("", {"rate_hz": 25.0})])
    own = tmp_path / "own.toml"
    own.write_text('base = "scenario-1"\n[camera]\nfile = "lab.toml"\nexposure_s = 0.004\n')
    camera = load_scenario(str(own)).camera
    assert (camera.latency_s, camera.rate_hz, camera.exposure_s) == (0.041, 25.0, 0.004)
    assert camera.lens == read_camera(lab.file).lens
    assert camera.pose.R_world_cam is not None
    assert copy.read_text().startswith("# top\n")
    with pytest.raises(BadInput, match="no terminal"):
        call(calibrate, "latency", "0", "--camera-file", copy)


@pytest.mark.usefixtures("calibrated")
def test_a_video_through_localisation_alone(lab, tmp_path):
    """Every frame of a drive is seen, 2 mm from the truth; rows, overlay and summary are there."""
    film, rows, overlay = tmp_path / "film.avi", tmp_path / "rows.csv", tmp_path / "overlay.avi"
    write_film(lab.twin, film, 12)
    arguments = [film, "--camera-file", lab.file, "--out", rows, "--overlay", overlay, "--json"]
    summary = json.loads(call(localise, *arguments))
    assert summary["seen"] == summary["frames"] == 12
    assert summary["in_window_ratio"] == pytest.approx(11 / 12)
    table = np.genfromtxt(rows, delimiter=",", names=True, dtype=None, encoding="utf-8")
    truth = np.array([drive(t) for t in np.arange(12) / 30.0])
    assert np.abs(table["x_m"] - truth[:, 0]).max() < 4e-3
    assert np.abs(table["theta_rad"] - truth[:, 2]).max() < 0.02
    capture = cv2.VideoCapture(str(overlay))
    assert capture.get(cv2.CAP_PROP_FRAME_COUNT) == 12
    # With a tag that is not there it is refused, and leaves nothing.
    with pytest.raises(BadInput, match=r"not seen in any of 12 frames"):
        call(localise, film, "--camera-file", lab.file, "--tag", "7:70", "--out", tmp_path / "no.csv",
             "--overlay", tmp_path / "no.avi")  # fmt: skip
    assert sorted(p.name for p in tmp_path.iterdir()) == ["film.avi", "overlay.avi", "rows.csv"]


def drive(t_s):
    return (0.5 * math.cos(0.8 * t_s), 0.4 * math.sin(0.8 * t_s), 0.8 * t_s + 1.5)


def write_film(twin, path, count):
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (640, 480))
    for k in range(count):
        writer.write(twin.make(k, [drive(k / 30.0)] * 2))
    writer.release()


def bad_inputs(lab, made):
    """Return name -> (command, arguments, what must be said); `made` is a folder to write in."""
    film = made / "film.mkv"
    write_film(lab.twin, film, 6)
    data = film.read_bytes()
    (made / "cut.mkv").write_bytes(data[: len(data) // 2])
    picture = (lab.folder / "tags.png").read_bytes()
    (made / "torn.png").write_bytes(picture[: len(picture) // 2])
    write_image(made / "small.png", np.zeros((240, 320, 3), np.uint8))
    write_image(made / "dark.png", np.zeros((480, 640, 3), np.uint8))
    (made / "wrong.toml").write_text("[lens]\nfx = 3\n")
    boards = made / "boards"
    boards.mkdir()
    for k in range(5):
        write_image(boards / f"{k}.png", np.full((480, 640, 3), 90, np.uint8))
    out, know = ("--camera-file", made / "new.toml"), ("--camera-file", lab.file)
    keep = ("--out", made / "rows.csv", "--overlay", made / "overlay.mkv")
    tags = ("--fiducials", lab.folder / "tags.csv")
    robot = lab.folder / "robot0.png"
    return {
        "board never seen": (calibrate, ("camera", boards, *out), "board not seen in any of 5 images"),
        "no such source": (calibrate, ("camera", made / "none", *out), "no such folder"),
        "cut video": (calibrate, ("camera", made / "cut.mkv", *out), "cut off"),
        "bad board": (calibrate, ("camera", boards, "--board", "x", *out), "not understood"),
        "torn image": (calibrate, ("floor", made / "torn.png", *tags, *know), "its end is missing"),
        "other resolution": (calibrate, ("floor", made / "small.png", *tags, *know), "320 x 240 px"),
        "no tags": (calibrate, ("floor", made / "dark.png", *tags, *know), "not seen"),
        "no lens yet": (calibrate, ("floor", robot, *tags, *out), "hil calibrate camera"),
        "no method": (calibrate, ("floor", robot, *know), "exactly one of"),
        "wrong key": (calibrate, ("floor", robot, *tags, "--camera-file", made / "wrong.toml"), "fx"),
        "same mark": (calibrate, ("colours", robot, "--front", "400,120", "--rear", "400,120", *know),
                      "one colour"),
        "not a pixel": (calibrate, ("colours", robot, "--front", "a,b", "--rear", "1,2", *know),
                        "--front 'a,b'"),
        "cut film": (localise, (made / "cut.mkv", *know, *keep), "cut off"),
        "small film": (localise, (made / "boards", "--camera-file", made / "big.toml", *keep),
                       "1280 x 720 px"),
        "no folder for rows": (localise, (film, *know, "--out", made / "none" / "rows.csv", *keep[2:]),
                               "does not exist"),
        "overlay format": (localise, (film, *know, "--overlay", made / "overlay.gif"), ".avi or .mkv"),
        "picture format": (calibrate, ("floor", robot, *tags, *know, "--picture", made / "a.gif"),
                           ".png or .jpg"),
        "bad tag": (localise, (film, *know, "--tag", "7", *keep), "ID:SIZE_MM"),
    }  # fmt: skip


@pytest.mark.usefixtures("calibrated")
def test_bad_input_is_one_line_and_leaves_nothing(lab, tmp_path):
    """Each is a BadInput (exit status 2) of one line that names the fault; no file is made."""
    cases = bad_inputs(lab, tmp_path)
    (tmp_path / "big.toml").write_text("width_px = 1280\nheight_px = 720\n")
    before = sorted(tmp_path.rglob("*"))
    text = lab.file.read_text()
    for name, (command, arguments, says) in cases.items():
        with pytest.raises(BadInput) as error:
            call(command, *arguments)
        message = str(error.value)
        assert says in message, f"{name}: {message}"
        assert "\n" not in message, name
    assert sorted(tmp_path.rglob("*")) == before
    assert lab.file.read_text() == text
