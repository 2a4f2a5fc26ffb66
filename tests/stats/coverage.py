"""How often the intervals hold what they say, by simulation.

`python -m tests.stats.coverage` prints the table of docs/statistics.md (two minutes); the tests do
the same with fewer studies.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from hil.analysis.intervals import crossed_interval, mean_intervals

Draw = Callable[[np.random.Generator, tuple[int, ...]], np.ndarray]


def lognormal(sigma: float) -> Draw:
    """Return lognormal values about their mean."""
    mean = math.exp(0.5 * sigma**2)
    return lambda rng, shape: rng.lognormal(0.0, sigma, shape) - mean


def contaminated(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Return normal values, one in ten of them with five times the spread."""
    return rng.normal(size=shape) * np.where(rng.random(shape) < 0.1, 5.0, 1.0)


# Every one has the mean 0.
USUAL: dict[str, Draw] = {
    "normal": lambda rng, shape: rng.normal(size=shape),
    "exponential": lambda rng, shape: rng.exponential(size=shape) - 1.0,
    "lognormal, sigma 0.5": lognormal(0.5),
    "t, 3 degrees": lambda rng, shape: rng.standard_t(3, shape),
    "Laplace": lambda rng, shape: rng.laplace(size=shape),
    "contaminated normal": contaminated,
}
VERY_SKEWED: dict[str, Draw] = {
    "lognormal, sigma 0.75": lognormal(0.75),
    "lognormal, sigma 1": lognormal(1.0),
}
SIZES = (3, 4, 5, 6, 8, 10, 14, 20, 30, 50, 100, 400, 600)


def coverage(draw: Draw, size: int, studies: int, seed: int = 1) -> float:
    """Return the share of studies of `size` values whose interval holds the mean, 0."""
    ends = mean_intervals(draw(np.random.default_rng((seed, size)), (studies, size)))
    return float(np.mean((ends[:, 0] <= 0.0) & (ends[:, 1] >= 0.0)))


def crossed_coverage(
    seeds: int, draws: int, sds: tuple[float, float, float], studies: int, seed: int = 1
) -> float:
    """Return the coverage where each value is a seed's part + a draw's part + its own.

    `sds` are the standard deviations of the three parts.
    """
    rng = np.random.default_rng((seed, seeds, draws))
    rows, columns = np.divmod(np.arange(seeds * draws), draws)
    held = 0
    for _ in range(studies):
        parts = (rng.normal(size=n) * sd for n, sd in zip((seeds, draws), sds[:2], strict=True))
        of_seed, of_draw = parts
        values = of_seed[rows] + of_draw[columns] + sds[2] * rng.normal(size=rows.size)
        found = crossed_interval(values, rows.tolist(), columns.tolist())
        held += found.low <= 0.0 <= found.high
    return held / studies


def main() -> None:
    """Print the tables."""
    studies = 10_000
    print("| differences |", " | ".join(str(size) for size in SIZES), "|")
    print("| --- |", " --- |" * len(SIZES))
    for name, draw in (USUAL | VERY_SKEWED).items():
        cells = (f"{100 * coverage(draw, size, studies):.1f}" for size in SIZES)
        print(f"| {name} |", " | ".join(cells), "|", flush=True)
    print("crossed designs, seeds x draws, sds of seed, draw, own part:")
    for seeds, draws in ((6, 6), (10, 5), (10, 20), (3, 50), (20, 1)):
        for sds in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 1.0)):
            if draws == 1 and sds[1]:
                continue
            print(seeds, draws, sds, f"{100 * crossed_coverage(seeds, draws, sds, 2000):.1f}")


if __name__ == "__main__":
    main()
