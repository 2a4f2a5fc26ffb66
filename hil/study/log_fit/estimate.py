"""Parameters by robust least squares, with intervals from how much the windows disagree.

Intervals are a delete-one-window jackknife (linearised) with Student's t over the windows. A
parameter that the log does not tell is held at its usual value, and what it might be instead widens
the intervals of the others.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Points = Mapping[str, float]

CONFIDENCE = 0.95
_LOSS_AT = 2.0  # residuals beyond two sigma count less
_MOST_STEPS = 25
_POLISHES = 4


@dataclass(frozen=True, slots=True)
class Parameter:
    """One thing to find: bounds, usual value, and the half interval up to which it counts as told.

    `share` is that limit as a share of the value (the larger of both holds). `could_be` is how far
    off its usual value it may really be when the log does not tell it.
    """

    name: str
    unit: str
    meaning: str
    usual: float
    low: float
    high: float
    known_to: float
    step: float
    share: float = 0.0
    could_be: float = math.inf
    main: bool = False


@dataclass(frozen=True, slots=True)
class Estimate:
    """A parameter found, with its 95 % interval; `told` says whether the log tells it."""

    name: str
    unit: str
    meaning: str
    value: float
    low: float
    high: float
    told: bool
    note: str = ""

    def to_json(self) -> dict[str, Any]:
        """Return the estimate for a JSON document; an endless interval is null."""
        ends = [end if math.isfinite(end) else None for end in (self.low, self.high)]
        return {
            "value": self.value,
            "unit": self.unit,
            "interval_95": ends if self.told else None,
            "told": self.told,
            "meaning": self.meaning,
            "note": self.note,
        }

    def text(self) -> str:
        """Return the estimate in one line."""
        if not self.told:
            return f"{self.name}: not told by this log{f' ({self.note})' if self.note else ''}"
        said = f"{self.value:.4g} ({self.low:.4g} to {self.high:.4g}) {self.unit}".rstrip()
        return f"{self.name}: {said}{f'; {self.note}' if self.note else ''}"


@dataclass(frozen=True, slots=True)
class Found:
    """The least-squares answer: every parameter's value and estimate."""

    values: dict[str, float]
    estimates: tuple[Estimate, ...]
    windows: int

    def told(self, name: str) -> bool:
        """Say whether the log tells a parameter."""
        return any(item.name == name and item.told for item in self.estimates)


Residual = Callable[[dict[str, float]], "Array"]


def estimate(
    parameters: Sequence[Parameter],
    residual: Residual,
    window: NDArray[np.intp],
    starts: Sequence[Points],
    floor: Mapping[str, float],
) -> Found:
    """Find parameters; `residual` is in sigmas, `window` names the window of each of its entries.

    `floor` is what numbers alone (cells, rounding) leave unknown, by parameter, as a half interval.
    """
    values = _best_start(parameters, residual, starts)
    free = list(parameters)
    fixed: dict[str, tuple[float, str]] = {}
    reaches: dict[str, float] = {}
    while True:
        values, jacobian, rest = _search(free, residual, values)
        reach = _reach(jacobian, rest, window)
        reaches = {item.name: float(reach[k]) for k, item in enumerate(free)}
        worst = _least_known([item for item in free if not item.main], values, reaches)
        if worst is None:
            break
        could = min(worst.could_be, reaches[worst.name] + abs(values[worst.name] - worst.usual))
        fixed[worst.name] = (could, f"taken as {worst.usual:g} {worst.unit}".rstrip())
        values = values | {worst.name: worst.usual}
        free = [item for item in free if item.name != worst.name]
    extra = _from_fixed(parameters, len(free), fixed, residual, values, jacobian)
    alone = dict(reaches)
    for k, item in enumerate(free):
        reaches[item.name] = math.hypot(reach[k], floor.get(item.name, 0.0), math.sqrt(extra[k]))
    found = []
    for item in parameters:
        if item.name in fixed:
            found.append(_untold(item, item.usual, fixed[item.name][1]))
        else:
            found.append(_told(item, values[item.name], reaches[item.name], alone[item.name]))
    return Found(values, tuple(found), int(np.unique(window).size))


def first_values(
    parameters: Sequence[Parameter], residual: Residual, starts: Sequence[Points]
) -> dict[str, float]:
    """Return the best values without intervals, to learn from them how large the noise is."""
    return _search(parameters, residual, _best_start(parameters, residual, starts))[0]


