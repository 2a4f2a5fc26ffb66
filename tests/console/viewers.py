"""Misses and latencies on the served twin, with and without viewers: `python -m tests.console.viewers`.

Runs take turns, so that whatever else the machine does falls on both alike.
"""

from __future__ import annotations

import contextlib
import sys
import tempfile
import threading
from pathlib import Path

import numpy as np

from hil.record.reader import read_run
from tests.console.rig import Console, SocketPage, served_twin

ROUNDS, SECONDS = 6, 10
COUNTS = (0, 5)
NAMES = ("exposure_to_actuation_s", "rtt_s")


def reading(page: SocketPage) -> None:
    """Take everything that is sent, as an open page does."""
    with contextlib.suppress(Exception):
        while True:
            page.socket.recv()


def main() -> None:
    """Print misses and latencies, the median and 99 % over all runs of a kind."""
    found: dict[int, list[dict[str, np.ndarray]]] = {count: [] for count in COUNTS}
    with (
        tempfile.TemporaryDirectory() as work,
        served_twin(Path(work), "--camera", "pose") as (target, camera),
        Console(Path(work)) as console,
        console.page("op") as operator,
    ):
        for number in range(ROUNDS):
            for count in COUNTS if number % 2 else COUNTS[::-1]:
                pages = [console.page(f"viewer {k}") for k in range(count)]
                for page in pages:
                    threading.Thread(target=reading, args=(page,), daemon=True).start()
                patient = [f"safety.{name}=9" for name in ("pose_lost_s", "link_lost_s")]
                end = operator.run(
                    scenario="scenario-1", target=target, camera=camera,
                    overrides=[f"duration_s={SECONDS}", *patient],
                )[-1]["end"]  # fmt: skip
                for page in pages:
                    page.socket.close()
                record = read_run(console.records / end["record"])
                found[count].append(record.samples)
                print(count, end["outcome"], file=sys.stderr, flush=True)
    for count, runs in found.items():
        ticks = sum(run["t_s"].size for run in runs)
        misses = sum(int(np.nansum(run["deadline_miss"])) for run in runs)
        text = [f"{misses} of {ticks} deadlines missed"]
        for name in NAMES:
            values = np.concatenate([run[name] for run in runs])
            median, high = np.nanpercentile(values, [50, 99]) * 1e3
            text.append(f"{name} {median:.1f} ms, 99 % {high:.1f} ms")
        print(f"{count} viewers, {len(runs)} runs: {'; '.join(text)}")


if __name__ == "__main__":
    main()
