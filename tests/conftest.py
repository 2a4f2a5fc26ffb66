"""Settings shared by all tests."""

from __future__ import annotations

import os
import signal

import pytest


def pytest_configure() -> None:
    """Take Ctrl-C as a terminal gives it: a shell's background jobs begin with it ignored."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Fail the run when anything was skipped and HIL_NO_SKIPS is set (as in CI)."""
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    skipped = reporter.stats.get("skipped", []) if reporter is not None else []
    if skipped and exitstatus == 0 and os.environ.get("HIL_NO_SKIPS"):
        reporter.write_line(
            f"{len(skipped)} tests were skipped: HIL_NO_SKIPS asks for all", red=True
        )
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