def _told(item: Parameter, value: float, reach: float, alone: float) -> Estimate:
    if not math.isfinite(reach) or reach > _limit(item, value):
        note = f"{value:.4g} +- {reach:.2g}" if math.isfinite(reach) and reach < 1e3 else ""
        if note and alone <= _limit(item, value):
            note += f"; +- {alone:.2g} if what else is not told has its usual value"
        return _untold(item, value, note)
    low, high = value - reach, value + reach
    note = ""
    if value <= item.low + 1e-9 and item.usual == item.low:
        low, note = item.low, "none seen"
    return Estimate(
        item.name, item.unit, item.meaning, value, max(low, min(item.low, item.usual)), high,
        told=True, note=note,
    )  # fmt: skip


def _untold(item: Parameter, value: float, note: str) -> Estimate:
    return Estimate(
        item.name, item.unit, item.meaning, value, -math.inf, math.inf, told=False, note=note
    )


def _limit(item: Parameter, value: float) -> float:
    return max(item.known_to, item.share * abs(value))


def _least_known(
    items: Sequence[Parameter], values: Points, reaches: Mapping[str, float]
) -> Parameter | None:
    """Return the parameter that exceeds its limit most, None when all keep to theirs."""
    ratio = {item.name: reaches[item.name] / _limit(item, values[item.name]) for item in items}
    over = [item for item in items if not ratio[item.name] <= 1.0]
    return max(over, key=lambda item: ratio[item.name], default=None)


def _best_start(
    parameters: Sequence[Parameter], residual: Residual, starts: Sequence[Points]
) -> dict[str, float]:
    usual = {item.name: item.usual for item in parameters}
    places = [usual | dict(start) for start in starts] or [usual]
    costs = [_cost(residual(place)) for place in places]
    return places[int(np.argmin(costs))]


def _cost(values: Array) -> float:
    scaled = values / _LOSS_AT
    return float((np.sqrt(1.0 + scaled * scaled) - 1.0).sum())


def _search(
    free: Sequence[Parameter], residual: Residual, start: Points
) -> tuple[dict[str, float], Array, Array]:
    """Return the best values, and jacobian and residual there, weighted as the loss does."""
    base = dict(start)
    low = np.array([item.low for item in free])
    high = np.array([item.high for item in free])
    steps = np.array([item.step for item in free])
    inside = np.clip(
        np.array([base[item.name] for item in free]),
        low + 1e-4 * (high - low), high - 1e-4 * (high - low),
    )  # fmt: skip

    def at(point: Array) -> dict[str, float]:
        return base | {item.name: float(point[k]) for k, item in enumerate(free)}

    def of(point: Array) -> Array:
        return residual(at(point))

    def slopes(point: Array, *, both_ways: bool = False) -> Array:
        here = None if both_ways else of(point)
        columns = []
        for k, step in enumerate(steps):
            up, down = point.copy(), point.copy()
            up[k] = min(point[k] + step, high[k])
            if here is None or up[k] - point[k] < 0.5 * step:
                down[k] = max(point[k] - step, low[k])
            below = here if here is not None and down[k] == point[k] else of(down)
            columns.append((of(up) - below) / (up[k] - down[k]))
        return np.stack(columns, axis=1)

    found = least_squares(
        of, inside, jac=slopes, bounds=(low, high), loss="soft_l1", f_scale=_LOSS_AT,
        x_scale=np.array([max(item.known_to, item.step) for item in free]), max_nfev=_MOST_STEPS,
        ftol=1e-7, xtol=1e-6, gtol=1e-6,
    )  # fmt: skip
    # Bounds are never quite reached by the search.
    point = np.where(found.x - low < 1e-6 * (high - low), low, found.x)
    rest = of(point)
    jacobian = slopes(point, both_ways=True) * _weighted(rest)[:, None]
    # A few steps with better slopes: where it ends must not depend on how it came there.
    for _ in range(_POLISHES):
        step = np.linalg.lstsq(jacobian, -rest * _weighted(rest), rcond=1e-9)[0]
        after = np.clip(point + step, low, high)
        if (np.abs(after - point) < 1e-3 * steps).all() or _cost(of(after)) >= _cost(rest):
            break
        point = after
        rest = of(point)
        jacobian = slopes(point, both_ways=True) * _weighted(rest)[:, None]
    return at(point), jacobian, rest * _weighted(rest)


