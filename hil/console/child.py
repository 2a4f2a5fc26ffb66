"""A process of the console's own that is told things, a line of JSON each, and says things back."""

from __future__ import annotations

import asyncio
import json
import sys
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from hil.core.errors import BadInput

Ordered = TypeVar("Ordered", bound=BaseModel)


def ordered(model: type[Ordered], tree: object, what: str) -> Ordered:
    """Return what a page ordered, checked; raises BadInput that begins with `what` and names the key."""
    try:
        return model.model_validate(tree)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        raise BadInput(f"{what}: {key}: {first['msg']}") from None


async def begin(module: str, work: Path) -> asyncio.subprocess.Process:
    """Start `python -m MODULE` in a folder, out of reach of the terminal's signals."""
    return await asyncio.create_subprocess_exec(
        sys.executable, "-m", module, cwd=work,
        stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, start_new_session=True,
    )  # fmt: skip


def tell(process: asyncio.subprocess.Process | None, tree: object) -> None:
    """Tell a process something; one that is gone, or ending, hears nothing."""
    if process is not None and process.stdin is not None and not process.stdin.is_closing():
        process.stdin.write(json.dumps(tree).encode() + b"\n")
