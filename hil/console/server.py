"""The server: pages, the socket of the run, and what the pages ask for; everything from this package."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from importlib.resources import files
from typing import Any

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import HTTPConnection, Request
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from hil.console import campaign_routes, records, setup
from hil.console.access import HEADERS, PAGE_POLICY, Gate
from hil.console.answers import answer_json
from hil.console.bringup import BringUps
from hil.console.cameras import Cameras
from hil.console.campaigns import Campaigns
from hil.console.choices import choices, describe, is_built_in
from hil.console.folders import Folders
from hil.console.listing import Listing
from hil.console.live import Live, name_of
from hil.console.orders import order_of
from hil.console.people import Page, People
from hil.console.shared import Console
from hil.console.tasks import Tasks, required
from hil.console.tuning import write_tuned
from hil.core.errors import BadInput, HilError

_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}
_CLOSED = 4401
_WORDS = 80  # of a page's own key


class Guard:
    """Refuses whoever is not let in, and puts the headers on every answer."""

    def __init__(self, app: ASGIApp, gate: Gate) -> None:
        self._app = app
        self._gate = gate

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        asked = HTTPConnection(scope)
        is_socket = scope["type"] == "websocket"
        entering = scope["path"] == "/" and "token" in asked.query_params
        changes = is_socket or scope.get("method") not in {"GET", "HEAD"}
        why = self._gate.refusal(asked.headers, asked.cookies, changes=changes)
        if entering and not is_socket:
            await self._enter(asked)(scope, receive, _with_headers(send))
        elif why and is_socket:
            await WebSocket(scope, receive, send).close(_CLOSED, why)
        elif why:
            await PlainTextResponse(f"hil console: {why}\n", 403)(
                scope, receive, _with_headers(send)
            )
        else:
            await self._app(scope, receive, _with_headers(send))

    def _enter(self, asked: HTTPConnection) -> Response:
        """Take the token out of the address and into a cookie."""
        host = asked.headers.get("host", "")
        if not self._gate.knows_host(host) or not self._gate.is_token(asked.query_params["token"]):
            return PlainTextResponse("hil console: wrong token or host\n", 403)
        answer = RedirectResponse("/", 303)
        answer.set_cookie(
            self._gate.cookie, self._gate.token, httponly=True, samesite="strict", path="/"
        )
        return answer


def _with_headers(send: Send) -> Send:
    async def sender(message: Any) -> None:
        if message["type"] == "http.response.start":
            have = {name.lower() for name, _ in message["headers"]}
            own = HEADERS | {"Content-Security-Policy": PAGE_POLICY}
            message["headers"] += [
                (name.lower().encode(), value.encode())
                for name, value in own.items()
                if name.lower().encode() not in have
            ]
        await send(message)

    return sender


def said_plainly(
    answer: Callable[[Request, Console], Awaitable[Response]], *, changes: bool = False
) -> Callable[[Request], Awaitable[Response]]:
    """Return a route whose refusals are one line of text; those that change are the operator's alone."""

    async def route(request: Request) -> Response:
        console: Console = request.app.state.console
        if changes and request.headers.get("x-console-page", "") != console.people.operator:
            return answer_json({"error": "only the operator's page may do that"}, 409)
        try:
            return await answer(request, console)
        except HilError as error:
            return answer_json({"error": str(error)}, 400)
        except OSError as error:
            return answer_json({"error": f"{error.filename or ''}: {error.strerror or error}"}, 500)

    return route


async def _index(_request: Request, _console: Console) -> Response:
    return _static_file("index.html")


async def _static(request: Request, _console: Console) -> Response:
    return _static_file(request.path_params["name"])


def _static_file(name: str) -> Response:
    folder = files("hil.console") / "static"
    known = {item.name for item in folder.iterdir()}
    suffix = name[name.rfind(".") :]
    if name not in known or suffix not in _TYPES:
        return PlainTextResponse("no such file\n", 404)
    return Response((folder / name).read_bytes(), media_type=_TYPES[suffix])


async def _choices(_request: Request, console: Console) -> Response:
    found = await asyncio.to_thread(choices, console.folders)
    target, camera = console.begins_with
    return answer_json(found | {"target": target, "camera": camera})


async def _scenario(request: Request, console: Console) -> Response:
    name = request.query_params.get("name", "")
    if is_built_in(name):
        return answer_json(await asyncio.to_thread(describe, name))
    path = console.folders.work_file(name, ".toml")
    said = await console.tasks.module("hil.console.choices", str(path))
    return answer_json(json.loads(required(said).out))


async def _socket(socket: WebSocket) -> None:
    """Serve one page: what it says is taken, what is newest is sent."""
    console: Console = socket.app.state.console
    await socket.accept()
    page = Page(socket.query_params.get("page", "")[:_WORDS] or "nameless")
    console.people.came(page)
    console.live.greet(page)
    console.campaigns.greet(page)
    console.bringups.greet(page)
    console.cameras.greet(page)
    sending = asyncio.create_task(_send_newest(socket, page))
    try:
        while True:
            await _take(console, page, await socket.receive_text())
    except (WebSocketDisconnect, RuntimeError):
        pass
    finally:
        sending.cancel()
        console.people.went(page)


