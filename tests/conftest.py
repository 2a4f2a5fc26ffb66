"""Settings shared by all tests."""

from __future__ import annotations

import os
import signal

import pytest

from hil.core.registries import BY_KIND

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


@pytest.fixture(autouse=True, scope="module")
def _as_before_the_module():
    """Forget after each module what its tests and fixtures made known by name, and signal handlers."""
    kept = {kind: dict(registry._entries) for kind, registry in BY_KIND.items() if registry.names()}
    handlers = {number: signal.getsignal(number) for number in _SIGNALS}
    yield
    for kind, entries in kept.items():
        BY_KIND[kind]._entries = entries
    for number, handler in handlers.items():
        signal.signal(number, handler)
