"""Takes the pictures of docs/console.md in Chromium: `python -m tests.console.pictures`."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from tests.console.rig import PATIENCE_S, Console, began_bring_up, browser, film, served_twin

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "console"
CHESSBOARD = Path(__file__).parents[1] / "data" / "chessboard"
_QUALITY = 60


def keep(page: Any, name: str) -> None:
    """Write what a page shows as WebP, about 40 kB."""
    raw = np.frombuffer(page.screenshot(), np.uint8)
    image = cv2.imdecode(raw, cv2.IMREAD_COLOR)
    assert image is not None
    FOLDER.mkdir(exist_ok=True)
    cv2.imwrite(str(FOLDER / f"{name}.webp"), image, [cv2.IMWRITE_WEBP_QUALITY, _QUALITY])


def start(page: Any, law: str) -> None:
    """Arm and start scenario 1 with a law."""
    page.select_option("#law", law)
    page.click("#arm")
    page.click("#start")


def tuned(chromium: Any, expect: Any) -> None:
    """Tune on a served twin: three steps, a gain changed between them."""
    with (
        tempfile.TemporaryDirectory() as work,
        served_twin(Path(work), "--camera", "pose") as (target, camera),
        Console(Path(work), "--on", target, "--camera", camera) as console,
    ):
        page = chromium.new_page(viewport={"width": 1280, "height": 860})
        page.set_default_timeout(PATIENCE_S * 1e3)
        page.goto(console.address)
        page.locator("#changes summary").click()
        for key, value in {
            "duration_s": 90,
            "safety.pose_lost_s": 9,
            "safety.link_lost_s": 9,
        }.items():
            page.fill("#setting", key)
            page.fill("#setting-value", str(value))
            page.click("#setting-add")
        page.click("#start")
        page.click("#arm")
        page.locator("#tune summary").click()
        expect(page.locator("#phase")).to_have_text("running")
        page.wait_for_timeout(8000)
        for gain in (None, "2.5", "1.2"):
            if gain is not None:
                page.fill('[data-key="law.k1_s"]', gain)
                page.locator('[data-key="law.k1_s"]').blur()
            page.click("#step")
            page.wait_for_timeout(6500)
        page.locator("#tune").evaluate("(part) => part.scrollIntoView()")
        page.wait_for_timeout(500)
        keep(page, "tuning")
        page.close()


def set_up(chromium: Any, expect: Any) -> None:
    """Bring a robot on blocks up as far as its right side; look at a board."""
    with (
        tempfile.TemporaryDirectory() as work,
        served_twin(Path(work), "--camera", "pose", "--set", "robot.variant=lifted") as (
            target,
            camera,
        ),
        Console(Path(work), "--on", target, "--camera", camera) as console,
    ):
        views = [cv2.imread(str(file)) for file in sorted(CHESSBOARD.glob("left*.jpg"))]
        film(Path(work) / "board.avi", [view for view in views if view is not None], each=40)
        page = chromium.new_page(viewport={"width": 1280, "height": 720})
        page.set_default_timeout(PATIENCE_S * 1e3)
        page.goto(console.address)
        page.click("nav a[href='#setup']")
        expect(page.locator("#b-target")).to_have_value(target)
        assert began_bring_up(page, 30)
        page.click('[data-answer="go"]')
        page.click('[data-answer="left forward"]')
        page.click('[data-answer="go"]')
        page.locator('[data-answer="right forward"]').wait_for()
        page.locator("#b-ready").evaluate("(box) => box.scrollIntoView({block: 'center'})")
        page.evaluate("scrollBy(0, 220)")
        page.wait_for_timeout(500)
        keep(page, "bring-up")
        page.click("#stop")
        page.fill("#s-board", "chess:10x7:25")
        page.fill("#c-source", "board.avi")
        page.click("#c-open")
        expect(page.locator("#c-views li").nth(2)).to_be_visible()
        expect(page.locator("#c-said")).to_contain_text("54 corners")
        page.locator("#c-open").evaluate("(button) => button.scrollIntoView({block: 'start'})")
        page.evaluate("scrollBy(0, -80)")
        page.wait_for_timeout(500)
        keep(page, "camera")
        page.close()


def main() -> None:
    """Run both laws, one of them watched; compare them; calibrate a lens; watch on a phone; tune; set up."""
    from playwright.sync_api import expect  # noqa: PLC0415 - where there is a browser

    expect.set_options(timeout=PATIENCE_S * 1e3)
    with (
        tempfile.TemporaryDirectory() as work,
        Console(Path(work)) as console,
        browser() as chromium,
    ):
        page = chromium.new_page(viewport={"width": 1280, "height": 860})
        page.set_default_timeout(PATIENCE_S * 1e3)
        page.goto(console.address)
        expect(page.locator('#law option[value="asg-ism"]')).to_have_count(1)
        start(page, "asg-ism")
        expect(page.locator("#events")).to_contain_text("board: armed")
        page.wait_for_timeout(3500)
        keep(page, "run")
        phone = chromium.new_page(viewport={"width": 390, "height": 780}, color_scheme="dark")
        phone.goto(console.address)
        expect(phone.locator("#facts")).to_contain_text("Battery")
        phone.locator("#live").evaluate("(live) => live.scrollIntoView()")
        phone.wait_for_timeout(500)
        keep(phone, "phone")
        phone.close()
        expect(page.locator("#report-box")).to_be_visible()
        page.uncheck("#real-time")
        start(page, "pid")
        expect(page.locator("#outcome")).to_contain_text("-pid-")
        expect(page.locator("#report-box")).to_be_visible()
        page.click("nav a[href='#records']")
        expect(page.locator("#r-rows tr")).to_have_count(2)
        for box in page.locator("#r-rows input").all():
            box.check()
        keep(page, "records")
        page.click("#r-compare")
        expect(page.frame_locator("#r-frame").locator("body")).to_contain_text("pid")
        page.wait_for_timeout(1500)
        keep(page, "compare")
        page.click("nav a[href='#setup']")
        page.set_input_files("#s-lens-files", sorted(CHESSBOARD.glob("left*.jpg")))
        page.fill("#s-board", "chess:10x7:25")
        expect(page.locator("#s-lens-have")).to_contain_text("13 here")
        page.click("#s-lens")
        expect(page.locator("#s-lens-said img")).to_be_visible()
        page.wait_for_timeout(800)
        page.locator("#s-board").evaluate("(field) => field.scrollIntoView({block: 'center'})")
        keep(page, "lens")
        tuned(chromium, expect)
        set_up(chromium, expect)
    for file in sorted(FOLDER.glob("*.webp")):
        print(f"{file}: {file.stat().st_size} bytes")


if __name__ == "__main__":
    main()
