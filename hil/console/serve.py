"""Starts the console: the port, the address with its token, the browser."""

from __future__ import annotations

import ipaddress
import socket
import sys
import webbrowser
from pathlib import Path

import uvicorn

from hil.console.access import LOOPBACK, Gate, kept_token
from hil.console.folders import Folders
from hil.console.server import application
from hil.core.errors import BadInput


def serve(
    host: str, port: int, folders: Folders, begins_with: tuple[str, str], *, browser: bool
) -> None:
    """Serve until Ctrl-C; the address goes to stdout. Raises BadInput for a port that is in use."""
    folders.make()
    try:
        token = kept_token(folders.own)
    except OSError as error:
        raise BadInput(f"--records {folders.root}: {error.strerror or error}") from None
    listener = _listener(host, port)
    port = listener.getsockname()[1]
    gate = Gate(token, port, _names(host))
    shown = f"[{host}]" if ":" in host else host
    address = f"http://{shown}:{port}/?token={token}"
    config = uvicorn.Config(
        application(folders, gate, begins_with), log_level="warning",
        ws="websockets-sansio", ws_max_size=65536,
        ws_ping_interval=5.0, ws_ping_timeout=10.0, lifespan="on", server_header=False,
        timeout_graceful_shutdown=3,
    )  # fmt: skip
    print(address, flush=True)
    if not _is_loopback(host):
        print("hil console: others on this network can reach this address; give it to nobody else",
              file=sys.stderr)  # fmt: skip
    if browser:
        webbrowser.open(address)
    uvicorn.Server(config).run(sockets=[listener])


def _listener(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen(100)
    except (OSError, OverflowError) as error:
        listener.close()
        why = getattr(error, "strerror", None) or str(error)
        raise BadInput(
            f"console: {host} port {port}: {why}; choose another --port, or 0 for any"
        ) from None
    return listener


def _is_loopback(host: str) -> bool:
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _names(host: str) -> tuple[str, ...]:
    """Return the names under which this server is asked for."""
    if host in {"0.0.0.0", "::"}:  # every address of this machine
        found = {info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None)}
        return (*LOOPBACK, socket.gethostname().lower(), *(str(name) for name in found))
    return (
        tuple(dict.fromkeys((*LOOPBACK, host.lower()))) if _is_loopback(host) else (host.lower(),)
    )


def start(
    host: str, port: int, records: Path, begins_with: tuple[str, str], *, browser: bool
) -> None:
    """Serve a records folder, with the present folder as that of the user's own files.

    The Run page `begins_with` a target and a camera.
    """
    serve(host, port, Folders(records.resolve(), Path.cwd()), begins_with, browser=browser)
