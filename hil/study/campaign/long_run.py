"""One long recorded run in a process of its own: `python -m hil.study.campaign.long_run SECONDS`.

It prints what it measured as a line of JSON.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

from hil.analysis.speed import memory_mb, peak_memory_mb
from hil.config.load import load_scenario
from hil.core.errors import RigFault
from hil.runs.execute import RunSpec, execute

# The robot's own battery is empty after 3 h of driving.
_BATTERY = "robot.battery.capacity_a_h=50"
_TIMES = 20  # at which the memory is noted


@dataclass(frozen=True, slots=True)
class LongRun:
    """Processor time (s), largest memory (MB) and the record's size (MB) of a run; its memory on the way.

    `course` has (time into the run in s, memory in MB).
    """

    cpu_s: float
    peak_mb: float
    disk_mb: float
    course: list[tuple[float, float]]


class _Course:
    """Notes the memory at times evenly spaced over a run."""

    def __init__(self, length_s: int) -> None:
        self._every_s = length_s / _TIMES
        self.noted: list[tuple[float, float]] = []

    def __call__(self, t_s: float) -> None:
        """Take the time of a tick."""
        if t_s >= self._every_s * (len(self.noted) + 1):
            self.noted.append((t_s, memory_mb()))


def recorded(length_s: int) -> LongRun:
    """Run the circle, so long, recorded, and return what it took; raises RigFault where it ended early."""
    scenario = load_scenario("circle", [f"duration_s={length_s}", _BATTERY])
    course = _Course(length_s)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        spec = RunSpec(scenario, "twin", "pose", "asg-ism", "asg-ism", 1, out)
        record = execute(spec, progress=course)
        record.verdicts()
        size = sum(file.stat().st_size for file in out.rglob("*") if file.is_file())
    if record.manifest.outcome != "complete":
        raise RigFault(record.manifest.outcome_detail)
    return LongRun(time.process_time(), peak_memory_mb(), size * 1e-6, course.noted)


if __name__ == "__main__":
    print(json.dumps(asdict(recorded(int(sys.argv[1])))))
