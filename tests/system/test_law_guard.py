"""A law from outside that ends by an exception which is no Exception is a fault of the law."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil.record.reader import read_run
from tests.cli.command import run_pose

LAW = """
import hil


@hil.outer_law("{name}")
class Cancelled:
    def __init__(self, gains, limits, d0_m):
        self.ticks = 0

    def reset(self, reference, estimate):
        pass

    def step(self, reference, estimate, dt_s):
        self.ticks += 1
        if self.ticks > 10:
            raise {raised}
        return hil.OuterCommand(0.1, 0.0, {{}})
"""


@pytest.mark.parametrize("raised", ["BaseException('over')", "GeneratorExit('over')"])
def test_the_record_is_closed_and_names_the_law(raised: str, tmp_path: Path) -> None:
    """The robot is stopped, the record is whole, and its end says file, line and what was raised."""
    file = tmp_path / "cancelled.py"
    name = (
        f"ends-by-{raised.partition('(')[0].lower()}"  # laws of one process have names of their own
    )
    file.write_text(LAW.format(raised=raised, name=name))
    out = tmp_path / "run"
    done = run_pose("--outer", file, "--set", "duration_s=1.0", "--out", out)
    assert done.status == 3, done.err
    record = read_run(out)
    assert record.problems == ()
    assert record.manifest.outcome == "fault"
    assert f"law {name} (cancelled.py, line 16): step raised" in record.manifest.outcome_detail
    assert [event.kind for event in record.events][-2:] == ["stopped", "fault"]
