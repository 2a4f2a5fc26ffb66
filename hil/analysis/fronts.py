"""Fronts of several scores at once (all lower is better): which points are on one, and how good it is."""

from __future__ import annotations

import math
from collections.abc import Sequence

Point = Sequence[float]


def dominates(one: Point, other: Point) -> bool:
    """Say whether `one` is nowhere worse than `other` and somewhere better."""
    return all(a <= b for a, b in zip(one, other, strict=True)) and any(
        a < b for a, b in zip(one, other, strict=True)
    )


def front_of(points: Sequence[Point]) -> list[int]:
    """Return the places of the points that no other dominates, of equal ones the first."""
    found = []
    for place, point in enumerate(points):
        beaten = any(
            dominates(other, point) or (i < place and tuple(other) == tuple(point))
            for i, other in enumerate(points)
        )
        if not beaten:
            found.append(place)
    return found


def hypervolume(points: Sequence[Point], reference: Point) -> float:
    """Return the volume between the points and a reference that is worse than all of them, exactly.

    By slices along the last score; points not below the reference add nothing.
    """
    inside = [
        tuple(point)
        for point in points
        if all(a < b for a, b in zip(point, reference, strict=True))
    ]
    if not inside:
        return 0.0
    if len(reference) == 1:
        return float(reference[0] - min(point[0] for point in inside))
    inside = sorted((inside[i] for i in front_of(inside)), key=lambda point: point[-1])
    total = 0.0
    for place, point in enumerate(inside):
        above = inside[place + 1][-1] if place + 1 < len(inside) else reference[-1]
        if above > point[-1]:
            slab = hypervolume([p[:-1] for p in inside[: place + 1]], reference[:-1])
            total += slab * (above - point[-1])
    return total


def share_of_box(points: Sequence[Point], least: float, most: float) -> float:
    """Return the hypervolume on logarithmic scales as a share of the box from `least` to `most`.

    Scores below `least` count as it.
    """
    if not points:
        return 0.0
    low, high = math.log10(least), math.log10(most)
    logs = [[max(math.log10(max(value, least)), low) for value in point] for point in points]
    size = len(points[0])
    return hypervolume(logs, [high] * size) / (high - low) ** size
