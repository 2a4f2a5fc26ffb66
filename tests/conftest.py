"""Settings shared by all tests."""

from __future__ import annotations

import os
import signal

import pytest

from hil.core.registries import BY_KIND
from hil.core.registry import Entry

# Commands that tests run do not write into the summary of the CI job that runs the tests.
os.environ.pop("GITHUB_STEP_SUMMARY", None)

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def pytest_configure() -> None:
    """Take signals as a terminal gives them: background jobs and `nohup` begin with some ignored."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Fail the run when anything was skipped and HIL_NO_SKIPS is set (as in CI)."""
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    skipped = reporter.stats.get("skipped", []) if reporter is not None else []
    if skipped and exitstatus == 0 and os.environ.get("HIL_NO_SKIPS"):
        reporter.write_line(
            f"{len(skipped)} tests were skipped: HIL_NO_SKIPS asks for all", red=True
        )
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def _of_another_module(entry: Entry, name: str) -> bool:
    """Say whether another module of tests made it known when it was imported, which is before all tests."""
    return entry.origin.startswith("module tests.") and entry.origin != f"module {name}"


@pytest.fixture(autouse=True, scope="module")
def _as_before_the_module(request: pytest.FixtureRequest):
    """Know what is built in and what this module made known; forget the rest, and signal handlers.

    Which modules one process imports, and in which order they run, is not the same in each run.
    """
    kept = {kind: dict(registry._entries) for kind, registry in BY_KIND.items() if registry.names()}
    for kind, entries in kept.items():
        BY_KIND[kind]._entries = {
            name: entry
            for name, entry in entries.items()
            if not _of_another_module(entry, request.module.__name__)
        }
    handlers = {number: signal.getsignal(number) for number in _SIGNALS}
    yield
    for kind, entries in kept.items():
        BY_KIND[kind]._entries = entries
    for number, handler in handlers.items():
        signal.signal(number, handler)
