"""How often the intervals of `hil fit` hold: `python -m tests.log_fit.coverage [TWINS]`.

Robots drawn at random drive for a minute; a parameter counts where the log tells it. Prints, for
each, how often it was told, how often the truth lay inside, and the usual half width.
"""

from __future__ import annotations

import sys
import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np

from hil.config.load import load_robot
from hil.study.log_fit.fit import fit_log
from tests.log_fit.twins import Answer, drive, write_csv


def measure(
    twins: int, first: int = 100, duration_s: float = 60.0
) -> dict[str, list[tuple[bool, float]]]:
    """Return, by parameter, (inside, half width) of every twin whose log told it."""
    found: dict[str, list[tuple[bool, float]]] = defaultdict(list)
    robot = load_robot("thesis-4wd")
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + twins):
            answer = Answer.drawn(np.random.default_rng(seed))
            log = write_csv(Path(folder) / f"{seed}.csv", drive(answer, seed, duration_s))
            fit = fit_log(log, None, robot)
            assert fit.body is not None
            for item in fit.body.found.estimates:
                if item.told:
                    inside = item.low <= getattr(answer, item.name) <= item.high
                    found[item.name].append((bool(inside), 0.5 * (item.high - item.low)))
    return found


def main() -> None:
    """Print the table."""
    twins = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    found = measure(twins)
    inside = told = 0
    for name, rows in found.items():
        held = sum(ok for ok, _ in rows)
        inside, told = inside + held, told + len(rows)
        half = float(np.median([width for _, width in rows]))
        print(f"{name}: told {len(rows)} of {twins}, inside {held}, usual half width {half:.4g}")
    print(f"together: {inside} of {told} inside ({inside / told:.1%})")


if __name__ == "__main__":
    main()
