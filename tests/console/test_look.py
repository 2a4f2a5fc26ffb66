"""How the page looks and is used: WCAG 2.2 AA by axe-core in both themes, by keyboard alone, on a phone."""

from __future__ import annotations

import pytest

from tests.console.rig import CHROMIUM, NO_CHROMIUM, Console

pytestmark = [pytest.mark.realtime, pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)]
RULES = {
    "runOnly": {"type": "tag", "values": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]}
}
PAGES = ("run", "records", "setup", "campaigns")


@pytest.fixture(scope="module")
def console(tmp_path_factory):
    """Serve a console with a run of which a report is shown."""
    with Console(tmp_path_factory.mktemp("look")) as started:
        yield started


def violations(page):
    """Return what axe-core objects to: rule, place and why."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    found = axe.run(page, options=RULES).response["violations"]
    return [
        (item["id"], node["target"], node["failureSummary"].splitlines()[1:2])
        for item in found
        for node in item["nodes"]
    ]


def run_and_tune(page):
    """Have a run on the page, with everything that only a run shows."""
    from playwright.sync_api import expect  # noqa: PLC0415 - where there is a browser

    page.uncheck("#real-time")
    page.click("#arm")
    page.click("#start")
    expect(page.locator("#report-box")).to_be_visible()
    for summary in page.locator("#part-run summary").all():
        summary.click()


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_every_page_meets_wcag_aa(console, open_page, theme):
    """No violation on any page, wide and as wide as a phone; a text of poor contrast is one."""
    page = open_page(console, viewport={"width": 1280, "height": 900}, color_scheme=theme)
    run_and_tune(page)
    for width in (1280, 390):
        page.set_viewport_size({"width": width, "height": 900})
        for name in PAGES:
            page.evaluate("(name) => { location.hash = name; }", name)
            page.locator(f"#part-{name}").wait_for()
            assert violations(page) == [], (theme, width, name)
            assert page.evaluate("document.documentElement.scrollWidth") <= width, (name, width)
    page.evaluate("document.querySelector('h2').style.color = 'rgb(128, 128, 128)'")
    page.evaluate("location.hash = 'run'")
    page.locator("#part-run").wait_for()
    assert {rule for rule, _, _ in violations(page)} == {"color-contrast"}


def test_a_run_by_keyboard_alone(console, open_page):
    """Tab reaches everything in order; each focus is seen; Enter arms and starts; the space bar stops."""
    from playwright.sync_api import expect  # noqa: PLC0415

    page = open_page(console)
    expect(page.locator("#arm")).to_be_enabled()
    page.evaluate("document.activeElement.blur()")
    reached = []

    def tab_to(wanted):
        for _ in range(60):
            page.keyboard.press("Tab")
            focus = page.evaluate(
                "() => { const e = document.activeElement, s = getComputedStyle(e);"
                " return [e.id || e.className || e.getAttribute('href'), s.outlineStyle]; }"
            )
            reached.append(focus[0])
            assert focus[1] != "none", f"no focus to be seen on {focus[0]}"
            if focus[0] == wanted:
                return
        raise AssertionError(f"{wanted} is not reached by Tab: {reached}")

    tab_to("skip")
    tab_to("scenario")
    tab_to("arm")
    page.keyboard.press("Enter")
    expect(page.locator("#start")).to_be_enabled()
    tab_to("start")
    page.keyboard.press("Enter")
    # Events of the run before are there until this one begins.
    expect(page.locator("#phase")).to_have_text("running")
    expect(page.locator("#events")).to_contain_text("board: armed")
    page.keyboard.press("Space")
    expect(page.locator("#outcome")).to_contain_text("Stopped.")
    assert reached.index("stop") < reached.index("scenario")
