"""Whatever a test loads from a file is forgotten after it."""

from __future__ import annotations

import pytest

from hil.core.registries import BY_KIND


@pytest.fixture(autouse=True)
def _as_before():
    """Restore every registry."""
    kept = {kind: dict(registry._entries) for kind, registry in BY_KIND.items() if registry.names()}
    yield
    for kind, entries in kept.items():
        BY_KIND[kind]._entries = entries
