"""The console in a real browser, over a served twin, as somebody beside the rig uses it.

`python -m tests.console.pictures` takes the pictures of docs/console.md on the same way.
"""

from __future__ import annotations

import re
import signal
from pathlib import Path

import pytest

import hil
from tests.console.rig import CHROMIUM, NO_CHROMIUM, Console

pytestmark = [pytest.mark.realtime, pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)]
CHESSBOARD = Path(__file__).parents[1] / "data" / "chessboard"
# A machine that is busy elsewhere is late by more than a rig may be.
PATIENT = {"safety.pose_lost_s": 9, "safety.link_lost_s": 9}


def start(page, scenario, duration_s, arm=True):
    """Choose a scenario, shorten it by the form of changed values, connect, and arm once it was found."""
    page.select_option("#scenario", scenario)
    page.locator("#changes").evaluate("(details) => { details.open = true; }")
    for key, value in {"duration_s": duration_s, **PATIENT}.items():
        page.fill("#setting", key)
        page.fill("#setting-value", str(value))
        page.click("#setting-add")
    page.click("#start")
    if arm:
        page.click("#arm")  # enabled when the robot was found


def ended(page, text):
    """Wait for the end, which says `text`, and for the report; return the record's name."""
    from playwright.sync_api import expect  # noqa: PLC0415

    expect(page.locator("#outcome")).to_contain_text(text)
    expect(page.locator("#phase")).to_have_text("ended")
    expect(page.locator("#report-box")).to_be_visible()
    return page.locator("#outcome").inner_text().split("Record: ")[1].strip()


def test_three_experiments_stop_and_two_pages(rig, open_page):
    """Scenarios 1 to 3 in turn; a viewer sees them, a reload in mid-run too; the space bar stops one."""
    from playwright.sync_api import expect  # noqa: PLC0415

    page, viewer = open_page(rig), open_page(rig)
    expect(viewer.locator("#who")).to_contain_text("You watch")
    expect(viewer.locator("#start")).to_be_disabled()
    page.locator("#changes").evaluate("(details) => { details.open = true; }")
    page.fill("#setting", "duration_s")
    page.fill("#setting-value", "-3")
    page.click("#setting-add")
    expect(page.locator("#said")).to_contain_text("duration_s = -3 s: allowed is above 0 to 3600")
    records = []
    for number in (1, 2, 3):
        start(page, f"scenario-{number}", 1.5 if number < 3 else 30)
        expect(page.locator("#phase")).to_have_text("running")
        if number < 3:
            records.append(ended(page, "a requirement does not hold"))
            continue
        expect(page.locator("#events")).to_contain_text("board: armed")
        expect(viewer.locator("#facts")).to_contain_text("Battery")
        page.reload()  # in mid-run
        expect(page.locator("#who")).to_contain_text("You operate")
        expect(page.locator("#phase")).to_have_text("running")
        expect(page.locator("#events")).to_contain_text("board: armed")
        page.keyboard.press("Space")
        records.append(ended(page, "Stopped."))
        expect(viewer.locator("#outcome")).to_contain_text("Stopped.")
    found = [hil.open_record(rig.records / name) for name in records]
    assert [run.outcome for run in found] == ["complete", "complete", "interrupted"]
    assert [run.manifest.scenario_name for run in found] == [f"scenario-{k}" for k in (1, 2, 3)]
    assert all(run.manifest.target.startswith("serial:") and not run.problems for run in found)
    assert any("page of the operator" in event.text for event in found[2].events)
    frame = page.frame_locator("#report")
    expect(frame.locator("h1")).to_contain_text("scenario-3")


def test_records_are_compared_and_binned(rig, open_page):
    """Two records side by side; a filter; one into the bin and back."""
    from playwright.sync_api import expect  # noqa: PLC0415

    for law in ("pid", "asg-ism"):
        hil.run("circle", law, camera="pose", duration_s=1.0, out=rig.records / f"round {law}")
    page = open_page(rig)
    page.click("nav a[href='#records']")
    page.fill("#f-text", "round")
    expect(page.locator("#r-rows tr")).to_have_count(2)
    for box in page.locator("#r-rows input").all():
        box.check()
    page.click("#r-compare")
    frame = page.frame_locator("#r-frame")
    expect(frame.locator("body")).to_contain_text("asg-ism")
    expect(frame.locator("body")).to_contain_text("pid")
    page.click("#r-delete")
    expect(page.locator("#r-count")).to_have_text("none like this")
    assert not (rig.records / "round pid").exists()
    page.click("#r-undo button")
    expect(page.locator("#r-rows tr")).to_have_count(2)
    assert hil.open_record(rig.records / "round pid").problems == ()


def test_a_camera_is_calibrated_from_given_pictures(rig, open_page):
    """Ten views of a chessboard give the file that `hil calibrate camera` writes."""
    from playwright.sync_api import expect  # noqa: PLC0415

    page = open_page(rig)
    page.click("nav a[href='#setup']")
    pictures = sorted(CHESSBOARD.glob("left*.jpg"))[:10]
    page.set_input_files("#s-lens-files", pictures)
    expect(page.locator("#s-lens-have")).to_contain_text("10 here")
    page.fill("#s-board", "chess:10x7:25")
    page.click("#s-lens")
    expect(page.locator("#s-lens-said")).to_contain_text("image covered")
    expect(page.locator("#s-lens-said img")).to_be_visible()
    text = (rig.records / "set-up" / "camera.toml").read_text()
    focal_px = float(re.search(r"fx_px\s*=\s*([\d.]+)", text)[1])
    assert focal_px == pytest.approx(536.0, abs=6.0)  # OpenCV's own value for these pictures: 535.9
    expect(page.locator("#s-file")).to_contain_text("fx_px")


def test_a_console_started_again_is_found_by_its_page(tmp_path, open_page):
    """Killed and started again on its port: the page says it is gone, and then goes on."""
    from playwright.sync_api import expect  # noqa: PLC0415

    with Console(tmp_path) as console:
        page = open_page(console, viewport={"width": 390, "height": 800}, color_scheme="dark")
        port = console.port
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        console.end(signal.SIGKILL)
        expect(page.locator("#lost")).to_be_visible()
    with Console(tmp_path, port=port):
        expect(page.locator("#lost")).to_be_hidden()
        expect(page.locator("#who")).to_contain_text("You operate")
