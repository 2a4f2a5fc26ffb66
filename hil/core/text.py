"""Text of others as a person may read it: as it was typed, with what would not show made visible."""

from __future__ import annotations

import unicodedata

# Control, format (bidirectional marks too), surrogate and unassigned characters, line separators.
_HIDDEN = frozenset({"Cc", "Cf", "Cs", "Cn", "Zl", "Zp"})


def visible(text: str) -> str:
    """Return one line in which every character shows: line ends and controls become escapes."""
    if text.isprintable():
        return text
    return "".join(_escaped(c) if unicodedata.category(c) in _HIDDEN else c for c in text)


def _escaped(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")


def is_plain_name(text: str) -> bool:
    """Say whether a text can name a file: one part of a path, every character visible."""
    return visible(text) == text and text.strip(" .") == text != "" and not set("/\\") & set(text)
