"""A console in a process of its own, pages that are only a socket, a served twin, and Chromium."""

from __future__ import annotations

import contextlib
import http.client
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self
from urllib.parse import urlencode, urlsplit

import cv2
import pytest
from websockets.sync.client import ClientConnection, connect

HIL = [sys.executable, "-m", "hil"]
CHROMIUM = shutil.which("chromium")
NO_CHROMIUM = "needs Debian's chromium (apt install chromium)"
CHROMIUM_OPTIONS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
]  # fmt: skip
# A shared machine may need this long for what takes one or two seconds.
PATIENCE_S = 90.0


class Console:
    """`hil console` over a records folder, on a port that is free."""

    def __init__(self, work: Path, *options: str, port: int = 0) -> None:
        self.work = work
        self.records = work / "runs"
        self._process = subprocess.Popen(
            [*HIL, "console", "--no-browser", "--port", str(port), *options],
            cwd=work, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert self._process.stdout is not None
        self.address = self._process.stdout.readline().strip()
        parts = urlsplit(self.address)
        assert parts.port, self._process.communicate(timeout=10)[1]
        self.host, self.port = f"127.0.0.1:{parts.port}", parts.port
        self.origin = f"http://{self.host}"
        self.token = parts.query.removeprefix("token=")
        self.cookie = f"hil_console_{self.port}={self.token}"

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, _type: type[BaseException] | None, _e: BaseException | None, _t: TracebackType | None
    ) -> None:
        self.end()

    def end(self, number: int = signal.SIGTERM) -> int:
        """End it by a signal and return its status."""
        if self._process.poll() is None:
            self._process.send_signal(number)
        self._process.communicate(timeout=60)
        return self._process.returncode

    def ask(
        self, path: str, query: Any = (), *, method: str = "GET", body: Any = None, **headers: str
    ) -> tuple[int, dict[str, str], bytes]:
        """Send one request as the page would; headers given replace the page's."""
        sent = {"Host": self.host, "Cookie": self.cookie, "Origin": self.origin}
        sent |= {name.replace("_", "-"): value for name, value in headers.items()}
        client = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        data = body if isinstance(body, bytes) or body is None else json.dumps(body).encode()
        where = f"{path}?{urlencode(query)}" if query else path
        client.putrequest(method, where, skip_host=True, skip_accept_encoding=True)
        for name, value in sent.items():
            if value:
                client.putheader(name, value)
        client.putheader("Content-Length", str(len(data or b"")))
        client.endheaders(data)
        answer = client.getresponse()
        found = {name.lower(): value for name, value in answer.getheaders()}
        said = answer.read()
        client.close()
        return answer.status, found, said

    def get(self, path: str, query: Any = ()) -> Any:
        """Return the JSON that the console answers."""
        status, _, said = self.ask(path, query)
        assert status == 200, said
        return json.loads(said)

    def send(self, path: str, body: Any, page: str, query: Any = ()) -> tuple[int, Any]:
        """Send what changes something, as the page `page`."""
        status, _, said = self.ask(path, query, method="POST", body=body, X_Console_Page=page)
        return status, json.loads(said)

    def page(self, key: str) -> SocketPage:
        """Return a page that is no more than its socket."""
        return SocketPage(self, key)


class SocketPage:
    """What a page says and hears."""

    def __init__(self, console: Console, key: str) -> None:
        self.key = key
        self._entered = connect(
            f"ws://{console.host}/ws?{urlencode({'page': key})}", origin=console.origin,  # type: ignore[arg-type]
            additional_headers={"Cookie": console.cookie},
        )  # fmt: skip
        self.socket: ClientConnection = self._entered.__enter__()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, _type: type[BaseException] | None, _e: BaseException | None, _t: TracebackType | None
    ) -> None:
        self.socket.close()

    def say(self, **message: Any) -> None:
        """Say something."""
        self.socket.send(json.dumps(message))

    def hear(self, timeout_s: float = PATIENCE_S) -> Any:
        """Return the next message; a picture as bytes."""
        said = self.socket.recv(timeout=timeout_s)
        return said if isinstance(said, bytes) else json.loads(said)

    def until(self, kind: str, **wanted: Any) -> list[Any]:
        """Return all messages up to the first of a kind that has these values."""
        heard: list[Any] = []
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s:
            message = self.hear()
            heard.append(message)
            if not isinstance(message, dict) or message["kind"] != kind:
                continue
            if all(message.get(name) == value for name, value in wanted.items()):
                return heard
        raise AssertionError(f"{kind} {wanted} did not come: {heard[-3:]}")

    def begin(self, **order: Any) -> None:
        """Arm and start, and wait until it is under way."""
        real = str(order.get("target", "")).startswith("serial:")
        if not real:
            self.say(do="arm", wanted=True)
        self.say(do="start", order=order)
        self.until("state", phase="starting")
        if real:  # found first, then armed
            self.until("state", phase="ready")
            self.say(do="arm", wanted=True)

    def ticks(self) -> list[Any]:
        """Wait for ticks; return their rows."""
        while True:
            if rows := self.until("live")[-1].get("trail"):
                return list(rows)

    def run(self, **order: Any) -> list[Any]:
        """Arm, start, and return all that was heard up to the end of the run."""
        self.begin(**order)
        return self.until("state", phase="ended")


@contextlib.contextmanager
def served_twin(folder: Path, *options: str) -> Iterator[tuple[str, str]]:
    """Serve a twin in real time; yield the target and the camera to meet it."""
    port, frames = folder / "board", folder / "camera.sock"
    server = subprocess.Popen(
        [*HIL, "twin", "serve", *options, "--pty", str(port), "--frames", str(frames)],
        stderr=subprocess.DEVNULL,
    )
    try:
        end_s = time.monotonic() + PATIENCE_S
        while not frames.exists() and time.monotonic() < end_s:
            time.sleep(0.05)
        yield f"serial:{port}", f"twin:{frames}"
    finally:
        server.send_signal(signal.SIGINT)
        server.wait(timeout=20)


def film(path: Path, pictures: Sequence[Any], each: int = 10) -> None:
    """Write pictures as a video of 10 frames a second, each of them shown `each` times."""
    height, width = pictures[0].shape[:2]
    out = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10, (width, height))
    for picture in pictures:
        for _ in range(each):
            out.write(picture)
    out.release()


def began_bring_up(page: Any, tries: int = 12) -> bool:
    """Begin a bring-up and see its first question; False where this machine is too busy for its link."""
    for _ in range(tries):
        page.check("#b-ready")
        page.click("#b-begin")
        page.locator("#b-end .banner").wait_for(state="detached")
        page.locator('[data-answer="go"], #b-end .banner').first.wait_for()
        if page.locator('[data-answer="go"]').count():
            return True
        page.locator("#b-begin:enabled").wait_for()
    return False


@contextlib.contextmanager
def browser() -> Iterator[Any]:
    """Start the system's Chromium; skipped where there is none."""
    if CHROMIUM is None:
        pytest.skip(NO_CHROMIUM)
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 - where there is a browser

    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=CHROMIUM_OPTIONS)
        yield started
        started.close()


def is_gone(pid: int) -> bool:
    """Say whether a process has ended."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    return False
