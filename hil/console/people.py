"""Who looks at the console: one operator, any number of viewers, and what waits for each of them.

Each page has one slot for each kind of message, which the newest takes: a page that reads slowly, or has
gone without a word, holds nothing and nobody up. Only the operator starts and changes things; STOP is
for all.
"""

from __future__ import annotations

import asyncio
import json
import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np

# A page that is loaded again, or whose network was away, is the operator still for this long.
GRACE_S = 10.0
# Ticks that a page which lags gets with the newest frame; older ones are left out of its charts.
_TRAIL_ROWS = 240

Message = dict[str, Any]


class Page:
    """One open page; `key` is its own, the same after a reload."""

    def __init__(self, key: str) -> None:
        self.key = key
        self._slots: dict[str, Message | bytes] = {}
        self._filled = asyncio.Event()

    def put(self, kind: str, message: Message | bytes) -> None:
        """Put the newest message of a kind into its slot."""
        waiting = self._slots.pop(kind, None)
        if kind == "live" and isinstance(waiting, dict) and isinstance(message, dict):
            rows = [*waiting.get("trail", ()), *message.get("trail", ())][-_TRAIL_ROWS:]
            events = [*waiting.get("events", ()), *message.get("events", ())][-_TRAIL_ROWS:]
            message = waiting | message | {"trail": rows, "events": events}
        self._slots[kind] = message
        self._filled.set()

    async def take(self) -> str | bytes:
        """Return the message that waits longest, as it goes over the socket."""
        while not self._slots:
            self._filled.clear()
            await self._filled.wait()
        kind = next(iter(self._slots))
        message = self._slots.pop(kind)
        return message if isinstance(message, bytes) else encoded({"kind": kind, **message})


def encoded(tree: Any) -> str:
    """Return JSON as browsers take it: null for a number that is none."""
    return json.dumps(plain(tree), separators=(",", ":"), allow_nan=False)


def plain(tree: Any) -> Any:
    """Return a tree with null for every number that is none, and plain lists."""
    if isinstance(tree, float):
        return tree if math.isfinite(tree) else None
    if isinstance(tree, dict):
        return {str(key): plain(value) for key, value in tree.items()}
    if isinstance(tree, list | tuple):
        return [plain(value) for value in tree]
    if isinstance(tree, np.generic):
        return plain(tree.item())
    return tree


class People:
    """The open pages, and which of them is the operator's."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self.in_a_run: Callable[[], bool] = lambda: False
        self.pages: set[Page] = set()
        self._operator = ""
        self._gone_s = -math.inf  # since when no page of the operator is open

    @property
    def operator(self) -> str:
        """Return the operator's key, "" when there is none: gone for good, or gone while nothing runs."""
        gone = self._operator and not self._open(self._operator)
        if gone and (not self.in_a_run() or self._clock() - self._gone_s > GRACE_S):
            return ""
        return self._operator

    def _open(self, key: str) -> bool:
        return any(page.key == key for page in self.pages)

    def came(self, page: Page) -> None:
        """Take a page that was opened; the first one is the operator's."""
        self.pages.add(page)
        if not self.operator:
            self._operator = page.key
        self.tell_who()

    def went(self, page: Page) -> None:
        """Take note that a page has gone."""
        self.pages.discard(page)
        if page.key == self._operator and not self._open(page.key):
            self._gone_s = self._clock()
        self.tell_who()

    def take_over(self, page: Page) -> bool:
        """Make a page the operator's where there is none; return whether it is."""
        if not self.operator:
            self._operator = page.key
        self.tell_who()
        return self._operator == page.key

    def let_go(self, page: Page) -> None:
        """Let somebody else be the operator."""
        if page.key == self._operator:
            self._operator = ""
        self.tell_who()

    def tell_who(self) -> None:
        """Tell every page whether it is the operator's."""
        operator, count = self.operator, len({page.key for page in self.pages})
        for page in self.pages:
            page.put(
                "who",
                {"operator": page.key == operator, "taken": bool(operator), "pages": count},
            )

    def tell(self, kind: str, message: Message | bytes) -> None:
        """Put a message into every page's slot."""
        for page in self.pages:
            page.put(kind, message)
