"""How a value of a campaign is varied: points, ranges, distributions."""

from __future__ import annotations

import functools
import math
from random import Random
from statistics import NormalDist
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from hil.config.base import Section

# Share of a normal distribution that has to lie within its bounds: draws outside are drawn again.
_LEAST_INSIDE = 1e-3


class Range(Section):
    """Evenly spaced points from `first` to `last`, or in equal ratios."""

    first: float = Field(description="first point")
    last: float = Field(description="last point")
    count: int = Field(ge=2, le=10_000, description="points, both ends among them")
    scale: Literal["linear", "log"] = Field("linear", description="equal steps or equal ratios")

    @model_validator(mode="after")
    def _positive(self) -> Self:
        if self.scale == "log" and not (self.first > 0 and self.last > 0):
            raise ValueError("scale log needs first and last above 0")
        return self

    def points(self) -> list[float]:
        """Return the points; both ends are among them."""
        shares = [i / (self.count - 1) for i in range(self.count)]
        if self.scale == "log":
            return [self.first * (self.last / self.first) ** share for share in shares]
        return [self.first + (self.last - self.first) * share for share in shares]


class Distribution(Section):
    """One value drawn per draw: uniform or log-uniform in low..high, or normal within them.

    What falls outside low..high of a normal one is drawn again, so the bounds hold no pile of rows.
    """

    kind: Literal["uniform", "loguniform", "normal"] = Field(description="of the distribution")
    low: float = Field(-math.inf, description="least value")
    high: float = Field(math.inf, description="largest value")
    mean: float = Field(0.0, description="of a normal one")
    sd: float = Field(1.0, gt=0, description="standard deviation of a normal one")

    model_config = Section.model_config | {"allow_inf_nan": True}

    @model_validator(mode="after")
    def _bounded(self) -> Self:
        if not self.low < self.high:
            raise ValueError("low must be below high")
        if self.kind != "normal" and not (math.isfinite(self.low) and math.isfinite(self.high)):
            raise ValueError(f"{self.kind} needs low and high")
        if self.kind == "loguniform" and self.low <= 0:
            raise ValueError("loguniform needs low above 0")
        if self.kind == "normal":
            bell = NormalDist(self.mean, self.sd)
            inside = bell.cdf(self.high) - bell.cdf(self.low)
            if inside < _LEAST_INSIDE:
                raise ValueError(
                    f"normal: {inside:.2g} of it lies within low and high, at least "
                    f"{_LEAST_INSIDE:g} is needed; move mean, or draw uniform"
                )
        return self

    def draw(self, rng: Random) -> float:
        """Return one value."""
        if self.kind == "uniform":
            return rng.uniform(self.low, self.high)
        if self.kind == "loguniform":
            return math.exp(rng.uniform(math.log(self.low), math.log(self.high)))
        while not self.low <= (value := rng.gauss(self.mean, self.sd)) <= self.high:
            continue  # drawn again: cut off at the bound, many rows would share one value
        return value

    def quantile(self, share: float) -> float:
        """Return the value below which `share` of the distribution lies, 0 to 1."""
        if self.kind == "uniform":
            return self.low + share * (self.high - self.low)
        if self.kind == "loguniform":
            return float(self.low * (self.high / self.low) ** share)
        bell = NormalDist(self.mean, self.sd)
        below, above = bell.cdf(self.low), bell.cdf(self.high)
        inside = min(max(below + share * (above - below), 1e-12), 1.0 - 1e-12)
        return min(max(bell.inv_cdf(inside), self.low), self.high)


Axis = Annotated[Range | list[Any], Field(union_mode="left_to_right")]


@functools.lru_cache(maxsize=4)
def spread_evenly(kind: str, axes: int, draws: int, seed: int) -> list[list[float]]:
    """Return `draws` points of the unit cube that fill it evenly, the same each time."""
    from scipy.stats import qmc  # noqa: PLC0415 - slow import, rarely needed

    if kind == "latin":
        points = qmc.LatinHypercube(axes, rng=seed).random(draws)
    else:  # Sobol's sequence is balanced at powers of two: the first of the next one
        points = qmc.Sobol(axes, rng=seed).random_base2(max(draws - 1, 1).bit_length())[:draws]
    return [[float(x) for x in point] for point in points]
