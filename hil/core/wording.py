"""Figures in messages."""

from __future__ import annotations

import math

DIGITS_MAX = 15


def past(value: float, limit: float, spec: str) -> str:
    """Return a figure that is past its limit, in as many digits as it takes to show it.

    `spec` is a format such as ".2f" or ".1%". A value of 1.004 beside a limit of 1 reads "1.004" and
    not "1.00", which would contradict the message that it stands in.
    """
    digits, kind = int(spec[1:-1]), spec[-1]
    scale = 100.0 if kind == "%" else 1.0
    if value == limit or not math.isfinite(value):
        return format(value, spec)
    text = format(value, spec)
    while digits < DIGITS_MAX:
        text = format(value, f".{digits}{kind}")
        shown, bound = float(text.rstrip("%")), limit * scale
        if (shown > bound) == (value > limit) and not math.isclose(shown, bound, rel_tol=1e-12):
            break
        digits += 1
    return text
