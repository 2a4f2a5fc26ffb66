"""How often a fit's intervals hold the truth: `python -m tests.replay.fit_coverage` (minutes).

Runs of robots that differ from what is believed in fitted values alone are recorded and fitted;
for each ratio the fits whose interval holds the truth are counted (docs/replay.md).
"""

from __future__ import annotations

import tempfile
from collections import Counter
from pathlib import Path
from random import Random

from hil.config.load import build, load_scenario
from hil.config.scenario import Scenario
from hil.core.errors import BadInput
from hil.replays.exact import read_source
from hil.replays.fit import GROUPS, Rehearsal, fit_twin
from hil.runs.execute import RunSpec, execute

# Scenario, seconds, and how many records of it.
RECORDS = (("scenario-1", 20, 7), ("scenario-2", 20, 7), ("circle", 40, 6))


def main() -> None:
    """Print each fit, then per ratio how many held and how many were told to be known."""
    rng, fits = Random(5), 0
    held: Counter[str] = Counter()
    known: Counter[str] = Counter()
    cases = [(name, s, seed) for name, s, count in RECORDS for seed in range(100, 100 + count)]
    for name, duration_s, seed in cases:
        true = {group: round(rng.uniform(0.92, 1.08), 3) for group in GROUPS}
        ratios = {key: true[group] for group, keys in GROUPS.items() for key in keys}
        table = ", ".join(f'"{key}"={value}' for key, value in ratios.items())
        scenario = load_scenario(name, (f"mismatch={{{table}}}", f"duration_s={duration_s}"))
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "run"
            execute(RunSpec(scenario, "twin", "pose", "pid", "asg-ism", seed, out, rerun=False))
            source = read_source(out)
            try:
                fit = fit_twin(
                    Rehearsal(source, build(Scenario, source.manifest.scenario, "record"))
                )
            except BadInput as refusal:
                print(name, seed, refusal, flush=True)
                continue
        fits += 1
        for group, (_, low, high) in fit.ratios.items():
            held[group] += low <= true[group] <= high
            known[group] += fit.identifiable(group)
        told = {g: tuple(round(v, 3) for v in (true[g], *r)) for g, r in fit.ratios.items()}
        print(name, seed, told, flush=True)
    for group in GROUPS:
        print(f"{group}: {held[group]} of {fits} held, {known[group]} identifiable")


if __name__ == "__main__":
    main()
