"""What the board says when it does not take a set-point."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hil.wire.link import StatusText

# Begin of what the board says of a set-point that it does not take (texts.def); as an error where
# the value is at fault, as a warning where one came late or too early.
_REFUSED = "set-point refused"
_SEVERITY_ERROR = 3  # MAV_SEVERITY_ERROR


def refused_set_point(text: StatusText) -> str:
    """Return what the board said when it refused the value of a set-point, "" for other texts."""
    refused = text.severity <= _SEVERITY_ERROR and text.text.startswith(_REFUSED)
    return text.text if refused else ""
