"""The wheel laws of the board, as its own table (laws.def) names them."""

from __future__ import annotations

from hil.board._firmware import wheel_laws
from hil.core.errors import BadInput

_table = wheel_laws()
# Value of the board's parameter LAW by the law's name; the first is what a board starts with.
WHEEL_LAWS: dict[str, float] = {law.name: law.value for law in _table}
# The two that ship for the matrix of outer and wheel law, the benchmark first.
MATRIX: tuple[str, str] = ("pid", "asg-ism")
SUMMARIES: dict[str, str] = {law.name: law.doc for law in _table}


def require_wheel_law(name: str) -> str:
    """Return the name of a wheel law; raises BadInput with those there are."""
    if name not in WHEEL_LAWS:
        known = " or ".join(WHEEL_LAWS)
        raise BadInput(f"inner law {name!r}: the board has none of this name; choose {known}")
    return name
