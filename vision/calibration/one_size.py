"""Board views of one sensor in pictures of several sizes, or turned, brought to one size.

Binned or scaled pictures have the aspect of the others: their corners are scaled. A portrait
picture among landscape ones was turned by a program (orientation tags are not followed); which way
is not in its pixels, so both are tried against the lens of the others. Pictures cropped to another
aspect show another part of the sensor, and which is not known: they are refused by name.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from hil.core.errors import BadInput
from vision.calibration.boards import BoardView

Array = NDArray[np.float64]
Size = tuple[int, int]  # width, height, px

# A picture halved from an odd size has lost half a pixel.
ROUNDED_PX = 1.0
NAMES_SHOWN = 4


@dataclass(frozen=True, slots=True)
class SizedView:
    """A view with the size of the picture it was found in."""

    view: BoardView
    size_px: Size


@dataclass(slots=True)
class OneSize:
    """Views at one size; `scaled` and `turned` say, a line each, what was done with which of them."""

    size_px: Size
    views: list[BoardView] = field(default_factory=list)
    scaled: list[str] = field(default_factory=list)
    turned: list[str] = field(default_factory=list)


def at_one_size(
    sized: Sequence[SizedView], judge: Callable[[list[BoardView], BoardView, Size], float]
) -> OneSize:
    """Return all views at the size that most pictures have, the larger of two as frequent.

    `judge` returns how far a view lies, in px, from the lens of other views of that size. Raises
    BadInput for pictures of another aspect.
    """
    counts = Counter(item.size_px for item in sized)
    landscape = sum(n for (width, height), n in counts.items() if width >= height)
    upright = 2 * landscape < len(sized)
    lying = {size: n for size, n in counts.items() if (size[0] < size[1]) == upright}
    size_px = max(lying, key=lambda size: (lying[size], size[0]))
    found = OneSize(size_px)
    for size in sorted(counts):
        _require_aspect(size, size_px, [item.view.name for item in sized if item.size_px == size])
    found.views = [
        _scaled(item.view, item.size_px, size_px) for item in sized if item.size_px in lying
    ]
    for size in sorted(counts):
        names = _listed([item.view.name for item in sized if item.size_px == size])
        if size in lying and size != size_px:
            found.scaled.append(f"scaled from {_by(size)} to {_by(size_px)} px: {names}")
    aside = [item for item in sized if item.size_px not in lying]
    reference = list(found.views)
    for item in aside:
        view, way = _turned_back(item, size_px, lambda v: judge(reference, v, size_px))
        found.views.append(view)
        found.turned.append(f"{view.name} is turned: read as turned by 90 deg {way}")
    return found


def _require_aspect(size: Size, wanted: Size, names: Sequence[str]) -> None:
    width, height = size if (size[0] < size[1]) == (wanted[0] < wanted[1]) else size[::-1]
    off_px = abs(width * wanted[1] / wanted[0] - height)
    # Rounding either side, in pixels of the smaller of the two.
    if off_px <= ROUNDED_PX * max(1.0, width / wanted[0]):
        return
    raise BadInput(
        f"lens: {_listed(names)}: {_by(size)} px, the others have {_by(wanted)} px, another aspect:"
        " which part of the sensor they show is not known; leave them out, or take all views at one"
        " setting of the camera"
    )


def _scaled(view: BoardView, size: Size, wanted: Size) -> BoardView:
    """Return the view in pixels of another size of the same picture."""
    if size == wanted:
        return view
    factor = np.array(wanted, dtype=np.float64) / size
    return replace(view, px=(view.px + 0.5) * factor - 0.5)


def _turned_back(
    item: SizedView, wanted: Size, off_px: Callable[[BoardView], float]
) -> tuple[BoardView, str]:
    """Return the view as if its picture had not been turned, by the better of both ways."""
    width, height = item.size_px
    u, v = item.view.px.T
    ways = {
        "clockwise": np.column_stack((v, width - 1.0 - u)),
        "counter-clockwise": np.column_stack((height - 1.0 - v, u)),
    }
    views = {
        way: _scaled(replace(item.view, px=px), (height, width), wanted) for way, px in ways.items()
    }
    best = min(views, key=lambda way: off_px(views[way]))
    return views[best], best


def _by(size: Size) -> str:
    return f"{size[0]} x {size[1]}"


def _listed(names: Sequence[str]) -> str:
    more = len(names) - NAMES_SHOWN
    return ", ".join(names[:NAMES_SHOWN]) + (f" and {more} more" if more > 0 else "")
