"""One long recorded run in a process of its own: `python -m hil.study.campaign.long_run SECONDS`.

It prints a line of JSON: its processor time (s), the largest memory it had (MB) and the record's size (MB).
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path

from hil.analysis.speed import peak_memory_mb
from hil.config.load import load_scenario
from hil.core.errors import RigFault
from hil.runs.execute import RunSpec, execute

# The robot's own battery is empty after 3 h of driving.
_BATTERY = "robot.battery.capacity_a_h=50"


def recorded(length_s: int) -> tuple[float, float, float]:
    """Run the circle, so long, and return processor time (s), largest memory (MB) and disk (MB)."""
    scenario = load_scenario("circle", [f"duration_s={length_s}", _BATTERY])
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        record = execute(RunSpec(scenario, "twin", "pose", "asg-ism", "asg-ism", 1, out))
        record.verdicts()
        size = sum(file.stat().st_size for file in out.rglob("*") if file.is_file())
    if record.manifest.outcome != "complete":
        raise RigFault(record.manifest.outcome_detail)
    return time.process_time(), peak_memory_mb(), size * 1e-6


if __name__ == "__main__":
    print(json.dumps(recorded(int(sys.argv[1]))))
