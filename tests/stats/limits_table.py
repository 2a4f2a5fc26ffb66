"""The table "Where each law stops working": `python -m tests.stats.limits_table FOLDER`.

FOLDER is that of `hil sweep limits --out FOLDER` (10,000 runs, seven minutes of two free cores).
"""

from __future__ import annotations

import sys
from pathlib import Path

import pyarrow.parquet as pq

from hil.study.campaign.findings import outcomes_of, sentences
from hil.study.campaign.plan import load_campaign


def main() -> None:
    """Print the share of runs that hold, by arm, at every place of every axis, and all sentences."""
    outcomes = outcomes_of(
        load_campaign("limits"), pq.read_table(Path(sys.argv[1]) / "results.parquet")
    )
    print("| |", " | ".join(outcomes.labels), "| difference, 95 % |\n| --- | --- | --- | --- |")
    for axis in outcomes.points:
        for station in outcomes.stations(axis):
            shares = [
                f"{100 * outcomes.level('holds', arm, station.pairs)[0]:.0f} %" for arm in (0, 1)
            ]
            found = outcomes.difference("holds", 1, station.pairs)
            mean, low, high = (
                100 * value for value in (found.mean, found.interval.low, found.interval.high)
            )
            told = f"**{mean:+.0f}**" if found.certain else f"{mean:+.0f}"
            print(
                f"| {axis} {station.value:g} |", " | ".join(shares),
                f"| {told} ({low:.0f} to {high:.0f}) |",
            )  # fmt: skip
    print(*sentences(outcomes), sep="\n")


if __name__ == "__main__":
    main()
