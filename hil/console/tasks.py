"""Commands of `hil` that the page asks for: each in a process of its own, a few at a time."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hil.core.errors import BadInput

_AT_ONCE = 2
_LIMIT_S = 600.0


@dataclass(frozen=True, slots=True)
class Said:
    """How a command ended and what it said."""

    status: int
    out: str
    err: str

    def line(self) -> str:
        """Return what went wrong, in one line."""
        lines = (
            self.err.strip().splitlines() or self.out.strip().splitlines() or ["it said nothing"]
        )
        return lines[-1].removeprefix("hil: ")


class Tasks:
    """Runs commands; those beyond a few wait their turn."""

    def __init__(self, work: Path) -> None:
        self._work = work
        self._turn = asyncio.Semaphore(_AT_ONCE)

    async def hil(self, *words: str) -> Said:
        """Run `hil WORDS...` in the folder where the console was started."""
        return await self.module("hil", *words)

    async def module(self, module: str, *words: str) -> Said:
        """Run `python -m MODULE WORDS...`; raises BadInput for one that does not come to an end."""
        async with self._turn:
            process = await asyncio.create_subprocess_exec(
                sys.executable, "-m", module, *words,
                cwd=self._work, stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE,
                start_new_session=True,
            )  # fmt: skip
            try:
                out, err = await asyncio.wait_for(process.communicate(), _LIMIT_S)
            except TimeoutError:
                process.kill()
                raise BadInput(
                    f"{module} {' '.join(words[:2])}: not done after {_LIMIT_S:g} s"
                ) from None
            except asyncio.CancelledError:
                process.kill()
                raise
        return Said(
            process.returncode or 0, out.decode(errors="replace"), err.decode(errors="replace")
        )


def required(said: Said, good: Sequence[int] = (0,)) -> Said:
    """Return what a command said; raises BadInput with its own line when it went wrong."""
    if said.status not in good:
        raise BadInput(said.line())
    return said
