"""The file of a signing key: 64 hexadecimal digits on one line, for its owner alone to read."""

from __future__ import annotations

import hashlib
import os
import secrets
import stat
from pathlib import Path

from hil.core.errors import BadInput
from hil.wire.signing import KEY_BYTES, Key

# Names the key file of real boards where no option does.
ENVIRONMENT = "HIL_KEY"
_MOST_BYTES = 200
_OWNER_ONLY = 0o600


def read_key(path: Path) -> Key:
    """Return the key in a file; raises BadInput for one that is none, or that others may read."""
    try:
        with path.open("rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            text = file.read(_MOST_BYTES)
    except OSError as error:
        raise BadInput(
            f"key file {path}: cannot be read: {error.strerror}; make one with `hil firmware key new FILE`"
        ) from None
    if os.name == "posix" and mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise BadInput(
            f"key file {path}: others may read it (mode {stat.S_IMODE(mode):04o}); chmod 600 it, and make a "
            "new one if they did"
        )
    try:
        secret = bytes.fromhex(text.decode("ascii"))
    except ValueError:
        secret = b""
    if len(text) == _MOST_BYTES:  # something follows that was not looked at
        secret = b""
    if len(secret) != KEY_BYTES or not any(secret):
        raise BadInput(
            f"key file {path}: needs {2 * KEY_BYTES} hexadecimal digits, not all zero; make one with "
            "`hil firmware key new FILE`"
        )
    return Key(secret, str(path))


def new_key(path: Path, passphrase: str = "") -> None:
    """Write a key to a new file: drawn, or of a passphrase as MAVProxy makes it.

    Raises BadInput where there is a file already, or none can be made.
    """
    try:
        drawn = hashlib.sha256(passphrase.encode()).digest() if passphrase else None
    except UnicodeEncodeError:  # bytes of a terminal that are no text
        raise BadInput("passphrase: is no UTF-8 text; type it again") from None
    try:
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, _OWNER_ONLY)
    except FileExistsError:
        raise BadInput(f"key file {path}: is there already; name a new one") from None
    except OSError as error:
        raise BadInput(f"key file {path}: cannot be made: {error.strerror}") from None
    with os.fdopen(handle, "w", encoding="ascii") as file:
        file.write((drawn or secrets.token_bytes(KEY_BYTES)).hex() + "\n")


def key_of_environment() -> Key | None:
    """Return the key whose file HIL_KEY names, None without; raises BadInput."""
    name = os.environ.get(ENVIRONMENT)
    return read_key(Path(name)) if name else None
