"""Takes the pictures of docs/console.md in Chromium: `python -m tests.console.pictures`."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from tests.console.rig import PATIENCE_S, Console, browser

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


def main() -> None:
    """Run both laws, one of them watched; compare them; calibrate a lens; watch on a phone."""
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
        expect(page.locator("#law option")).to_have_count(3)
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
    for file in sorted(FOLDER.glob("*.webp")):
        print(f"{file}: {file.stat().st_size} bytes")


if __name__ == "__main__":
    main()
