"""The Set-up page in the browser: bring-up, a camera looked at live, floor and colours by clicking, tags."""

from __future__ import annotations

import math
import re
import tomllib
from pathlib import Path

import cv2
import numpy as np
import pytest

from hil.config.load import load_robot, load_scenario
from hil.console.camera_worker import controls_of
from hil.rigs.frames import CaptureSource
from sim_twin.camera_sim import RenderedCamera
from sim_twin.samples import ROBOT_POSE
from tests.calibration.test_sources import FakeCapture
from tests.console.rig import CHROMIUM, NO_CHROMIUM, Console, began_bring_up, film, served_twin
from vision.camera_setup import camera_model
from vision.sources import CameraControls, LiveCamera

realtime = pytest.mark.realtime
chromium_needed = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)
CHESSBOARD = Path(__file__).parents[1] / "data" / "chessboard"


def look_at(page, source, find):
    """Have the page look at a source."""
    page.fill("#c-source", source)
    page.select_option("#c-find", find)
    page.click("#c-open")


@realtime
@chromium_needed
def test_a_robot_is_brought_up_with_the_page_as_guide(tmp_path, open_page):
    """Asked before each drive and after it; a wrong answer is a fault by name; the file is the command's."""
    from playwright.sync_api import expect  # noqa: PLC0415 - where there is a browser

    with (
        served_twin(tmp_path, "--camera", "pose", "--set", "robot.variant=lifted") as (
            target,
            camera,
        ),
        Console(tmp_path, "--on", target, "--camera", camera) as console,
    ):
        page = open_page(console)
        page.click("nav a[href='#setup']")
        expect(page.locator("#b-target")).to_have_value(target)
        expect(page.locator("#b-begin")).to_be_disabled()  # nobody said that the wheels are free
        passed = False
        for _ in range(3):  # wheels that are driven want a set-point every 250 ms
            page.fill("#b-turns", "0")
            if not began_bring_up(page):
                pytest.fail(
                    "this machine is too busy: the link's latency is beyond a bring-up's limit"
                )
            page.click('[data-answer="go"]')
            page.click('[data-answer="left forward"]')
            page.click('[data-answer="go"]')
            expect(page.locator("#b-ask")).to_contain_text("The right side was driven")
            page.reload()  # in the middle: it is asked still
            page.click('[data-answer="right forward"]')
            page.click('[data-answer="go"]')
            expect(page.locator("#b-end .banner")).to_be_visible()
            passed = "All checks passed." in page.inner_text("#b-end")
            page.locator("#b-begin").wait_for()
            if passed or "board_stopped" not in page.inner_text("#b-end"):
                break
        assert passed, page.inner_text("#bring-up")
        file = console.records / "set-up" / "robot.toml"
        measured = load_robot(str(file)).bring_up
        assert measured is not None
        assert measured.top_speed_forward_rad_s[0] == pytest.approx(29.0, abs=0.5)
        page.check("#b-floor")  # asks anew whether the robot stands as it must
        expect(page.locator("#b-begin")).to_be_disabled()
        page.uncheck("#b-floor")
        assert began_bring_up(page)
        page.click('[data-answer="go"]')
        page.click('[data-answer="left backward"]')
        expect(page.locator("#b-checks")).to_contain_text(
            "driven forward, its wheels turn backward"
        )
        page.locator('[data-answer="go"]').wait_for()
        page.locator("body").press("Space")
        expect(page.locator("#b-end")).to_contain_text("stopped; the wheels are off")


@realtime
@chromium_needed
def test_what_is_typed_stays_when_the_suggestion_comes_late(tmp_path, open_page):
    """The page's first value for a field is not put under the hands of the one who types there."""
    held = []
    with Console(tmp_path) as console:
        page = open_page(console)
        page.wait_for_load_state("networkidle")
        page.route("**/api/choices*", lambda route: held.append(route))  # noqa: PLW0108 - it is marked
        page.click("nav a[href='#setup']")
        page.focus("#c-source")
        while not held:
            page.wait_for_timeout(50)
        with page.expect_response("**/api/choices*"):
            for route in held:
                route.continue_()
        page.wait_for_load_state("networkidle")
        page.keyboard.insert_text("board.avi")
        assert page.input_value("#c-source") == "board.avi"
        # What else the answer brings is there, once the page has read it.
        page.wait_for_function("document.querySelector('#b-robot').value === 'thesis-4wd'")
        assert page.input_value("#c-source") == "board.avi"


@realtime
@chromium_needed
def test_a_camera_is_looked_at_live(tmp_path, open_page):
    """Corners and coverage of a board, views taken and rejected; tags by number; a source that is none."""
    from playwright.sync_api import expect  # noqa: PLC0415

    views = [cv2.imread(str(CHESSBOARD / f"left{k:02d}.jpg")) for k in (1, 3, 5)]
    film(tmp_path / "board.avi", [views[k % 3] for k in range(30)], each=60)
    tags = np.full((480, 640, 3), 200, np.uint8)
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    for number, (u, v) in {3: (100, 100), 7: (400, 250)}.items():
        tag = cv2.aruco.generateImageMarker(family, number, 120)
        tags[v : v + 120, u : u + 120] = tag[:, :, None]
    film(tmp_path / "tags.avi", [tags], each=1200)
    with Console(tmp_path) as console:
        page = open_page(console)
        page.click("nav a[href='#setup']")
        page.fill("#s-board", "chess:10x7:25")
        look_at(page, "board.avi", "board")
        expect(page.locator("#c-said")).to_contain_text("54 corners")
        expect(page.locator("#c-controls")).to_contain_text("no controls")
        expect(page.locator("#c-views li")).not_to_have_count(0)  # by itself
        expect(page.locator("#c-hints")).to_contain_text("hold the board to")
        page.uncheck("#c-auto")
        page.click("#c-take")
        expect(page.locator("#c-views li").nth(1)).to_be_visible()
        lens = console.records / "set-up" / "pictures" / "lens"
        kept = len(list(lens.glob("*.png")))
        page.click("[aria-label='Reject live-001.png']")
        expect(page.locator("#c-views")).not_to_contain_text("live-001.png")
        assert len(list(lens.glob("*.png"))) == kept - 1
        expect(page.locator("#s-lens-have")).to_contain_text(f"{kept - 1} here")
        look_at(page, "tags.avi", "tags")
        expect(page.locator("#c-said")).to_contain_text("tags 3, 7")
        page.click("#c-floor")
        expect(page.locator("#s-floor-have")).to_contain_text("live.png")
        page.click("#c-close")
        expect(page.locator("#c-close")).to_be_disabled()
        look_at(page, "../secret.avi", "nothing")
        expect(page.locator("#said")).to_contain_text("secret.avi")


