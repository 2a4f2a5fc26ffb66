"""Records of a binary log one after another, found again after damage.

A log is records end to end. Where none can stand, the next place is looked for at which several
records follow one another, and the hole is counted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

# at -> where the record ends that can stand there, None where none can
EndOf = Callable[[int], int | None]
# at -> the first place from there on where a record may begin, None when there is none
NextStart = Callable[[int], int | None]

_CHAIN = 3  # records that must follow one another after a hole


@dataclass(slots=True)
class Holes:
    """What could not be read of a log: (first byte, bytes) of each hole; `torn` is of the last one."""

    holes: list[tuple[int, int]] = field(default_factory=list)
    torn: int = 0
    others: list[str] = field(default_factory=list)

    def notes(self) -> list[str]:
        """Return a line for each kind of damage."""
        said = []
        if self.holes:
            total, most = sum(size for _, size in self.holes), max(size for _, size in self.holes)
            said.append(
                f"{len(self.holes)} holes of {total} bytes that are no records, the first at byte "
                f"{self.holes[0][0]}, the largest of {most} bytes: left out"
            )
        if self.torn:
            said.append(f"the last {self.torn} bytes are no whole record: left out")
        return said + self.others


def walk(
    size: int, start: int, end_of: EndOf, next_start: NextStart, holes: Holes
) -> Iterator[tuple[int, int]]:
    """Yield (first byte, end) of each record; what lies between goes to `holes`.

    A record counts when another can follow it, or the log ends with it.
    """
    at = start
    while at < size:
        end = end_of(at)
        if end is not None and (end == size or end_of(end) is not None):
            yield at, end
            at = end
            continue
        after = _resumed(at + 1, size, end_of, next_start)
        if after is None:
            if end is not None:  # whole, and only what follows is cut off
                yield at, end
            holes.torn = size - (end or at)
            return
        holes.holes.append((at, after - at))
        at = after


def _resumed(at: int, size: int, end_of: EndOf, next_start: NextStart) -> int | None:
    """Return the next place at which records follow one another again."""
    while (found := next_start(at)) is not None:
        end: int | None = found
        for _ in range(_CHAIN):
            end = end_of(end) if end is not None and end != size else end
        if end is not None:
            return found
        at = found + 1
    return None