async def _send_newest(socket: WebSocket, page: Page) -> None:
    with contextlib.suppress(WebSocketDisconnect, RuntimeError, ConnectionError):
        while True:
            message = await page.take()
            if isinstance(message, bytes):
                await socket.send_bytes(message)
            else:
                await socket.send_text(message)


async def _take(console: Console, page: Page, text: str) -> None:
    """Do what a page says; what it may not do, or says wrongly, is told to it alone."""
    try:
        message = json.loads(text)
        do = message["do"]
        if do == "stop":  # anybody's
            console.live.stop(name_of(page, console.people))
            console.bringups.stop()
        elif do == "take":
            console.people.take_over(page)
        elif page.key != console.people.operator:
            page.put("said", {"error": "only the operator's page may do that"})
        elif do == "release":
            console.people.let_go(page)
        elif do in {"start", "bring-up"}:
            await _begin(console, do, message["order"])
        elif do == "look":
            await _look(console, message)
        elif do in _ORDERS:
            _ORDERS[do](console, message)
    except BadInput as error:
        page.put("said", {"error": str(error)})
    except OSError as error:
        page.put("said", {"error": f"{error.filename or ''}: {error.strerror or error}"})
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
        page.put("said", {"error": f"not understood: {type(error).__name__}"})


# What the operator orders besides: small things that are done at once.
_ORDERS: dict[str, Callable[[Console, dict[str, Any]], None]] = {
    "beat": lambda console, _: console.live.beat(),
    "arm": lambda console, told: console.live.arm(bool(told["wanted"])),
    "answer": lambda console, told: console.bringups.answer(told["value"]),
    "tune": lambda console, told: console.live.tuning.change(
        str(told["key"]), float(told["value"])
    ),
    "step": lambda console, told: console.live.tuning.step(float(told["x_m"]), float(told["y_m"])),
    "undo": lambda console, _: console.live.tuning.undo(),
}


async def _look(console: Console, message: dict[str, Any]) -> None:
    """Look at a camera, or do something with what is looked at."""
    what = message["what"]
    if what == "close":
        await console.cameras.close()
    elif what == "open":
        if console.live.busy:
            raise BadInput("a run is on and may have the camera: wait for its end")
        await console.cameras.open(message["camera"])
    else:
        console.cameras.order(message)


async def _begin(console: Console, what: str, order: object) -> None:
    """Begin a run or a bring-up, one at a time."""
    if console.live.busy or console.bringups.busy:
        raise BadInput("a run or a bring-up is on: STOP it first, or wait for its end")
    await console.cameras.close()  # a run may want the same one
    if what == "start":
        await console.live.start(order_of(order))
    else:
        await console.bringups.start(order)


def application(
    folders: Folders, gate: Gate, begins_with: tuple[str, str] = ("twin", "")
) -> Starlette:
    """Return the console over a records folder."""
    people = People()
    tasks = Tasks(folders.work)
    live = Live(folders, people)
    console = Console(
        folders, gate, people, live, Listing(folders), tasks,
        Campaigns(folders, people), BringUps(folders, people),
        Cameras(folders, people), begins_with,
    )  # fmt: skip

    @contextlib.asynccontextmanager
    async def lifespan(_app: Starlette) -> AsyncIterator[None]:
        reading = asyncio.create_task(asyncio.to_thread(console.listing.items))
        yield
        await reading
        await console.campaigns.close()
        await console.bringups.close()
        await console.cameras.close()
        await live.close()

    get = ["GET"]
    post = ["POST"]
    app = Starlette(
        lifespan=lifespan,
        middleware=[Middleware(Guard, gate=gate)],
        routes=[
            Route("/", said_plainly(_index), methods=get),
            Route("/static/{name}", said_plainly(_static), methods=get),
            WebSocketRoute("/ws", _socket),
            Route("/api/choices", said_plainly(_choices), methods=get),
            Route("/api/scenario", said_plainly(_scenario), methods=get),
            *[
                Route(path, said_plainly(answer), methods=get)
                for path, answer in _LOOKED_AT.items()
            ],
            *[
                Route(path, said_plainly(answer, changes=True), methods=post)
                for path, answer in _CHANGED.items()
            ],
        ],
    )
    app.state.console = console
    return app


async def _write_tuned(_request: Request, console: Console) -> Response:
    """Write what was changed in the run that is on, or was."""
    live = console.live
    if live.order is None or not live.tuning.moved():
        raise BadInput("tuning: nothing was changed, so that there is nothing to write")
    place = write_tuned(
        console.folders, live.order, live.begun["law"],
        live.begun["scenario"]["control"]["gain_set"], live.tuning.moved(),
    )  # fmt: skip
    return answer_json(
        {"file": console.folders.name_of(place), "text": place.read_text(encoding="utf-8")}
    )


_LOOKED_AT = records.LOOKED_AT | setup.LOOKED_AT | campaign_routes.LOOKED_AT
_CHANGED = (
    records.CHANGED | setup.CHANGED | campaign_routes.CHANGED | {"/api/write-tuned": _write_tuned}
)
