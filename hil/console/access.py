"""Who may speak to the console: a token in the address, the page's own origin, and nothing from elsewhere.

The token is shown once, in the address that the command prints; the page gets it as a cookie that no
script can read. A request must name this server as its host (a foreign name that resolves here would
let another site in) and, where it changes anything or opens the socket, come from the page itself.
"""

from __future__ import annotations

import os
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from hil.core.files import replace_file

TOKEN_FILE = "token"
_TOKEN_BYTES = 24
LOOPBACK = ("127.0.0.1", "localhost", "::1")

# Nothing from elsewhere, no script or style in the page's own text, in no other site's frame.
PAGE_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self'; frame-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
# A report is text of a record, which others may have made: it is shown and can do nothing.
REPORT_POLICY = (
    "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:; font-src data:; "
    "frame-ancestors 'self'"
)
HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}


def kept_token(folder: Path) -> str:
    """Return the token of a folder, made at the first call: open pages find a console started again.

    The file is readable by its owner alone. Raises OSError.
    """
    file = folder / TOKEN_FILE
    if file.is_file() and not file.is_symlink():
        kept = file.read_text(encoding="ascii", errors="replace").strip()
        if len(kept) >= _TOKEN_BYTES and kept.replace("-", "").replace("_", "").isalnum():
            os.chmod(file, 0o600)
            return kept
    token = secrets.token_urlsafe(_TOKEN_BYTES)
    replace_file(file, b"")
    os.chmod(file, 0o600)
    file.write_text(f"{token}\n", encoding="ascii")
    return token


@dataclass(frozen=True, slots=True)
class Gate:
    """What a request must show; `hosts` are the names under which this server is asked for."""

    token: str
    port: int
    hosts: tuple[str, ...] = LOOPBACK

    @property
    def cookie(self) -> str:
        """Return the name of the cookie; another port is another console."""
        return f"hil_console_{self.port}"

    def knows_host(self, host: str) -> bool:
        """Say whether a Host header names this server."""
        try:
            parts = urlsplit(f"//{host}")
            return parts.hostname in self.hosts and (parts.port or 80) == self.port
        except ValueError:
            return False

    def is_token(self, given: str) -> bool:
        """Say whether this is the token, in a time that tells nothing of it."""
        return secrets.compare_digest(given.encode(errors="replace"), self.token.encode())

    def refusal(
        self, headers: Mapping[str, str], cookies: Mapping[str, str], *, changes: bool
    ) -> str:
        """Return why a request is refused, "" when it is not.

        `changes` marks requests that change something, and the socket: they need the page's origin.
        """
        host = headers.get("host", "")
        if not self.knows_host(host):
            return "this console is asked for under another name"
        origin = headers.get("origin")
        if (changes or origin is not None) and origin != f"http://{host}":
            return "asked by another site"
        if not self.is_token(cookies.get(self.cookie, "")):
            return "no token; open the address that hil console printed"
        return ""
