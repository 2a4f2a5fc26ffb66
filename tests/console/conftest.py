"""A served twin with its console, Chromium, and pages in it that fail for whatever the browser objects to."""

from __future__ import annotations

import re

import pytest

from tests.console.rig import PATIENCE_S, Console, browser, served_twin

# What Chromium says of a server that is gone; anything else, the content security policy first, is a fault.
ORDINARY = re.compile("WebSocket|Failed to load resource: net::ERR_CONNECTION")


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """Serve a twin, and a console that begins with it."""
    work = tmp_path_factory.mktemp("browser")
    with (
        served_twin(work, "--camera", "pose") as (target, camera),
        Console(work, "--on", target, "--camera", camera) as console,
    ):
        yield console


@pytest.fixture(scope="session")
def chromium():
    """One browser for all."""
    with browser() as started:
        yield started


@pytest.fixture
def open_page(chromium):
    """Return what opens a console in a page of its own, and fails for anything the browser objects to."""
    from playwright.sync_api import expect  # noqa: PLC0415 - where there is a browser

    expect.set_options(timeout=PATIENCE_S * 1e3)
    objections: list[str] = []
    contexts = []

    def opened(console, **options):
        context = chromium.new_context(**options)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(PATIENCE_S * 1e3)
        page.on("pageerror", lambda error: objections.append(str(error)))
        page.on(
            "console",
            lambda said: (
                objections.append(said.text)
                if said.type == "error" and not ORDINARY.search(said.text)
                else None
            ),
        )
        page.goto(console.address)
        expect(page.locator('#law option[value="asg-ism"]')).to_have_count(1)
        return page

    yield opened
    for context in contexts:
        context.close()
    assert objections == []