@realtime
@chromium_needed
def test_floor_and_colours_by_clicking(tmp_path, open_page):
    """Known floor points and the two marks clicked on; the robot is found with the file that comes of it."""
    from playwright.sync_api import expect  # noqa: PLC0415

    camera = load_scenario("scenario-1").camera
    model = camera_model(camera)
    picture = RenderedCamera(camera, 1).make(0, [ROBOT_POSE, ROBOT_POSE])
    cv2.imwrite(str(tmp_path / "robot.png"), picture)
    film(tmp_path / "robot.avi", [picture], each=1200)
    with Console(tmp_path) as console:
        page = open_page(console, viewport={"width": 700, "height": 900})
        page.click("nav a[href='#setup']")

        def click(canvas, at):
            place = page.locator(canvas)
            scale = place.bounding_box()["width"] / camera.width_px
            place.click(position={"x": (at[0] + 0.5) * scale, "y": (at[1] + 0.5) * scale})

        page.set_input_files("#s-floor-files", tmp_path / "robot.png")
        expect(page.locator("#s-floor-picture")).to_be_visible()
        places = [(x, y) for x in (-0.7, -0.25, 0.25, 0.7) for y in (-0.5, 0.0, 0.5)]
        for number, (x, y) in enumerate(places, 1):
            click("#s-floor-picture", model.project_point(x, y, 0.0))
            page.fill(f"[aria-label='Point {number}, X in m']", str(x))
            page.fill(f"[aria-label='Point {number}, Y in m']", str(y))
        page.check("#s-fit")
        page.fill("#s-height", f"{model.t_world_cam_m[2]:.3f}")
        page.click("#s-floor")
        expect(page.locator("#s-floor-said")).to_contain_text("12 points")
        expect(page.locator("#s-floor-said img")).to_be_visible()
        page.set_input_files("#s-colours-files", tmp_path / "robot.png")
        expect(page.locator("#s-colours-picture")).to_be_visible()
        x, y, theta = ROBOT_POSE
        for mark in (camera.marks.front, camera.marks.rear):
            c, s = math.cos(theta), math.sin(theta)
            at = (x + c * mark.x_m - s * mark.y_m, y + s * mark.x_m + c * mark.y_m)
            click("#s-colours-picture", model.project_point(*at, camera.marks.height_m))
        expect(page.locator("#s-colours-points")).to_contain_text("rear mark at pixel")
        page.click("#s-colours")
        expect(page.locator("#s-colours-said")).to_contain_text("separation of the marks")
        file = tomllib.loads((console.records / "set-up" / "camera.toml").read_text())
        assert file["width_px"] == camera.width_px
        assert file["marks"]["front"]["colour"] != file["marks"]["rear"]["colour"]
        look_at(page, "robot.avi", "robot")
        expect(page.locator("#c-said")).to_contain_text("robot at")
        found = re.search(
            r"robot at \(([-\d.]+), ([-\d.]+)\) m, ([-\d.]+) deg", page.inner_text("#c-said")
        )
        assert (float(found[1]), float(found[2])) == pytest.approx((x, y), abs=0.02)
        assert float(found[3]) == pytest.approx(math.degrees(theta), abs=3.0)


def test_exposure_as_set_and_as_in_force():
    """What was asked for, what the driver says it is, and what it does not let be set; a video has none."""
    asked = CameraControls(exposure=200.0, white_balance_k=5000.0)
    capture = FakeCapture()
    capture.dropped.add(cv2.CAP_PROP_WB_TEMPERATURE)  # taken without a word, and dropped
    camera = LiveCamera(0, asked, capture=capture)
    camera.close()
    shown = {item["name"]: item for item in controls_of(camera, asked)}
    assert shown["exposure"] | {"name": ""} == {
        "name": "", "asked": 200.0, "in_force": 200.0, "state": "locked", "refused": False
    }  # fmt: skip
    assert (shown["white_balance_k"]["in_force"], shown["white_balance_k"]["refused"]) == (
        4100.0,
        True,
    )
    assert (shown["gain"]["asked"], shown["gain"]["in_force"]) == (None, 12.0)
    assert (shown["focus"]["state"], shown["focus"]["in_force"]) == ("left to the camera", None)


def test_a_video_has_no_controls(tmp_path):
    """Only a live camera has."""
    film(tmp_path / "any.avi", [np.zeros((64, 64, 3), np.uint8)], each=3)
    source = CaptureSource(str(tmp_path / "any.avi"))
    assert controls_of(source, CameraControls()) == []
    source.close()
