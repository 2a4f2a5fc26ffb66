"""What a page sends and is answered: JSON, with one line of what is wrong."""

from __future__ import annotations

from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from hil.console.people import encoded
from hil.core.errors import BadInput


def answer_json(tree: Any, status: int = 200) -> Response:
    """Return a JSON answer."""
    return Response(encoded(tree), status, media_type="application/json")


def number(text: str, default: int, low: int, high: int) -> int:
    """Return a number of a query, within bounds."""
    return min(max(int(text), low), high) if text.isdecimal() and len(text) < 9 else default


async def body_of(request: Request) -> dict[str, Any]:
    """Return the JSON object that a page sent; raises BadInput."""
    try:
        tree = await request.json()
    except (ValueError, RecursionError):
        raise BadInput("not understood: no JSON") from None
    if not isinstance(tree, dict):
        raise BadInput("not understood: no table")
    return tree


def names_of(tree: dict[str, Any]) -> list[str]:
    """Return the names of records in what a page sent, each once; raises BadInput."""
    names = tree.get("names")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise BadInput("not understood: names of records are wanted")
    return list(dict.fromkeys(names))