def _weighted(rest: Array) -> Array:
    """Return the square roots of the weights that the loss gives."""
    return np.asarray((1.0 + (rest / _LOSS_AT) ** 2) ** -0.25)


def _reach(jacobian: Array, rest: Array, window: NDArray[np.intp]) -> Array:
    """Return half the 95 % interval of each parameter, infinite where nothing tells it.

    `jacobian` and `rest` are weighted as the loss does, so that their product is the slope of the loss. What
    the loss lacks against a square counts twice, in its slope and in its curvature (Huber and Ronchetti 2009,
    6.3): intervals of the weighted squares alone would be too narrow.
    """
    size = jacobian.shape[1]
    names = np.unique(window)
    if names.size < 3:
        return np.full(size, math.inf)
    scale = np.sqrt((jacobian**2).sum(axis=0))
    silent = scale < 1e-9
    unit = np.where(silent, 1.0, scale)
    slopes = jacobian / unit * rest[:, None]
    curved = jacobian / unit * _curvature(rest)[:, None]
    whole = curved.T @ curved
    inverse = np.linalg.inv(whole + 1e-12 * np.eye(size))
    moves, shares = [], []
    for name in names:
        rows = window == name
        own = curved[rows].T @ curved[rows]
        shares.append(np.diag(inverse @ own @ inverse) / np.diag(inverse))
        left = whole - own
        # Nothing left without this window: the ridge makes its move huge, as it should be.
        left = left + 1e-9 * np.eye(size)
        moves.append(np.linalg.solve(left, slopes[rows].sum(axis=0)))
    count = names.size
    spread = np.array(moves) - np.mean(moves, axis=0)
    # What disturbs a robot for half a second and longer reaches into the next window: neighbours that move
    # a value the same way are less than two (lag 1 of Newey and West 1987, never taken as a gain).
    next_to = (np.diff(names) == 1)[:, None]
    alike = np.maximum((spread[:-1] * spread[1:] * next_to).sum(axis=0), 0.0)
    variance = (count - 1.0) / count * ((spread**2).sum(axis=0) + 2.0 * alike)
    # Noise alone: a log that happens to agree with itself is not better known than its noise says.
    free = rest.size / max(rest.size - size - 3 * count, 1)
    plain = free * np.diag(inverse @ (slopes.T @ slopes) @ inverse)
    # Windows tell unequally much: as many count as would, told equally, make the same sum of squares.
    equal = 1.0 / np.maximum((np.array(shares) ** 2).sum(axis=0), 1.0 / count)
    factor = student.ppf(0.5 + CONFIDENCE / 2.0, np.maximum(equal - 1.0, 1.0))
    reach = factor * np.sqrt(np.maximum(variance, plain)) / unit
    return np.asarray(np.where(silent, math.inf, reach))


def _curvature(rest: Array) -> Array:
    """Return the square root of the loss's curvature over the weight, from weighted residuals.

    With u = r/c the weight is (1 + u^2)^(-1/2) and the curvature (1 + u^2)^(-3/2); the weighted
    residual v = u (1 + u^2)^(-1/4) gives 1 + u^2 back.
    """
    squared = (rest / _LOSS_AT) ** 2
    # v^4 = u^4/(1 + u^2), so that u^2 = (v^4 + sqrt(v^8 + 4 v^4))/2.
    fourth = squared**2
    return np.asarray((1.0 + 0.5 * (fourth + np.sqrt(fourth**2 + 4.0 * fourth))) ** -0.5)


def _from_fixed(
    parameters: Sequence[Parameter],
    free: int,
    fixed: Mapping[str, tuple[float, str]],
    residual: Residual,
    values: Points,
    jacobian: Array,
) -> Array:
    """Return by how much, squared, free parameters are off if fixed ones are not what was taken."""
    total = np.zeros(free)
    whole = np.linalg.pinv(jacobian, rcond=1e-9)
    for item in parameters:
        if item.name not in fixed:
            continue
        could, _ = fixed[item.name]
        if not math.isfinite(could) or could <= 0.0:
            continue
        up = min(values[item.name] + item.step, item.high)
        down = max(values[item.name] - item.step, item.low)
        column = residual(dict(values) | {item.name: up}) - residual(
            dict(values) | {item.name: down}
        )
        total += (whole @ (column / (up - down)) * could) ** 2
    return total
